"""From the options of ``lashbench measure`` to what a session is asked to do.

Owns how options, recipe, bench, unit and a resumed measurement are brought
together, and refuses what contradicts. It opens no instrument and sends
nothing.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from daq.errors import ConfigurationError, InputError
from daq.servers.place import HistoryPlace
from tui.options import real_number

if TYPE_CHECKING:
    from daq.adaptive import Judge, Refinement
    from daq.configs import Kind
    from daq.limits import Limits
    from daq.plan import Spacing, SweepPlan
    from daq.recipe import Recipe
    from daq.session_request import SessionRequest
    from daq.store_records import Measurement
    from sim.unit import Unit

__all__ = ["PlanOptions", "plan_of", "read_band", "session_request", "swept_plan"]

_TARGET_STD_HZ = 0.5
_BUDGET = 2
"""Points of a refined level in multiples of the plan's, where no recipe says."""
_SAME = 1e-9
"""Share by which grids that were computed on two machines may differ."""


@dataclass(frozen=True, slots=True)
class PlanOptions:
    """The sweep as far as the command line says it; None is left to the recipe or the preset."""

    levels_vpk: tuple[float, ...] = ()
    start_hz: float | None = None
    stop_hz: float | None = None
    points: int | None = None
    spacing: str | None = None
    direction: str | None = None
    settle_cycles: int | None = None
    integrate_cycles: int | None = None
    dc_offset_v: float | None = None
    adaptive: bool = False

    @property
    def given(self) -> dict[str, Any]:
        """What the command line does say."""
        return {
            key: value
            for key, value in asdict(self).items()
            if value is not None and value != () and value is not False
        }


def read_band(text: str | None) -> tuple[float, float] | None:
    """Read ``LOW:HIGH`` in Hz.

    Raises
    ------
    InputError
        If it has another form.
    """
    if text is None:
        return None
    low, colon, high = text.partition(":")
    try:
        if not colon:
            raise ValueError("there is no colon")
        band = real_number(low), real_number(high)
    except ValueError as error:
        raise InputError(f"--remeasure {text!r} is not LOW:HIGH in Hz ({error})") from error
    if not 0 < band[0] <= band[1]:
        raise InputError(f"--remeasure {text!r}: give the lower frequency first, above 0 Hz")
    return band


def session_request(
    options: PlanOptions,
    unit_name: str,
    unit: Unit,
    instrument: str,
    db: HistoryPlace,
    *,
    recipe: str | None,
    bench: str,
    resume: int | None,
    remeasure: tuple[float, float] | None,
    run_in: int | None,
    remarks: Mapping[str, str],
    unit_text: str | None = None,
    plan: SweepPlan | None = None,
) -> SessionRequest:
    """Everything a session needs to know, checked against all limits.

    Parameters
    ----------
    unit_name
        Name or path of the unit's file.
    unit_text
        What that file held, where `unit_name` is no name or path of one any more.
    plan
        The whole sweep, in place of `options`.

    Raises
    ------
    InputError
        If something is missing, cannot be, or contradicts the rest or what is stored.
    LimitError
        If bench, unit, recipe or instrument forbids the plan; nothing was sent.
    """
    from daq.drivers import check_sweep
    from daq.limits import check_plan, load_bench
    from daq.recipe import load_recipe
    from daq.session_request import SessionRequest
    from daq.store_records import MeasurementHeader
    from tui.bench import unit_limits

    if resume is None:
        check_printable(remarks)
    place = load_bench(bench)
    way = None if recipe is None else load_recipe(recipe)
    way_text = {} if recipe is None else {"recipe": _text("recipes", recipe)}
    limits: tuple[Limits, ...] = (place.bounds(), unit_limits(unit))
    limits += () if way is None else (way.bounds(),)
    header = None
    if resume is not None:
        before = _resumed(db, resume, remeasure)
        plan, configurations = before.header.plan, before.header.configurations
        named = {name: text for name, text in remarks.items() if text}
        _check_same(before, options.given | {"unit": unit.name} | named)
        _check_same_values(before, unit)
        # What options overrode of its own recipe is no contradiction.
        if way is not None and not way_text.items() <= configurations.items():
            sweep = way.sweep.model_dump()
            sweep["levels_vpk"] = tuple(sweep["levels_vpk"])
            _check_same(before, sweep | options.given, f" by recipe {way.name}")
        refinement = _kept_refinement(configurations)
    else:
        if remeasure is not None:
            raise InputError("--remeasure needs --resume ID: which measurement is it about?")
        plan = plan or swept_plan(options, way)
        refinement = _refinement(options, way, plan)
        configurations = {
            "unit": _text("units", unit_name) if unit_text is None else unit_text,
            "bench": _text("benches", bench),
            **way_text,
        }
        if refinement is not None:
            configurations["refinement"] = _refinement_text(refinement)
        header = MeasurementHeader(
            unit=unit.name,
            plan=plan,
            address=instrument,
            software=f"lashbench {version('lashbench')}",
            configurations=configurations,
            **remarks,
        )
    check_plan(plan, limits, _longest_s(plan, refinement))
    ranges = place.drive.channel1_range_vpk, place.drive.channel2_range_vpk
    check_sweep(instrument, plan, place.drive.slew_vpk_per_s, ranges, may_repeat=resume is not None)
    return SessionRequest(
        header=header,
        limits=limits,
        resume=resume,
        remeasure_hz=remeasure,
        run_in_points=run_in,
        slew_vpk_per_s=place.drive.slew_vpk_per_s,
        input_range_vpk=ranges,
        refinement=refinement,
        judge=_judge() if refinement is not None else None,
    )


def check_printable(remarks: Mapping[str, str]) -> None:
    """A remark is one line that can be shown and written wherever the measurement goes.

    Raises
    ------
    InputError
        If it holds a line break, another control character or bytes that are no text.
    """
    for name, text in remarks.items():
        if not text.isprintable():
            raise InputError(f"{name} {text!r} is not one line of text; leave out what is not")


def plan_of(request: SessionRequest, db: HistoryPlace) -> SweepPlan:
    """The plan that a session will follow."""
    from daq.store import Store

    if request.header is not None:
        return request.header.plan
    with Store(db, read_only=True) as store:
        return store.measurement(request.resume or 0).header.plan


def swept_plan(options: PlanOptions, recipe: Recipe | None) -> SweepPlan:
    """The sweep that options and recipe describe together; options go first.

    Raises
    ------
    InputError
        If something is missing, or is no sweep.
    """
    from daq.plan import SweepPlan, spaced_frequencies

    values: dict[str, Any] = {"spacing": "lin"}
    if recipe is not None:
        values |= recipe.sweep.model_dump()
    values |= {key: value for key, value in options.given.items() if key != "adaptive"}
    needed = {"levels_vpk": "level", "start_hz": "start", "stop_hz": "stop", "points": "points"}
    missing = [f"--{option}" for key, option in needed.items() if key not in values]
    if missing:
        raise InputError(f"{', '.join(missing)} is missing; give it, or a --recipe")
    grid = (values.pop(key) for key in ("start_hz", "stop_hz", "points", "spacing"))
    return SweepPlan(
        frequencies_hz=spaced_frequencies(*grid),
        levels_vpk=tuple(values.pop("levels_vpk")),
        **values,
    )


def _refinement(options: PlanOptions, recipe: Recipe | None, plan: SweepPlan) -> Refinement | None:
    from daq.adaptive import Refinement

    if not options.adaptive:
        return None
    if recipe is not None and recipe.refine is not None:
        return Refinement(recipe.refine.target_std_hz, recipe.refine.budget_points)
    return Refinement(_TARGET_STD_HZ, _BUDGET * len(plan.frequencies_hz))


def _refinement_text(refinement: Refinement) -> str:
    return json.dumps(
        {"target_std_hz": refinement.target_std_hz, "budget_points": refinement.budget_points}
    )


def _kept_refinement(configurations: Mapping[str, str]) -> Refinement | None:
    from daq.adaptive import Refinement

    text = configurations.get("refinement")
    if text is None:
        return None
    try:
        return Refinement(**json.loads(text))
    except (ValueError, TypeError) as error:
        raise InputError(f"the stored refinement {text!r} cannot be read ({error})") from error


def _judge() -> Judge:
    from analysis.resonance.adaptive import judge_features

    return judge_features


def _longest_s(plan: SweepPlan, refinement: Refinement | None) -> float | None:
    """Driving time with the whole budget of refinement, s."""
    from daq.adaptive import AdaptiveSweep

    if refinement is None:
        return None
    cost = AdaptiveSweep(plan, refinement, lambda points: []).cost()
    return cost.most_s * len(plan.levels_vpk)


def _resumed(db: HistoryPlace, resume: int, remeasure: tuple[float, float] | None) -> Measurement:
    """The measurement to go on with.

    Raises
    ------
    InputError
        If it is not there, or has no point in the band that is to be measured again.
    """
    from daq.store import Store

    with Store(db, read_only=True) as store:
        before = store.measurement(resume)
        points = store.points(resume) if remeasure is not None else []
    if remeasure is not None:
        low_hz, high_hz = remeasure
        asked_hz = [point.requested_hz for point in points]
        if not any(low_hz <= hz <= high_hz for hz in asked_hz):
            held = "it has none at all"
            if asked_hz:
                lowest_hz, highest_hz = min(asked_hz), max(asked_hz)
                held = f"its {len(points)} points lie from {lowest_hz:g} to {highest_hz:g} Hz"
            raise InputError(
                f"--remeasure {low_hz:g}:{high_hz:g}: measurement {resume} has no point from "
                f"{low_hz:g} to {high_hz:g} Hz, {held}; give a band with points, or leave it out"
            )
    return before


def _check_same(before: Measurement, given: Mapping[str, Any], by: str = "") -> None:
    """What is said of a measurement to go on with must be what it is.

    Raises
    ------
    InputError
        Names each value that differs.
    """
    header, plan = before.header, before.header.plan
    stored: dict[str, Any] = {
        "levels_vpk": plan.levels_vpk,
        "start_hz": min(plan.frequencies_hz),
        "stop_hz": max(plan.frequencies_hz),
        "points": len(plan.frequencies_hz),
        "spacing": _spacing(plan, given["spacing"]) if "spacing" in given else None,
        "direction": plan.direction,
        "settle_cycles": plan.settle_cycles,
        "integrate_cycles": plan.integrate_cycles,
        "dc_offset_v": plan.dc_offset_v,
        "adaptive": "refinement" in header.configurations,
        "unit": header.unit,
        "serial": header.serial,
        "operator": header.operator,
        "notes": header.notes,
    }
    differ = [
        f"{name} {value!r} was given{by} and it has {stored[name]!r}"
        for name, value in given.items()
        if value != stored[name]
    ]
    if differ:
        raise InputError(
            f"measurement {before.id} is another one: {'; '.join(differ)}; leave that out, or "
            "start a new measurement"
        )


def _check_same_values(before: Measurement, unit: Unit) -> None:
    """The unit must be the one of before by its values, too; its limits are those of today.

    Raises
    ------
    InputError
        Names each value that differs.
    """
    from tui.measurements.measured_unit import unit_as_measured
    from tui.measurements.unit_differences import differing_values

    if "unit" not in before.header.configurations:
        return
    try:
        as_begun = unit_as_measured(before)
    except ConfigurationError:
        # Nobody knows the values of before; that keeps no sweep from being finished.
        return
    differ = [
        f"{name} is {_shown(now)} and was {_shown(then)}"
        for name, (now, then) in differing_values(unit, as_begun, limits=False).items()
    ]
    if differ:
        raise InputError(
            f"measurement {before.id} was begun with other values of unit {unit.name}: "
            f"{', '.join(differ)}; give a unit file that has those, go on in `lashbench bench`, "
            "which takes them from the history, or start a new measurement"
        )


def _shown(value: float | tuple[float, ...] | None) -> str:
    if value is None:
        return "left out"
    return f"{value:.12g}" if isinstance(value, float | int) else str(list(value))


def _spacing(plan: SweepPlan, asked: Spacing) -> str:
    """How a stored grid is spaced; as asked about, where it may be called both."""
    from daq.plan import spaced_frequencies

    stored_hz = plan.frequencies_hz
    spacings: tuple[Spacing, ...] = (asked, "lin", "log")
    for spacing in spacings:
        grid_hz = spaced_frequencies(stored_hz[0], stored_hz[-1], len(stored_hz), spacing)
        if all(map(partial(math.isclose, rel_tol=_SAME), grid_hz, stored_hz)):
            return spacing
    return "irregular"


def _text(kind: Kind, name_or_path: str) -> str:
    """What a unit, bench or recipe file holds."""
    from daq.configs import config_path

    return config_path(kind, name_or_path).read_text(encoding="utf-8")
