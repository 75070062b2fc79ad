"""A frequency response from a record: what the signal is, and by which way it is estimated.

Owns that choice and what the response says of its origin. The ways are its neighbours'.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from analysis.time_records.cycles import Dwell, cycle_starts, find_dwells
from analysis.time_records.local_lines import swept_response
from analysis.time_records.points import Points
from analysis.time_records.spectra import (
    Estimator,
    noise_response,
    period_of,
    periodic_response,
)
from analysis.time_records.stepped import stepped_response
from daq.errors import AnalysisError, InputError
from daq.frf import DB_PER_NEPER, FrequencyResponse
from daq.time_records.record import TimeRecord

__all__ = ["EXCITATIONS", "Excitation", "response_of_record"]

Excitation = Literal["stepped", "sweep", "periodic", "noise"]
EXCITATIONS: tuple[Excitation, ...] = get_args(Excitation)
_DWELLING = 0.6
"""Share of a record that dwells of a stepped sine fill."""
_LEAST_V = 1e-9
_COHERENT, _KNOWN = 0.5, 0.3
"""Coherence below which, and share of the gain above which a frequency is poorly known."""
_BEND = 0.012
"""Median bend of dwells from which on they are parts of a sweep, periods."""
_GLIDING = 0.1
"""Change of the period from cycle to cycle that a sweep stays below."""


def response_of_record(
    record: TimeRecord,
    *,
    unit: str,
    excitation: Excitation | None = None,
    estimator: Estimator = "H1",
    resolution_hz: float | None = None,
    start_hz: float = 0.0,
    stop_hz: float = np.inf,
    level_vpk: float | None = None,
    settle_cycles: int | None = None,
    integrate_cycles: int | None = None,
) -> tuple[FrequencyResponse, tuple[str, ...]]:
    """Estimate the response output over input.

    Parameters
    ----------
    excitation
        What the input is; None to find out.
    estimator
        For noise.
    resolution_hz
        Step of frequencies for noise and sweeps, Hz.
    level_vpk
        Source level that the response is said to be of; None for what the record shows.
    settle_cycles, integrate_cycles
        For stepped sine.

    Returns
    -------
    tuple
        The response, and what a person should know of it.

    Raises
    ------
    AnalysisError
        If the record does not hold such a signal.
    InputError
        If options do not go together.
    """
    for name, values in (("input", record.input_v), ("output", record.output_v)):
        if not _LEAST_V < float(np.std(values)) < 1.0 / _LEAST_V:
            raise AnalysisError(
                f"the {name} varies by {float(np.std(values)):.3g} V rms, which no servo does; "
                "see to the columns and their scales"
            )
    dwells: list[Dwell] = []
    if excitation in (None, "stepped"):
        dwells = find_dwells(record)
    kind = excitation or _kind(record, dwells)
    if estimator != "H1" and kind != "noise":
        raise InputError(f"{estimator} is for noise; the input is {_words(kind)}: leave it out")
    if (settle_cycles is not None or integrate_cycles is not None) and kind != "stepped":
        raise InputError(
            f"settle and integrate cycles are for stepped sine; the input is {_words(kind)}: "
            "leave them out"
        )
    points = _points(record, kind, dwells, estimator, resolution_hz, settle_cycles,
                     integrate_cycles)  # fmt: skip
    keep = (points.frequency_hz >= start_hz) & (points.frequency_hz <= stop_hz)
    keep &= np.isfinite(points.gain) & (np.abs(points.gain) > 0.0)
    if not keep.any():
        low, high = points.frequency_hz[0], points.frequency_hz[-1]
        raise AnalysisError(
            f"the record drives from {low:.4g} to {high:.4g} Hz, nothing of it between "
            f"{start_hz:g} and {stop_hz:g} Hz"
        )
    direction = _direction(dwells) if kind == "stepped" else None
    response = FrequencyResponse.from_arrays(
        points.frequency_hz[keep],
        points.level_vpk[keep] if level_vpk is None else level_vpk,
        points.gain[keep],
        unit=unit,
        gain_std_db=np.clip(points.along[keep], 1e-6, 10.0) * DB_PER_NEPER,
        phase_std_deg=np.degrees(np.clip(points.across[keep], 1e-6, 3.0)),
        direction=direction,
        settle_cycles=points.settle_cycles,
        integrate_cycles=points.integrate_cycles,
        provenance={
            "kind": "measured",
            "excitation": _words(kind),
            "estimated_by": points.method,
            "record_s": round(record.duration_s, 6),
            "record_rate_hz": record.rate_hz,
            "gain_std_is": "error bar",
        }
        | ({} if points.signal is None else points.signal.stated()),
    )
    told = (f"the input is {_words(kind)}; {points.method}", *points.notes, *_doubt(points, keep))
    return response, told


def _doubt(points: Points, keep: NDArray[np.bool_]) -> tuple[str, ...]:
    """That most of the band tells little of the servo, in words."""
    if points.coherence is not None:
        poor, what = points.coherence[keep] < _COHERENT, f"the coherence is below {_COHERENT:g}"
    else:
        poor, what = points.along[keep] > _KNOWN, f"the error is above {_KNOWN:.0%} of the gain"
    share = float(np.mean(poor))
    if share <= 0.5:
        return ()
    return (
        f"warning: {what} at {share:.0%} of the frequencies: little of the output comes from the "
        "input; see to --input and --output, the level, and what else moves the servo",
    )


def _words(kind: Excitation) -> str:
    return {
        "stepped": "a stepped sine",
        "sweep": "a sweep",
        "periodic": "a periodic signal",
        "noise": "noise",
    }[kind]


def _points(
    record: TimeRecord,
    kind: Excitation,
    dwells: list[Dwell],
    estimator: Estimator,
    resolution_hz: float | None,
    settle_cycles: int | None,
    integrate_cycles: int | None,
) -> Points:
    if kind == "stepped":
        if not dwells:
            raise AnalysisError("the input holds no dwell of a stepped sine; see --excitation")
        return stepped_response(
            record, dwells, settle_cycles=settle_cycles, integrate_cycles=integrate_cycles
        )
    if kind == "periodic":
        period = period_of(record)
        if period is None:
            raise AnalysisError("the input does not repeat; see --excitation")
        return periodic_response(record, period)
    if kind == "sweep":
        return swept_response(record, resolution_hz)
    return noise_response(record, estimator, resolution_hz)


def _kind(record: TimeRecord, dwells: list[Dwell]) -> Excitation:
    """What the input is."""
    dwelling = sum(dwell.cycles / dwell.frequency_hz for dwell in dwells)
    gliding = np.median([abs(dwell.bend) for dwell in dwells]) > _BEND if dwells else True
    if dwelling > _DWELLING * record.duration_s and not gliding:
        return "stepped"
    if period_of(record) is not None:
        return "periodic"
    starts, amplitude = cycle_starts(record)
    periods = np.diff(starts)
    if periods.size > 8:
        change = np.abs(np.diff(periods)) / periods[1:]
        even = np.std(amplitude) < 0.3 * np.mean(amplitude)
        if np.median(change) < _GLIDING and even:
            return "sweep"
    return "noise"


def _direction(dwells: list[Dwell]) -> Literal["up", "down"] | None:
    """The order of the frequencies, where most steps go one way."""
    steps = np.sign(np.diff([dwell.frequency_hz for dwell in dwells]))
    if steps.size == 0 or abs(float(np.mean(steps))) < 0.5:
        return None
    return "up" if np.mean(steps) > 0 else "down"
