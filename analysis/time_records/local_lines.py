"""The response to one sweep or any other single signal, by neighbouring lines of its spectrum.

Owns the local polynomial method (Schoukens, Vandersteen, Barbe, Pintelon, IEEE Trans. Instrum.
Meas. 58 (2009) 2102): near a frequency both the gain and the transient of the servo are smooth,
the input's spectrum is not. What is left over is noise, and gives the error.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from analysis.time_records.points import Points
from daq.errors import AnalysisError
from daq.time_records.record import TimeRecord

__all__ = ["swept_response"]

_DEGREE = 2
_LEAST_LINES = 15
_MOST_POINTS = 400
_MOST_ALIKE = 30.0
"""Greatest condition number of a group."""
_POWER = 1e-3
"""Groups of lines with less input power than this share of the greatest are left out."""


def swept_response(record: TimeRecord, resolution_hz: float | None = None) -> Points:
    """Gain at steps of the resolution.

    Parameters
    ----------
    resolution_hz
        Step of frequencies, Hz; a finer one than 15 lines of the record's spectrum is widened
        to that.

    Raises
    ------
    AnalysisError
        If the record is too short.
    """
    n, rate = len(record), record.rate_hz
    x, y = (np.fft.rfft(v - np.mean(v)) / n for v in (record.input_v, record.output_v))
    spacing = rate / n
    power = np.abs(x) ** 2
    smooth = np.convolve(power, np.ones(_LEAST_LINES) / _LEAST_LINES, "same")
    driven = np.flatnonzero(smooth > _POWER * np.sort(smooth)[-max(smooth.size // 50, 3)])
    lines = _LEAST_LINES
    if resolution_hz is not None:
        lines = max(lines, round(resolution_hz / spacing))
    else:
        lines = max(lines, driven.size // _MOST_POINTS)
    half = lines // 2
    centres = np.arange(
        max(half + 1, int(driven[0]) if driven.size else 0), x.size - half - 1, 2 * half + 1
    )
    centres = centres[np.isin(centres, driven)]
    if centres.size < 3:
        raise AnalysisError(
            "the record is too short for the response to one sweep; give a longer one"
        )
    offsets = np.arange(-half, half + 1)
    u = offsets / half
    rows = centres[:, None] + offsets
    powers = u[:, None] ** np.arange(_DEGREE + 1)
    local = x[rows]
    scale = np.sqrt(np.mean(np.abs(local) ** 2, axis=1))
    basis = np.concatenate(
        [
            local[:, :, None] / scale[:, None, None] * powers,
            np.broadcast_to(powers, (centres.size, *powers.shape)).astype(complex),
        ],
        axis=2,
    )
    # Next to the ends of a sweep the signal is too like the servo's transient to be told from it.
    told = np.linalg.cond(basis) < _MOST_ALIKE
    if np.count_nonzero(told) < 3:
        raise AnalysisError("the record is too short to tell the response from the transient")
    centres, basis, rows, scale = centres[told], basis[told], rows[told], scale[told]
    gain, along = _solved(basis, y[rows], scale)
    level = np.full(centres.size, np.sqrt(2.0) * float(np.std(record.input_v)))
    return Points(
        np.asarray(centres * spacing, dtype=float), level, gain, along, along,
        f"local polynomials over {2 * half + 1} lines of the spectrum",
        ("the level is that of a sine of the input's rms",),
    )  # fmt: skip


def _solved(
    basis: NDArray[np.complex128], y: NDArray[np.complex128], scale: NDArray[np.float64]
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    inverse = np.linalg.pinv(basis)
    theta = np.einsum("nij,nj->ni", inverse, y)
    left = y - np.einsum("nij,nj->ni", basis, theta)
    dof = basis.shape[1] - basis.shape[2]
    # Mean square of one component of the noise of a line, of neighbouring groups together.
    variance = np.sum(np.abs(left) ** 2, axis=1) / (2 * dof)
    gain = theta[:, 0] / scale
    variance *= (stdtrit(2 * dof, 0.975) / 1.96) ** 2
    error = np.sqrt(variance * np.sum(np.abs(inverse[:, 0]) ** 2, axis=1)) / scale
    return gain, np.asarray(error / np.maximum(np.abs(gain), 1e-300))
