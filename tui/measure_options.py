"""From the options of ``lashbench measure`` to what a session is asked to do.

Owns how options, recipe, bench, unit and a resumed measurement are brought
together, and refuses what contradicts. It opens no instrument and sends
nothing.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daq.errors import InputError
from tui.options import real_number

if TYPE_CHECKING:
    from daq.adaptive import Judge, Refinement
    from daq.limits import Limits
    from daq.plan import SweepPlan
    from daq.recipe import Recipe
    from daq.session_request import SessionRequest
    from daq.store_records import Measurement
    from sim.unit import Unit

__all__ = ["PlanOptions", "plan_of", "read_band", "session_request", "swept_plan"]

_TARGET_STD_HZ = 0.5
_BUDGET = 2
"""Points of a refined level in multiples of the plan's, where no recipe says."""


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
    db: Path,
    *,
    recipe: str | None,
    bench: str,
    resume: int | None,
    remeasure: tuple[float, float] | None,
    run_in: int | None,
    remarks: Mapping[str, str],
) -> SessionRequest:
    """Everything a session needs to know, checked against all limits.

    Raises
    ------
    InputError
        If something is missing or contradicts.
    LimitError
        If bench, unit or recipe forbids the plan; nothing was sent.
    """
    from daq.configs import config_path
    from daq.limits import check_plan, load_bench
    from daq.recipe import load_recipe
    from daq.session_request import SessionRequest
    from daq.store_records import MeasurementHeader
    from tui.bench import unit_limits

    place = load_bench(bench)
    way = None if recipe is None else load_recipe(recipe)
    limits: tuple[Limits, ...] = (place.bounds(), unit_limits(unit))
    limits += () if way is None else (way.bounds(),)
    header = None
    if resume is not None:
        before = _resumed(options, unit, db, resume, remarks)
        plan, configurations = before.header.plan, before.header.configurations
        refinement = _kept_refinement(configurations)
    else:
        if remeasure is not None:
            raise InputError("--remeasure needs --resume ID: which measurement is it about?")
        plan = swept_plan(options, way)
        refinement = _refinement(options, way, plan)
        texts = {"unit": config_path("units", unit_name), "bench": config_path("benches", bench)}
        if recipe is not None:
            texts["recipe"] = config_path("recipes", recipe)
        configurations = {kind: path.read_text(encoding="utf-8") for kind, path in texts.items()}
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
    return SessionRequest(
        header=header,
        limits=limits,
        resume=resume,
        remeasure_hz=remeasure,
        run_in_points=run_in,
        slew_vpk_per_s=place.drive.slew_vpk_per_s,
        input_range_vpk=(place.drive.channel1_range_vpk, place.drive.channel2_range_vpk),
        refinement=refinement,
        judge=_judge() if refinement is not None else None,
    )


def plan_of(request: SessionRequest, db: Path) -> SweepPlan:
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
    from analysis.feature_judge import judge_features

    return judge_features


def _longest_s(plan: SweepPlan, refinement: Refinement | None) -> float | None:
    """Driving time with the whole budget of refinement, s."""
    from daq.adaptive import AdaptiveSweep

    if refinement is None:
        return None
    cost = AdaptiveSweep(plan, refinement, lambda points: []).cost()
    return cost.most_s * len(plan.levels_vpk)


def _resumed(
    options: PlanOptions, unit: Unit, db: Path, resume: int, remarks: Mapping[str, str]
) -> Measurement:
    """The measurement to go on with; what the command line says must be what it is.

    Raises
    ------
    InputError
        Names each value that differs.
    """
    from daq.store import Store

    with Store(db, read_only=True) as store:
        before = store.measurement(resume)
    header, plan = before.header, before.header.plan
    stored: dict[str, Any] = {
        "levels_vpk": plan.levels_vpk,
        "start_hz": min(plan.frequencies_hz),
        "stop_hz": max(plan.frequencies_hz),
        "points": len(plan.frequencies_hz),
        "direction": plan.direction,
        "settle_cycles": plan.settle_cycles,
        "integrate_cycles": plan.integrate_cycles,
        "dc_offset_v": plan.dc_offset_v,
        "adaptive": "refinement" in header.configurations,
        "unit": header.unit,
        "serial": header.serial,
    }
    given = options.given | {"unit": unit.name}
    given |= {"serial": remarks["serial"]} if remarks["serial"] else {}
    differ = [
        f"{name} {given[name]!r} was given and it has {value!r}"
        for name, value in stored.items()
        if name in given and given[name] != value
    ]
    if differ:
        raise InputError(
            f"measurement {resume} is another one: {'; '.join(differ)}; leave that out, or start "
            "a new measurement"
        )
    return before
