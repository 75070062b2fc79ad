"""What a bench would read from the cycles of a motion.

Owns the step from Fourier coefficients, cycle by cycle, to gains with standard
errors, harmonics and flags. It simulates nothing and judges nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from daq.excitation.plan import ExcitedPlan
from daq.frf import DB_PER_NEPER, FrequencyResponse, PointFlag
from daq.plan import SweepPlan

__all__ = ["PERIODIC_SCATTER", "response_of_cycles", "scatter_of_cycles"]

PERIODIC_SCATTER = 0.01
"""A point is period-1 if no cycle's coefficient departs from the mean by more than this share."""


def response_of_cycles(
    cycles: NDArray[np.complex128],
    plan: SweepPlan,
    unit: str,
    provenance: dict[str, object],
) -> FrequencyResponse:
    """The response that a bench would read from per-cycle coefficients.

    `cycles` is (levels, points, cycles, 4) over the source level.
    """
    levels, points = cycles.shape[:2]
    gain, along, across, worst = scatter_of_cycles(cycles[..., 1])
    level = np.repeat(np.asarray(plan.levels_vpk, dtype=float), points)
    magnitude = np.abs(gain).ravel()
    with np.errstate(divide="ignore", invalid="ignore"):
        gain_std_db = DB_PER_NEPER * along.ravel() / magnitude
        phase_std_deg = np.degrees(across.ravel() / magnitude)
    excited = isinstance(plan, ExcitedPlan)
    restless = worst.ravel() > PERIODIC_SCATTER
    if isinstance(plan, ExcitedPlan) and plan.signal.kind == "noise":
        restless = np.zeros_like(restless)
    return FrequencyResponse.from_arrays(
        np.tile(np.asarray(plan.frequencies_hz, dtype=float), levels),
        level,
        gain.ravel(),
        unit=unit,
        gain_std_db=gain_std_db,
        phase_std_deg=phase_std_deg,
        dc_v=cycles[..., 0].real.mean(axis=2).ravel() * level,
        harmonic2=cycles[..., 2].mean(axis=2).ravel(),
        harmonic3=cycles[..., 3].mean(axis=2).ravel(),
        flags=np.where(restless, int(PointFlag.NOT_PERIODIC), 0),
        direction=None if excited else plan.direction,
        settle_cycles=plan.settle_cycles,
        integrate_cycles=plan.integrate_cycles,
        from_rest=None if excited else plan.from_rest,
        provenance=provenance,
    )


def scatter_of_cycles(
    coefficients: NDArray[np.complex128],
) -> tuple[NDArray[np.complex128], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Mean over cycles, and its standard error along and across the mean.

    Parameters
    ----------
    coefficients
        (..., cycles).

    Returns
    -------
    mean, along, across, worst
        Each (...). `along` and `across` are one standard error of the mean in
        the direction of the mean phasor and at right angles to it (NaN for a
        single cycle); `worst` is the largest departure of a cycle from the
        mean, as a share of the mean.
    """
    count = coefficients.shape[-1]
    mean = coefficients.mean(axis=-1)
    magnitude = np.abs(mean)
    direction = np.where(magnitude > 0, mean / np.where(magnitude > 0, magnitude, 1.0), 1.0)
    turned = (coefficients - mean[..., None]) * np.conj(direction)[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        worst = np.where(magnitude > 0, np.abs(turned).max(axis=-1) / magnitude, np.inf)
    if count < 2:
        unknown = np.full(mean.shape, np.nan)
        return mean, unknown, unknown.copy(), worst
    share = np.sqrt(count)
    along = turned.real.std(axis=-1, ddof=1) / share
    across = turned.imag.std(axis=-1, ddof=1) / share
    return mean, along, across, worst
