"""The judgement of the measurement in view, by everything that its limits ask for.

Owns which answers of the desk it is by, and when it is out of date. `analysis.acceptance` decides
it; what is missing leaves its limits undecided.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from daq.errors import AnalysisError, InputError

if TYPE_CHECKING:
    from analysis.acceptance import Judgement
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
    """A judgement, None where there are no limits; what it is by, and what was estimated for it."""

    asked: Asked
    judgement: Judgement | None
    total: Mapping[str, Any] | None


def judge_result(task: Task, analyses: Analyses, asked: Asked) -> None:
    """Judge by what is known; the total backlash is estimated where a limit is of it."""

    def work() -> Judged:
        from analysis.acceptance import judge
        from analysis.observation.incomplete import state_doubt
        from analysis.observation.input_check import check_inputs
        from analysis.resonance import to_json

        found, response = asked.choice.read(), asked.response
        if found is None or response is None:
            return Judged(asked, None, asked.total)
        limits = found.limits
        doubts = check_inputs([response], task.unit, as_is=True)
        doubts += filter(None, [state_doubt(response.provenance.get("state"))])
        told = None if asked.diagnosis is None else asked.diagnosis.to_json()
        estimate, total = asked.estimate, asked.total
        if limits.limits_total:
            is_due = estimate is not None and told is None and not doubts
            if total is None and is_due:
                total = _with_total(task, analyses, response)
            estimate = total
        judgement = judge(
            limits,
            features=to_json(asked.features) if limits.needs_features else None,
            estimate=estimate,
            diagnosis=told,
            doubt="; ".join(doubts),
        )
        return Judged(asked, judgement, total)

    task.run("judgement", work)


def _with_total(task: Task, analyses: Analyses, response: FrequencyResponse) -> Mapping[str, Any]:
    """The document of an estimate of the total backlash, too, or why there is none."""
    try:
        return analyses.total(response, task.unit, task.progress("judgement"))
    except (AnalysisError, InputError) as error:
        return {"failed": str(error)}
