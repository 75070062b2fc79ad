"""From a few choices to the plan of a signal: which, how fine, how many averages.

Owns the defaults. It drives nothing.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from daq.errors import InputError
from daq.excitation.plan import ExcitedPlan
from daq.excitation.signal import Excitation, chirp, multisine, noise
from daq.plan import SweepPlan

__all__ = ["SignalName", "plan_by_signal", "signal_words", "usual_cycles"]

SignalName = Literal["multisine", "chirp", "noise"]

_USUAL = {"stepped": (20, 30), "multisine": (2, 8), "chirp": (2, 8), "noise": (2, 40)}


def usual_cycles(name: str, settle: int | None, integrate: int | None) -> tuple[int, int]:
    """Settle and integrate cycles, periods or segments, where not both are given."""
    usual = _USUAL[name]
    return usual[0] if settle is None else settle, usual[1] if integrate is None else integrate


def plan_by_signal(
    plan: SweepPlan,
    name: SignalName,
    resolution_hz: float | None = None,
    phases: Literal["schroeder", "random"] | None = None,
    seed: int = 0,
) -> ExcitedPlan:
    """The plan of a signal over the frequencies, levels and averages of a sweep.

    Frequencies move to the nearest multiple of the resolution.

    Parameters
    ----------
    resolution_hz
        1 over the period or segment, Hz; the smallest step between the frequencies if not given.
    phases
        Of a multisine; Schroeder's if not given.
    seed
        Of random phases, and of the noise of a simulation.

    Raises
    ------
    InputError
        If the choices do not go together.
    """
    if phases is not None and name != "multisine":
        raise InputError(f"phases are those of a multisine; a {name} has none to choose")
    if plan.from_rest or plan.direction != "up":
        raise InputError(
            f"a {name} drives all frequencies at once: it has no direction and starts from rest "
            "once; leave both out"
        )
    grid = np.asarray(plan.frequencies_hz)
    if resolution_hz is None:
        resolution_hz = float(np.diff(grid).min()) if grid.size > 1 else float(grid[0])
    if not (np.isfinite(resolution_hz) and 0.0 < resolution_hz <= grid[0]):
        raise InputError(
            f"resolution {resolution_hz:g} Hz is not possible; give one above 0 and up to the "
            f"start of the band, {grid[0]:g} Hz"
        )
    period_s = 1.0 / resolution_hz
    signal: Excitation
    if name == "multisine":
        signal = multisine(plan.frequencies_hz, period_s, phases or "schroeder", seed)
    elif name == "chirp":
        signal = chirp(grid[0], grid[-1], period_s)
    else:
        signal = noise(grid[0], grid[-1], period_s)
    lines = np.asarray(signal.lines)
    nearest = np.abs(lines[:, None] - grid * period_s).argmin(axis=0)
    return ExcitedPlan(
        tuple((lines[np.unique(nearest)] / period_s).tolist()),
        plan.levels_vpk,
        settle_cycles=plan.settle_cycles,
        integrate_cycles=plan.integrate_cycles,
        dc_offset_v=plan.dc_offset_v,
        excitation=signal,
        realisation=seed,
    )


def signal_words(plan: ExcitedPlan) -> str:
    """The signal in words, for a person."""
    signal = plan.signal
    low, high = signal.frequencies_hz[[0, -1]]
    if signal.kind == "noise":
        return (
            f"noise from {low:.4g} to {high:.4g} Hz, {plan.integrate_cycles} segments of "
            f"{signal.period_s:.4g} s"
        )
    count = 1 << int(np.ceil(np.log2(16 * signal.lines[-1] + 16)))
    spectrum = np.zeros(count // 2 + 1, dtype=complex)
    spectrum[list(signal.lines)] = -0.5j * count * signal.phasors()
    peak = float(np.abs(np.fft.irfft(spectrum, count)).max())
    return (
        f"{len(signal.lines)} lines from {low:.4g} to {high:.4g} Hz, {plan.integrate_cycles} "
        f"periods of {signal.period_s:.4g} s; peaks are {peak:.2f} times the level"
    )
