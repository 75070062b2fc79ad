"""The response by spectra: averaged segments of noise, and periods of a periodic signal.

Owns H1, H2 and Hv, coherence, and the errors that follow from the number of averages. It decides
nothing about what the signal is.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.signal import ShortTimeFFT, get_window

from analysis.time_records.points import Points
from daq.errors import AnalysisError, InputError
from daq.excitation.signal import MOST_LINES, Excitation, Kind
from daq.time_records.record import TimeRecord

__all__ = ["Estimator", "noise_response", "periodic_response", "period_of"]

Estimator = Literal["H1", "H2", "Hv"]
_AVERAGES = 20
"""Segments, without overlap, where no resolution is asked for."""
_POWER = 1e-4
"""Lines with less input power than this share of the greatest are left out."""
_PERIODIC = 0.98
"""Correlation of a signal with itself one period later."""


def noise_response(
    record: TimeRecord, estimator: Estimator = "H1", resolution_hz: float | None = None
) -> Points:
    """Gain by averaged segments, Hann window, half overlapped.

    Parameters
    ----------
    estimator
        ``H1``: noise at the output; ``H2``: noise at the input; ``Hv``: at both, the geometric
        mean of their moduli with the phase of H1.
    resolution_hz
        Step of frequencies, Hz.

    Raises
    ------
    InputError
        If the resolution leaves fewer than four segments.
    """
    rate, n = record.rate_hz, len(record)
    size = n // _AVERAGES if resolution_hz is None else round(rate / resolution_hz)
    if not 16 <= size <= n // 4:
        raise InputError(
            f"segments of {size} samples for a record of {n} leave no four averages; "
            f"give --resolution of {4.0 * rate / n:.3g} Hz or more"
        )
    whole, half = _spectra(record, size), _spectra(record, size // 2)
    gain, share, power = _gain(whole, estimator), _error(whole, size), whole[1]
    frequency = np.arange(len(gain)) * rate / size
    keep = (power > _POWER * power[1:].max()) & (np.arange(len(gain)) > 1)
    keep[-1] = False
    keep &= np.isfinite(gain) & (np.abs(np.nan_to_num(gain)) > 0.0)
    gain = np.where(keep, gain, 1.0)
    # A resonance narrower than the segments resolve is read too flat, by a quarter of what half
    # the length does: the difference counts as error.
    coarse = np.nan_to_num(_gain(half, estimator))
    at = np.arange(len(half[1])) * rate / (size // 2)
    between = np.interp(frequency, at, coarse.real) + 1j * np.interp(frequency, at, coarse.imag)
    bias = np.abs(gain - between) / 3.0 / np.abs(gain)
    noise_of_bias = np.hypot(share, np.interp(frequency, at, _error(half, size // 2))) / 3.0
    bias = np.sqrt(np.maximum(bias**2 - noise_of_bias**2, 0.0))
    share = np.hypot(share, bias)
    level = np.full(frequency.size, np.sqrt(2.0) * float(np.std(record.input_v)))
    signal = None
    if estimator == "H1":
        signal = _signal("noise", size / rate, np.flatnonzero(keep), np.sqrt(power[keep]))
    notes = (
        f"{len(record) // size} segments without overlap; coherence "
        f"{np.min(_coherence(whole)[keep]):.3f} to {np.max(_coherence(whole)[keep]):.3f}",
        "the level is that of a sine of the input's rms",
    )
    return Points(
        frequency[keep], level[keep], gain[keep], share[keep], share[keep],
        f"{estimator} by averaged segments (Hann, half overlapped)", notes,
        settle_cycles=None if signal is None else 1,
        integrate_cycles=None if signal is None else whole[3],
        coherence=_coherence(whole)[keep],
        signal=signal,
    )  # fmt: skip


_Spectra = tuple[NDArray[np.complex128], NDArray[np.float64], NDArray[np.float64], int]


def _spectra(record: TimeRecord, size: int) -> _Spectra:
    """Cross power, input power, output power, and number of segments."""
    transform = ShortTimeFFT(_window(size), hop=size // 2, fs=record.rate_hz)
    low, high = transform.lower_border_end[1], transform.upper_border_begin(len(record))[1]
    x, y = (
        transform.stft_detrend(v, "constant", p0=low, p1=high)
        for v in (record.input_v, record.output_v)
    )
    return (
        np.mean(np.conj(x) * y, axis=1),
        np.mean(np.abs(x) ** 2, axis=1),
        np.mean(np.abs(y) ** 2, axis=1),
        x.shape[1],
    )


def _window(size: int) -> NDArray[np.float64]:
    return np.asarray(get_window("hann", size), dtype=float)


def _coherence(spectra: _Spectra) -> NDArray[np.float64]:
    cross, power, output, _ = spectra
    return np.asarray(np.clip(np.abs(cross) ** 2 / np.maximum(power * output, 1e-300), 0.0, 1.0))


def _gain(spectra: _Spectra, estimator: Estimator) -> NDArray[np.complex128]:
    cross, power, output, _ = spectra
    with np.errstate(all="ignore"):
        h1 = cross / power
        if estimator == "H1":
            return np.asarray(h1)
        h2 = output / np.conj(cross)
        if estimator == "H2":
            return np.asarray(h2, dtype=complex)
        return np.asarray(np.sqrt(np.abs(h1) * np.abs(h2)) * np.exp(1j * np.angle(h1)))


def _error(spectra: _Spectra, size: int) -> NDArray[np.float64]:
    """Standard error along and across the gain, as a share (Bendat and Piersol, eq. 9.90)."""
    coherence, segments = _coherence(spectra), spectra[3]
    window = _window(size)
    overlap = np.sum(window[: size // 2] * window[size - size // 2 :]) / np.sum(window**2)
    # Half overlapped segments share a part of their noise (Welch 1967).
    averages = segments / (1.0 + 2.0 * overlap**2 * (segments - 1) / segments)
    # The coherence of few averages is itself too high.
    true = np.clip(coherence - (1.0 - coherence) / max(averages - 1.0, 1.0), 1e-6, 1.0)
    return np.asarray(np.sqrt((1.0 - true) / (2.0 * true * averages)))


def period_of(record: TimeRecord) -> int | None:
    """Samples of a period that the input repeats at least three times; None where there is none."""
    x = record.input_v - np.mean(record.input_v)
    n = x.size
    spectrum = np.fft.rfft(x, 2 * n)
    raw = np.fft.irfft(np.abs(spectrum) ** 2)[:n]
    sums = np.concatenate([[0.0], np.cumsum(x**2)])
    lag = np.arange(n)
    energy = np.sqrt(np.maximum((sums[n] - sums[lag]) * sums[n - lag], 1e-300))
    likeness = raw / energy
    # Past the first dip, or every signal is alike to itself.
    first = np.flatnonzero(likeness < 0.5)
    if not first.size or first[0] >= n // 3:
        return None
    found = likeness[first[0] : n // 3 + 1]
    best = float(found.max())
    if best < _PERIODIC:
        return None
    near = np.flatnonzero(found > best - 0.25 * (1.0 - best) - 1e-9)[0] + first[0]
    top = near + int(np.argmax(likeness[near : near + max(3, near // 50)]))
    return int(top)


def periodic_response(record: TimeRecord, period: int, lines: float = 1e-3) -> Points:
    """Gain at the lines that a periodic input holds, with errors from period to period.

    The first period is left out: the servo settles in it.

    Raises
    ------
    AnalysisError
        If fewer than three periods are left, or all of the input lies at half the sampling rate.
    """
    # Whole periods, the last ones: what comes before them settles.
    count = len(record) // period
    periods = count - 1
    if periods < 2:
        raise AnalysisError(
            f"the record holds {count} periods of {period / record.rate_hz:.4g} s; give three or "
            "more, for one settles and two show the scatter"
        )
    last = len(record)
    x, y = (
        np.fft.rfft(v[last - periods * period :].reshape(periods, period), axis=1) * 2.0 / period
        for v in (record.input_v, record.output_v)
    )
    size = np.abs(x.mean(axis=0))
    keep = size > lines * size[1:].max()
    keep[0] = False
    keep[-1] = keep[-1] and period % 2 == 1
    if not keep.any():
        raise AnalysisError(
            f"the input lies at half the sampling rate, {record.rate_hz / 2.0:g} Hz, where samples "
            "tell no phase; sample it faster"
        )
    x, y, size = x[:, keep], y[:, keep], size[keep]
    frequency = np.flatnonzero(keep) * record.rate_hz / period
    gain = y.mean(axis=0) / x.mean(axis=0)
    off = (y - gain * x) / (gain * x.mean(axis=0))
    pooled = max(periods - 1, 1) * periods
    along, across = (np.sqrt(np.sum(part**2, axis=0) / pooled) for part in (off.real, off.imag))
    if periods < 8:
        # Few periods: the scatter of neighbouring lines and of both directions together.
        width = min(9, along.size)
        both = np.convolve(
            np.pad(0.5 * (along**2 + across**2), width // 2, mode="reflect"),
            np.ones(width) / width, "valid",
        )[: along.size]  # fmt: skip
        along = across = np.sqrt(both)
    level = np.full(frequency.size, np.sqrt(2.0) * float(np.std(record.input_v)))
    # The phasors of sines, for the input is their imaginary part.
    signal = _signal("periodic", period / record.rate_hz, np.flatnonzero(keep), 1j * x.mean(axis=0))
    return Points(
        frequency, level, np.asarray(gain), np.asarray(along), np.asarray(across),
        f"mean over {periods} periods of {period / record.rate_hz:.6g} s",
        ("the level is that of a sine of the input's rms",),
        settle_cycles=None if signal is None else 1,
        integrate_cycles=None if signal is None else periods,
        signal=signal,
    )  # fmt: skip


def _signal(
    kind: Kind, period_s: float, lines: NDArray[np.intp], phasors: NDArray[Any]
) -> Excitation | None:
    """What drove the servo; None where it has more lines than a file should hold."""
    if lines.size > MOST_LINES:
        return None
    phase = np.degrees(np.angle(phasors)) if kind == "periodic" else np.empty(0)
    size = np.abs(phasors)
    return Excitation(
        kind, float(period_s), tuple(lines.tolist()), tuple((size / size.max()).tolist()),
        tuple(phase.tolist()),
    )  # fmt: skip
