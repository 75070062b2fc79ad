"""The judgement of the measurement in view, by everything that its limits ask for.

Owns which answers of the desk it is by, and when it is out of date. `analysis.acceptance` decides
it; what is missing leaves its limits undecided.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from daq.errors import AnalysisError, InputError
from tui.app.messages import AnalysisDone

if TYPE_CHECKING:
    from analysis.acceptance import Judgement, LimitSet
    from daq.frf import FrequencyResponse
    from tui.app.state.analyses import Analyses, Task
    from tui.app.state.desk import Desk
    from tui.judging import LimitsChoice

__all__ = ["Asked", "Judged", "judge_result"]


@dataclass(frozen=True, slots=True, eq=False)
class Asked:
    """The choice of limits, and what is known of the measurement.

    Parameters
    ----------
    total
        The document of an estimate that takes the total backlash as unknown.
    """

    choice: LimitsChoice
    response: FrequencyResponse | None
    features: Any
    estimate: Mapping[str, Any] | None
    diagnosis: Any
    total: Mapping[str, Any] | None

    @classmethod
    def of(cls, desk: Desk) -> Asked:
        """What is on a desk now."""
        found = desk.results
        return cls(
            desk.limits_choice, found.response, found.features, found.estimate, found.diagnosis,
            found.total,
        )  # fmt: skip

    def holds(self, desk: Desk) -> bool:
        """Whether nothing was chosen or found since."""
        now = Asked.of(desk)
        return (
            self.choice == now.choice
            and self.response is now.response
            and self.estimate is now.estimate
            and self.diagnosis is now.diagnosis
        )


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """A judgement, None where there are no limits; what it is by, and what was estimated for it.

    `is_whole`: not so while something is still estimated for it.
    """

    asked: Asked
    judgement: Judgement | None
    total: Mapping[str, Any] | None
    is_whole: bool = True


def judge_result(task: Task, analyses: Analyses, asked: Asked) -> None:
    """Judge by what is known; the total backlash is estimated where a limit is of it."""

    def work() -> Judged:
        found, response = asked.choice.read(), asked.response
        if found is None or response is None:
            return Judged(asked, None, asked.total)
        doubts = _doubts(task, response)
        first = Judged(asked, _decide(found.limits, asked, asked.total, doubts), asked.total)
        known = asked.total is not None or asked.diagnosis is not None or asked.estimate is None
        if known or doubts or not found.limits.limits_total:
            return first
        task.post(AnalysisDone("judgement", task.measurement, replace(first, is_whole=False)))
        total = _with_total(task, analyses, response)
        return Judged(asked, _decide(found.limits, asked, total, doubts), total)

    task.run("judgement", work)


def _doubts(task: Task, response: FrequencyResponse) -> str:
    """Why nothing passes or fails by this response; empty where nothing is known."""
    from analysis.observation.incomplete import state_doubt
    from analysis.observation.input_check import check_inputs

    said = check_inputs([response], task.unit, as_is=True)
    return "; ".join(filter(None, [*said, state_doubt(response.provenance.get("state"))]))


def _decide(
    limits: LimitSet, asked: Asked, total: Mapping[str, Any] | None, doubts: str
) -> Judgement:
    from analysis.acceptance import judge
    from analysis.resonance import to_json

    return judge(
        limits,
        features=to_json(asked.features) if limits.needs_features else None,
        # The usual estimate takes the total backlash as known.
        estimate=(total or asked.estimate) if limits.limits_total else asked.estimate,
        diagnosis=None if asked.diagnosis is None else asked.diagnosis.to_json(),
        doubt=doubts,
    )


def _with_total(task: Task, analyses: Analyses, response: FrequencyResponse) -> Mapping[str, Any]:
    """The document of an estimate of the total backlash, too, or why there is none."""
    try:
        return analyses.total(response, task.unit, task.progress("judgement"))
    except (AnalysisError, InputError) as error:
        return {"failed": str(error)}
