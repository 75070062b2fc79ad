"""The checks before a sweep: who is there, is the source off, does the unit answer plausibly.

Owns their order and what each must find. They run on every start, resumed
sessions included, and the first thing that the source hears is "off". What is
plausible is a matter of limits handed in; this module knows no unit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from daq.analyser import Analyser, Identity, PointSettings, SourceState, SweepPoint
from daq.errors import MeasurementError
from daq.frf import PointFlag
from daq.limits import Limits, tightest
from daq.plan import SweepPlan
from daq.session_events import CheckLine

__all__ = [
    "Plausibility",
    "check_identity",
    "check_source",
    "check_trial",
    "check_wire",
    "limits_line",
    "take_trial",
]

_TRIAL_CYCLES = 10
_FULL_SCALE_MARGIN = 0.8
"""Part of a fixed range that the highest level may be expected to fill."""


@dataclass(frozen=True, slots=True)
class Plausibility:
    """What the trial point must look like.

    Parameters
    ----------
    lowest_db, highest_db
        Gain outside of this means a cable, an amplifier or a unit that is not there.
    judge
        Looks at the trial point; None if it is plausible, else why not.
    """

    lowest_db: float = -80.0
    highest_db: float = 60.0
    judge: Callable[[SweepPoint], str | None] | None = None


def limits_line(plan: SweepPlan, limits: Sequence[Limits]) -> CheckLine:
    """Say what is asked for, within the tightest of the limits, which were checked before."""
    bounds = tightest(limits)
    lowest_hz, highest_hz = min(plan.frequencies_hz), max(plan.frequencies_hz)
    return CheckLine(
        "limits",
        "pass",
        f"{max(plan.levels_vpk):g} V peak of {bounds.source_vpk:g}, {lowest_hz:g} to "
        f"{highest_hz:g} Hz within {bounds.start_hz:g} to {bounds.stop_hz:g}, "
        f"{plan.duration_s:.0f} s of {bounds.duration_s:g}",
    )


def check_identity(identity: Identity, resumed: Identity | None) -> Iterator[CheckLine]:
    """Say who is there, and compare with who measured before.

    Raises
    ------
    MeasurementError
        If a measurement on a simulated instrument is to go on with a real one,
        or the other way round.
    """
    told = " ".join(part for part in (identity.maker, identity.model, identity.serial) if part)
    revision = f", revision {identity.revision}" if identity.revision else ""
    simulated = ", SIMULATED" if identity.simulated else ""
    yield CheckLine("identity", "pass", f"{told}{revision}{simulated}")
    yield CheckLine("options", "pass", ", ".join(identity.options) or "none")
    if resumed is None or resumed == identity:
        return
    if resumed.simulated != identity.simulated:
        kinds = {True: "a simulated", False: "a real"}
        raise MeasurementError(
            f"the measurement was begun on {kinds[resumed.simulated]} instrument and this is "
            f"{kinds[identity.simulated]} one; start a new measurement"
        )
    yield CheckLine(
        "identity",
        "note",
        f"the measurement was begun on {resumed.model} {resumed.serial} {resumed.revision}",
    )


def check_source(analyser: Analyser) -> Iterator[CheckLine]:
    """Look at the source, make it safe whatever was seen, and insist on the proof.

    Raises
    ------
    MeasurementError
        If the source cannot be proven off.
    """
    found = analyser.source_state()
    if found is SourceState.ON:
        yield CheckLine("source", "note", "was found driving, or free to drive; switching it off")
    state = analyser.make_safe()
    if state is not SourceState.CONFIRMED_OFF:
        yield CheckLine("source", "fail", f"{state.value}; it could not be proven off")
        raise MeasurementError(
            f"the source is {state.value}: it could not be proven off; switch it off by hand and "
            "find out why before measuring"
        )
    yield CheckLine("source", "pass", "confirmed off")


def take_trial(
    analyser: Analyser, plan: SweepPlan, settings: PointSettings
) -> tuple[SweepPoint, PointSettings]:
    """Drive one point, gently: the plan's lowest level at its first frequency, for few cycles.

    A level lower still would say little: friction holds a servo at a level
    that the plan was made to exceed.

    Returns
    -------
    tuple
        The point, and the settings it was taken with.

    Raises
    ------
    MeasurementError
        If the instrument gave no point.
    """
    gentle = replace(
        settings,
        source_vpk=min(plan.levels_vpk),
        settle_cycles=min(plan.settle_cycles, _TRIAL_CYCLES),
        integrate_cycles=min(plan.integrate_cycles, _TRIAL_CYCLES),
    )
    analyser.prepare(min(plan.frequencies_hz), max(plan.frequencies_hz), gentle)
    points = list(analyser.sweep([float(plan.visited_hz[0])]))
    if len(points) != 1:
        raise MeasurementError(
            f"trial point: {len(points)} points came where one was due; the instrument does not "
            "do what it is told"
        )
    return points[0], gentle


def check_wire(analyser: Analyser) -> Iterator[CheckLine]:
    """Say what the way to the instrument turned out not to have, and what follows."""
    lacks: tuple[str, ...] = tuple(getattr(analyser, "wire_lacks", ()))
    if not lacks:
        return
    follows = {
        "serial poll": "the end of a point is asked for with *ESR?",
        "device clear": "a parser that hangs cannot be freed, nor the source be switched off then",
    }
    told = "; ".join(follows[lack] for lack in lacks if lack in follows)
    yield CheckLine("wire", "note", f"no {' and no '.join(lacks)} on this way: {told}")


def check_trial(
    point: SweepPoint, trial: PointSettings, plan: SweepPlan, plausible: Plausibility
) -> Iterator[CheckLine]:
    """Judge the trial point, and whether the input ranges will do.

    Raises
    ------
    MeasurementError
        If the point is implausible.
    """
    size = abs(point.gain)
    gain_db = 20.0 * math.log10(size) if size > 0 and math.isfinite(size) else math.nan
    where = f"at {point.frequency_hz:g} Hz and {trial.source_vpk:g} V peak"
    fault = _implausible(point, gain_db, plausible)
    if fault is not None:
        yield CheckLine("trial point", "fail", f"{fault} {where}")
        raise MeasurementError(
            f"trial point {where}: {fault}; check cables, amplifier and the unit's supply"
        )
    angle = math.degrees(math.atan2(point.gain.imag, point.gain.real))
    yield CheckLine("trial point", "pass", f"{gain_db:.1f} dB, {angle:.0f} degrees {where}")
    yield from _ranges(point, trial, plan)


def _implausible(point: SweepPoint, gain_db: float, plausible: Plausibility) -> str | None:
    if point.flags & PointFlag.OVERLOAD:
        return "an input is overloaded, its range is too small"
    if point.flags & PointFlag.SPOILT or not math.isfinite(abs(point.gain)):
        return "the reading is no number"
    if math.isnan(gain_db):
        return "the response is exactly zero"
    if gain_db < plausible.lowest_db:
        return f"a gain of {gain_db:.0f} dB is below {plausible.lowest_db:g} dB"
    if gain_db > plausible.highest_db:
        return f"a gain of {gain_db:.0f} dB is above {plausible.highest_db:g} dB"
    return plausible.judge(point) if plausible.judge is not None else None


def _ranges(point: SweepPoint, trial: PointSettings, plan: SweepPlan) -> Iterator[CheckLine]:
    highest = max(plan.levels_vpk)
    expected = (highest + abs(plan.dc_offset_v), highest * abs(point.gain))
    for channel, (range_vpk, peak) in enumerate(
        zip(trial.input_range_vpk, expected, strict=True), start=1
    ):
        name = f"input range {channel}"
        if range_vpk is None:
            yield CheckLine(name, "pass", "automatic")
        elif peak > _FULL_SCALE_MARGIN * range_vpk:
            yield CheckLine(
                name,
                "note",
                f"{range_vpk:g} V peak, and about {peak:.3g} V are to be expected at "
                f"{highest:g} V; overloads will be flagged",
            )
        else:
            yield CheckLine(name, "pass", f"{range_vpk:g} V peak")
    if point.flags & PointFlag.HALF_RANGE_MISSED:
        yield CheckLine("input range", "note", "an input stays below half of its range")
