"""What the operator has on the desk: unit, instrument, plan, the measurement in view, its results.

Owns these choices and how they become a session request. It opens no
instrument, draws nothing and decides nothing about a measurement.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daq.drivers import is_simulated
from daq.errors import InputError
from daq.servers.place import HistoryPlace
from daq.untrusted.visible_text import visible_line
from tui.app.run_view import RunView
from tui.app.state.proposed_sweep import propose
from tui.judging import LimitsChoice
from tui.measure_options import PlanOptions
from tui.measurements.follow_up import following

if TYPE_CHECKING:
    from analysis.acceptance import Judgement
    from analysis.estimate.datasheet_band import DatasheetBand
    from analysis.resonance.records import LevelFeatures
    from daq.analyser import Identity
    from daq.frf import FrequencyResponse
    from daq.plan import SweepPlan
    from daq.session_request import SessionRequest
    from daq.store_records import Measurement
    from sim.unit import Unit

__all__ = ["NO_RECIPE", "Desk", "Results", "plan_of_document"]

SIMULATED_URL = "sim:?ratio=0.3&seed=1"
"""The simulated bench that is offered first."""

NO_RECIPE = "none"
"""What is typed for a sweep without a recipe: bench and unit alone limit it."""


@dataclass(slots=True)
class Results:
    """What analyses said of the measurement in view; None where not asked or not there yet."""

    response: FrequencyResponse | None = None
    features: tuple[LevelFeatures, ...] = ()
    estimate: Mapping[str, Any] | None = None
    """The document of ``estimate --json``."""
    total: Mapping[str, Any] | None = None
    """The same with the total backlash unknown, where a limit is of it."""
    judgement: Judgement | None = None
    """By the limits in force and what is known so far."""
    band: DatasheetBand | None = None
    """What units of the datasheet read in this sweep."""
    diagnosis: Any = None
    """With ``to_json()`` and ``summary()``."""
    report: Path | None = None
    """Where the report was written."""
    faults: dict[str, str] = field(default_factory=dict)
    """Why an analysis gave nothing, by job."""
    as_is: bool = False
    """Whether it is taken as it stands, also if it looks like a mistake."""

    @property
    def estimate_told(self) -> Mapping[str, Any] | None:
        """The estimate that is told: the one that is judged, where the total is limited."""
        by_total = self.judgement is not None and self.judgement.limits.limits_total
        found = self.total if by_total else None
        return self.estimate if found is None or found.get("failed") else found

    @property
    def doubt(self) -> str:
        """Why no limit is passed or failed by this measurement; empty if nothing is known."""
        from analysis.observation.incomplete import state_doubt

        state = None if self.response is None else self.response.provenance.get("state")
        looks = "the response looks like a mistake and is taken as it stands" if self.as_is else ""
        return "; ".join(filter(None, (looks, state_doubt(state))))


@dataclass(slots=True)
class Desk:
    """Everything chosen so far.

    Parameters
    ----------
    db
        File of the bench's history; made by the first session if it is not there.
    """

    db: HistoryPlace
    unit_name: str = ""
    """Name or path that `unit` was chosen by, or of which measurement it is."""
    unit: Unit | None = None
    unit_origin: str = ""
    """Which one it is, where it is none of those that come with lashbench."""
    unit_text: str | None = None
    """The file of a unit that came from the history and has no name or path."""
    serial: str = ""
    operator: str = ""
    notes: str = ""
    bench: str = "default"
    """Name or path of the bench file: limits, slew, input ranges."""
    judge_by: str = ""
    """Name or path of the limits to judge by; empty: those of the bench file, else the unit's."""
    recipe_asked: str | None = None
    """Name or path of the recipe, or `NO_RECIPE`; None: the unit's own, if there is one."""
    url: str = SIMULATED_URL
    identity: Identity | None = None
    """Who answered at `url`; None until someone did."""
    link_fault: str = ""
    """Why nobody did."""
    options: PlanOptions = PlanOptions()
    """What the operator says of the sweep; the rest is the recipe's."""
    plan_minutes: float | None = None
    """What was asked for when the sweep that tells most was found last."""
    given_plan: SweepPlan | None = None
    """A plan that came whole, from a diagnosis; it goes before `options`."""
    follows: int | None = None
    """The measurement whose diagnosis proposed `given_plan`, if that is where it came from."""
    resume: int | None = None
    run: RunView = field(default_factory=RunView)
    measurement: int | None = None
    """The measurement that results, diagnosis and report are about."""
    results: Results = field(default_factory=Results)
    reference: FrequencyResponse | None = None
    """Response of an earlier session, drawn behind the one in hand."""
    reference_name: str = ""
    marked: tuple[int, ...] = ()
    """Measurements that are laid over each other, in the order of their marks."""

    @property
    def limits_choice(self) -> LimitsChoice:
        """What the measurement in view is judged by."""
        name = self.unit_name if self.unit_text is None else ""
        return LimitsChoice(self.judge_by, self.bench, self.unit, name)

    @property
    def remarks_of(self) -> int | None:
        """The measurement that serial number, operator and notes are of already: it keeps them."""
        return (self.run.measurement if self.run.live else None) or self.resume

    @property
    def simulated(self) -> bool:
        """Whether the instrument is a simulated one, as far as is known."""
        return is_simulated(self.url) or (self.identity is not None and self.identity.simulated)

    def banner_text(self) -> str:
        """Line that stands on every screen: simulated or not, source, unit, measurement."""
        run = self.run
        parts = ["SIMULATED"] if self.simulated else []
        parts.append(run.source_text)
        if self.unit is not None:
            parts.append(f"{self.unit.name} {self.serial}".strip())
        if run.measurement is not None:
            word = run.finished.state if run.finished is not None else run.phase
            parts.append(f"#{run.measurement} {word} {run.done}/{run.total}")
        return visible_line(" " + " | ".join(parts))

    def choose_unit(self, name: str) -> Unit:
        """Put a unit on the desk, with the sweep that goes with it.

        Raises
        ------
        ConfigurationError
            If there is none of that name or path; the one before stays.
        """
        from sim.unit import load_unit

        unit = load_unit(name)
        self.take_unit(name, unit)
        return unit

    def take_unit(self, name: str, unit: Unit) -> None:
        """Put a unit on the desk that was read by its name or path."""
        from daq.configs import config_names

        shipped = name.lower() in config_names("units")
        self._put(name.lower() if shipped else name, unit, None)

    def begin_anew(self) -> None:
        """What was to be gone on with is left; the next session is a measurement of its own."""
        if self.resume is not None:
            self.resume = self.given_plan = None

    def take_up(self, measurement: Measurement) -> str:
        """Put the measurement that is to be resumed on the desk, with unit and address.

        What to say of remarks that it overwrites, as `take_remarks`.
        """
        typed = self.serial
        self.choose_unit_of(measurement)
        self.serial = typed
        lost = self.take_remarks(measurement)
        header = measurement.header
        self.url, self.identity = header.address, None
        self.resume, self.given_plan = measurement.id, header.plan
        return lost

    def take_remarks(self, measurement: Measurement) -> str:
        """Put serial number, operator and notes of a measurement on the desk: it keeps them.

        What to say of those that are overwritten; empty where there are none.
        """
        lost = []
        for name in ("serial", "operator", "notes"):
            value = getattr(measurement.header, name)
            if getattr(self, name) not in ("", value):
                lost.append(name)
            setattr(self, name, value)
        if not lost:
            return ""
        return (
            f"measurement {measurement.id} keeps its own {' and '.join(lost)}; yours were left out"
        )

    def choose_unit_of(self, measurement: Measurement) -> None:
        """Put the unit of a stored measurement on the desk, as its file was then.

        Raises
        ------
        ConfigurationError
            As `tui.measurements.measured_unit.unit_as_measured`; the one before stays.
        """
        from daq.configs import config_names
        from sim.unit import load_unit
        from tui.measurements.measured_unit import unit_as_measured

        header, unit = measurement.header, unit_as_measured(measurement)
        name = header.unit.lower()
        if name in config_names("units") and unit == load_unit(name):
            self._put(name, unit, None)
        else:
            # Another file of that name may have other numbers: they are this measurement's.
            text = header.configurations["unit"]
            self._put(f"unit of measurement {measurement.id}", unit, text)
        self.serial = header.serial

    def _put(self, name: str, unit: Unit, text: str | None) -> None:
        """Another unit has a sweep of its own."""
        from daq.configs import config_names
        from tui.measurements.unit_differences import origin_words

        if name != self.unit_name:
            self.options, self.given_plan, self.resume = PlanOptions(), None, None
            self.recipe_asked = None
        self.unit_name, self.unit, self.unit_text = name, unit, text
        shipped = text is None and name in config_names("units")
        self.unit_origin = "" if shipped else origin_words(unit, name)

    @property
    def recipe(self) -> str | None:
        """The recipe asked for; else the one that comes with lashbench for this unit, if any."""
        from daq.configs import config_names

        if self.recipe_asked is not None:
            return None if self.recipe_asked == NO_RECIPE else self.recipe_asked
        return self.unit_name if self.unit_name in config_names("recipes") else None

    def request(self, remeasure_hz: tuple[float, float] | None = None) -> SessionRequest:
        """What the next session is to do, checked against all limits.

        Raises
        ------
        InputError, LimitError
            As `tui.measure_options.session_request`; nothing was sent.
        """
        from daq.drivers import check_sweep
        from daq.limits import check_plan
        from tui.measure_options import session_request

        if self.unit is None:
            raise InputError("no unit is chosen; choose one in step 1")
        fresh = self.resume is None
        # A plan that came whole is no recipe's, so a recipe's limits are not its limits.
        recipe = self.recipe if fresh and self.given_plan is None else None
        options = self._options() if fresh else PlanOptions()
        request = session_request(
            options, self.unit_name, self.unit, self.url, self.db,
            recipe=recipe, bench=self.bench,
            resume=self.resume, remeasure=remeasure_hz, run_in=None,
            remarks={"serial": self.serial, "operator": self.operator, "notes": self.notes},
            unit_text=self.unit_text,
        )  # fmt: skip
        if fresh and self.given_plan is not None and request.header is not None:
            check_plan(self.given_plan, request.limits)
            slew, ranges = request.slew_vpk_per_s, request.input_range_vpk
            check_sweep(self.url, self.given_plan, slew, ranges)
            header = replace(request.header, plan=self.given_plan)
            if self.follows is not None:
                header = following(header, self.follows)
            request = replace(request, header=header)
        return request

    def plan(self) -> SweepPlan:
        """The sweep that the next session would make.

        Raises
        ------
        InputError, LimitError
            If there is none that may be driven.
        """
        if self.given_plan is not None:
            return self.given_plan
        header = self.request().header
        if header is None:
            raise InputError("no plan; choose a unit in step 1")
        return header.plan

    def _options(self) -> PlanOptions:
        if self.given_plan is not None:
            plan = self.given_plan
            lowest, highest = min(plan.frequencies_hz), max(plan.frequencies_hz)
            return PlanOptions(plan.levels_vpk, lowest, highest, len(plan.frequencies_hz))
        if self.options.given:
            return self.options
        return self._proposed()

    def _proposed(self) -> PlanOptions:
        """What is proposed where the operator has not said anything of the sweep."""
        from daq.limits import load_bench, tightest
        from daq.recipe import load_recipe
        from tui.bench import unit_limits

        if self.unit is None:
            return PlanOptions()
        recipe = None if self.recipe is None else load_recipe(self.recipe)
        limits = [load_bench(self.bench).bounds(), unit_limits(self.unit)]
        if recipe is not None:
            limits.append(recipe.bounds())
        if recipe is None:
            return propose(None, tightest(limits))
        sweep = recipe.sweep
        return propose(sweep.levels_vpk, tightest(limits), abs(sweep.dc_offset_v))


def plan_of_document(document: Mapping[str, Any]) -> SweepPlan:
    """The sweep plan in a diagnosis' ``next_measurement``.

    Takes the fields of `daq.plan.SweepPlan`, or a band by ``start_hz``,
    ``stop_hz``, ``points`` and ``spacing`` in place of the frequencies.

    Raises
    ------
    InputError
        If it is no plan.
    """
    from daq.plan import SweepPlan, spaced_frequencies

    values = dict(document)
    try:
        if "frequencies_hz" not in values:
            values["frequencies_hz"] = spaced_frequencies(
                values.pop("start_hz"), values.pop("stop_hz"), values.pop("points"),
                values.pop("spacing", "lin"),
            )  # fmt: skip
        for name in ("frequencies_hz", "levels_vpk"):
            values[name] = tuple(float(value) for value in values[name])
        known = set(SweepPlan.__dataclass_fields__)
        return SweepPlan(**{key: value for key, value in values.items() if key in known})
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"the proposed measurement is no sweep plan ({error!r})") from error
