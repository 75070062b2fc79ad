"""The diagnosis from the paper's own two measured rows: what its simulation gets wrong, and why.

Owns what was measured, with which errors, and the document that is answered
with. Four frequencies and gains and a half-power width, of one run at one
drive level, decide little; so everything here is told with its probability, and
both without and with what the microscope knew of the gears.
"""

from __future__ import annotations

import time
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.diagnosis.experiment_design import NextMeasurement
from analysis.ensemble.datasheet_belief import believed_document
from analysis.ensemble.model import Hypothesis
from analysis.execution.blas import on_one_core
from analysis.execution.progress import Progress
from analysis.paper.published import UnitName, load_paper
from analysis.paper_diagnosis.document import document
from analysis.paper_diagnosis.evidence import Agreement, RatioPrior, agree
from analysis.paper_diagnosis.experiment_design import propose_sweep
from analysis.paper_diagnosis.features import Reading, plan_about
from analysis.paper_diagnosis.posterior import Belief, Knowledge, believe
from analysis.paper_diagnosis.result import PaperFindings
from analysis.paper_diagnosis.search import search_sets
from analysis.paper_diagnosis.simulation import Effort, Explored, Explorer
from analysis.paper_diagnosis.text import summarise
from daq.errors import InputError
from daq.plan import SweepPlan
from sim.unit import Unit

__all__ = ["PaperDiagnosis", "diagnose_features", "diagnose_paper", "paper_reading"]


_READING_HZ, _READING_DB = 0.5, 0.5
"""Reading errors: printed to 1 Hz, read off a plot or a marker to half a decibel."""

_WIDTH_SHARE = 0.15
"""Error of the half-power width, which stands behind the printed damping ratio, as a share: the
two printed damping ratios of a unit disagree by 3 % and each half-power point is a reading."""

_MICROSCOPE_STD = 0.02
"""Error of the ratio that follows from both plays seen under the microscope."""

_MEASURED_TOO = ("total-backlash",)
"""What the microscope rules out beside other ratios: it saw both plays, so their sum as well."""

_OTHER_PROCEDURES: dict[str, dict[str, Any]] = {
    "swept-up": {"from_rest": False},
    "swept-down": {"from_rest": False, "direction": "down"},
}


def paper_reading(unit: UnitName) -> Reading:
    """The measured features of one of the paper's units, with the errors they are given here."""
    paper = load_paper()
    row, finding = paper.measured_row(unit), paper.finding(unit)
    if row.rf_db is None:
        raise InputError(f"{unit}: the measured gain at RF is not in print; take the other unit")
    width_hz = 2.0 * finding.zeta_arf * row.arf_hz
    return Reading(
        np.array([row.arf_hz, row.arf_db, row.rf_hz, row.rf_db, width_hz]),
        np.array([_READING_HZ, _READING_DB, _READING_HZ, _READING_DB, _WIDTH_SHARE * width_hz]),
    )


class PaperDiagnosis(PaperFindings):
    """What the plain model gets wrong about five measured numbers, and what may explain it."""

    def to_json(self) -> dict[str, Any]:
        """The document of ``diagnose --paper --json``."""
        return document(self)

    def summary(self) -> list[str]:
        """The answer in lines of text for people."""
        return summarise(self)

    def plot(self, directory: Path | str) -> list[Path]:
        """Write the figure as PNG and return its path."""
        from analysis.paper_diagnosis.figure import draw  # loads matplotlib

        return draw(self, Path(directory))


def diagnose_paper(
    unit: Unit,
    *,
    progress: Progress | None = None,
    seed: int = 0,
    without: Collection[str] = (),
    effort: Effort | None = None,
) -> PaperDiagnosis:
    """Diagnose one of the paper's units from its own measured row.

    Parameters
    ----------
    unit
        The one of the two that was measured, by its name: ADSS or EDSS.
    progress
        Told the share done and what is being done, from the calling thread.
    seed
        Of the starts and places of the simulations.
    without
        Effects to leave out of the catalogue.
    effort
        How much is simulated.

    Raises
    ------
    InputError
        If the paper has no such unit.
    """
    names: dict[str, UnitName] = {"ADSS": "ADSS", "EDSS": "EDSS"}
    name = names.get(unit.name)
    if name is None:
        raise InputError(f"the paper measured no unit {unit.name!r}; give adss or edss")
    row = load_paper().measured_row(name)
    return diagnose_features(
        paper_reading(name),
        unit,
        known_ratio=row.ratio_percent / 100.0,
        without=without,
        progress=progress,
        seed=seed,
        effort=effort,
    )


@on_one_core()
def diagnose_features(
    reading: Reading,
    unit: Unit,
    *,
    known_ratio: float | None = None,
    without: Collection[str] = (),
    progress: Progress | None = None,
    seed: int = 0,
    effort: Effort | None = None,
) -> PaperDiagnosis:
    """Diagnose a unit from ARF, RF and the half-power width of one sweep at 2.5 V peak.

    Parameters
    ----------
    reading
        What was measured; a number that is not known is NaN, ARF and RF must be.
    known_ratio
        Contribution ratio from a microscope, where there is one.
    without
        Effects to leave out of the catalogue.

    Raises
    ------
    InputError
        If ARF and RF are not two frequencies in ascending order.
    AnalysisError
        If a motion grew without bound.
    """
    began = time.perf_counter()
    arf, rf = float(reading.values[0]), float(reading.values[2])
    if not (np.isfinite([arf, rf]).all() and 0.0 < arf < rf):
        raise InputError(f"ARF {arf:g} Hz and RF {rf:g} Hz: give both, above 0, ARF below RF")
    effort = Effort() if effort is None else effort
    rng = np.random.default_rng(seed)
    states = [Knowledge(RatioPrior())]
    if known_ratio is not None:
        states.append(Knowledge(RatioPrior(known_ratio, _MICROSCOPE_STD), _MEASURED_TOO))
    explorer = Explorer(unit, _plan(reading, effort), effort, known_ratio, rng)
    tell = _told(progress)
    explored = search_sets(
        explorer,
        reading,
        [state.prior for state in states],
        without=without,
        progress=lambda share, text: tell(0.85 * share, text),
    )
    beliefs = [believe(explored, reading, state) for state in states]
    tell(0.85, "simulating other ways of sweeping")
    procedures = _other_procedures(explorer, explored[0], reading, states[-1])
    tell(0.92, "choosing the next measurement")
    proposal = _proposal(explorer, beliefs[0], reading)
    tell(1.0, "done")
    return PaperDiagnosis(
        unit=unit.name,
        reading=reading,
        free=beliefs[0],
        known=beliefs[1] if len(beliefs) > 1 else None,
        procedures=procedures,
        next_measurement=proposal,
        elapsed_s=time.perf_counter() - began,
        believed=believed_document(unit),
    )


def _told(progress: Progress | None) -> Progress:
    return (lambda share, text: None) if progress is None else progress


def _plan(reading: Reading, effort: Effort, **procedure: Any) -> SweepPlan:
    return plan_about(
        reading,
        points=effort.points,
        settle_cycles=effort.settle_cycles,
        integrate_cycles=effort.integrate_cycles,
        **procedure,
    )


def _other_procedures(
    explorer: Explorer, plain: Explored, reading: Reading, state: Knowledge
) -> dict[str, Agreement]:
    """The plain model alone, as the bench may have swept it."""
    found = {"from-rest": plain}
    for name, procedure in _OTHER_PROCEDURES.items():
        other = replace(explorer, plan=_plan(reading, explorer.effort, **procedure))
        found[name] = other.explore(Hypothesis(explorer.unit), explorer.effort.baseline)
    return {name: agree(one, reading, state.prior) for name, one in found.items()}


def _proposal(explorer: Explorer, belief: Belief, reading: Reading) -> NextMeasurement | None:
    """A sweep between the best set and its first rival, where the verdict leaves one."""
    if belief.word != "ambiguous" or not belief.rivals:
        return None
    places = explorer.effort.places
    return propose_sweep(
        explorer.unit, belief.best, belief.rivals[0], reading, places, explorer.rng
    )
