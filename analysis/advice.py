"""What the answer means for whoever adjusts the gears, in plain words.

Owns the sentence about which stage to adjust, and the line of each stage. It judges no limit
(`analysis.acceptance` does), estimates nothing and chooses no model (`analysis.answer` does).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from analysis.acceptance import Item, Judgement, Verdict, combine, judge_stages
from analysis.answer import Answer, model_name, span_of
from sim.catalogue import CATALOGUE
from sim.unit import Unit

__all__ = ["Advice", "Stage", "advise"]

_HALF = 0.5


@dataclass(frozen=True, slots=True)
class Stage:
    """One gear stage: its number, what its limits say of it (None without one), and a line.

    The line is empty where neither the backlash nor a limit is known.
    """

    stage: int
    verdict: Verdict | None
    line: str


@dataclass(frozen=True, slots=True)
class Advice:
    """What to do, in one sentence, and each stage beside its limit.

    `before`: what to do before a gear is touched, empty where there is nothing.
    """

    headline: str
    stages: tuple[Stage, ...]
    before: str = ""

    def lines(self) -> list[str]:
        """What comes before, the headline, a line for each stage of which something is known."""
        first = [self.before] if self.before else []
        return [*first, self.headline, *(stage.line for stage in self.stages if stage.line)]


def advise(
    answer: Answer,
    unit: Unit | None = None,
    *,
    judgement: Judgement | None = None,
    doubt: str = "",
) -> Advice:
    """What to do about the stages, by every model that may be true.

    Limits of b1 and b2 decide where there are any: those of the judgement, or those of the unit
    for a stage of which it has none. Without them the stage that holds more of the backlash is
    named, where the whole 95 % interval of the contribution ratio lies on its side of one half.
    Nothing is decided that the models left do not agree on, and nothing at all where no model is
    accepted.

    Parameters
    ----------
    unit
        The unit that the answer is about, with its limits; None if it is not known.
    judgement
        What the limits asked for say of the same answer.
    doubt
        Why the response is not to be trusted; no limit of the unit is passed or failed then.
    """
    one_stage = _has_one_stage(answer, unit)
    own = None if unit is None else judge_stages(unit, answer, doubt)
    stages = tuple(
        _told_with_limits(answer, number, _items(judgement, number) or _items(own, number), unit)
        for number in (1, 2)[: 1 if one_stage else 2]
    )
    limited = [stage for stage in stages if stage.verdict is not None]
    if not answer.models or any("contribution_ratio" not in one for one in answer.models):
        headline = _without_model(answer)
    elif limited:
        headline = _by_limits(limited, doubt)
    elif one_stage:
        headline = "There is one gear stage: it holds all of the backlash."
    else:
        headline = _by_ratio(answer)
    return Advice(headline, stages, _before(answer))


def _before(answer: Answer) -> str:
    """What a fault of the measuring chain asks for, where the first model has one."""
    causes = answer.models[0]["causes"] if answer.models else ()
    if not any(name in CATALOGUE and CATALOGUE[name].site == "chain" for name in causes):
        return ""
    if answer.state == "open":
        return "Before touching a gear, see whether the measuring chain is right."
    return "Before touching a gear, put the measuring chain right."


def _has_one_stage(answer: Answer, unit: Unit | None) -> bool:
    if unit is not None:
        return unit.stages == 1
    ratio = answer.contribution_ratio
    return ratio is not None and ratio["value"] == 1.0 and not ratio["std"]


def _items(judgement: Judgement | None, stage: int) -> list[Item]:
    items = () if judgement is None else judgement.items
    return [item for item in items if item.quantity == f"b{stage}_deg"]


def _told_with_limits(
    answer: Answer, stage: int, items: Sequence[Item], unit: Unit | None
) -> Stage:
    """One stage by every model that may be true, with what its limits say of it."""
    told = [model.get(f"b{stage}_deg") for model in answer.models]
    numbers = [number for number in told if number is not None]
    known = len(numbers) == len(told) > 0
    said = _told(stage, numbers) if known else f"b{stage} is not known"
    if not items and not known:
        return Stage(stage, None, "")
    if not items:
        most = _most(answer, stage, unit)
        all_of_it = "" if most is None else f", all of it would be {most:.4f} deg"
        return Stage(stage, None, f"Stage {stage}: {said}; no limit set{all_of_it}.")
    verdict = combine([item.verdict for item in items])
    limits = " and ".join(_limit(item) for item in items)
    reasons = dict.fromkeys(item.reason for item in items if item.verdict == "UNDECIDED")
    why = "; ".join(filter(None, reasons))
    action = f"{_ACTIONS[verdict]} ({why})" if why else _ACTIONS[verdict]
    return Stage(stage, verdict, f"Stage {stage}: {verdict}. {said}; limit {limits}: {action}")


def _limit(item: Item) -> str:
    return f"{item.upper:.4f} deg" if item.lower is None else item.limit


def _told(stage: int, numbers: Sequence[Mapping[str, Any]]) -> str:
    low = min(span_of(number)[0] for number in numbers)
    high = max(span_of(number)[1] for number in numbers)
    if len(numbers) > 1:
        return f"b{stage} = {low:.4f} to {high:.4f} deg (95 %, over the models left)"
    (number,) = numbers
    std = number["std"] or 0.0
    return f"b{stage} = {number['value']:.4f} +- {std:.4f} deg (95 %: {low:.4f} to {high:.4f})"


def _most(answer: Answer, stage: int, unit: Unit | None) -> float | None:
    """The backlash of a stage that holds all of it, by the likeliest model."""
    total = answer.models[0].get("b_t_deg")
    if total is None or unit is None:
        return None
    shared = total["value"] - (0.0 if unit.stage3 is None else unit.stage3.b3_deg)
    return float(max(shared, 0.0) * (unit.output_ratio if stage == 1 else unit.last_ratio))


def _without_model(answer: Answer) -> str:
    if answer.state == "none":
        return "No advice: nothing was estimated."
    if answer.state in ("open", "accepted", "not judged"):
        return "No advice: the backlash by the models that are left is not known."
    if answer.diagnosed:
        return "No advice: no model that is known explains this response."
    return (
        "No advice before a diagnosis: the plain model does not explain this response. "
        "Run lashbench diagnose."
    )


def _by_limits(limited: Sequence[Stage], doubt: str) -> str:
    """The verdicts of all stages that have a limit, and what they ask for."""
    found = {word: [s.stage for s in limited if s.verdict == word] for word in _ACTIONS}
    told = "; ".join(f"stage {s.stage} {s.verdict}" for s in limited)
    if found["FAIL"]:
        return f"Adjust {_stages(found['FAIL'])}: {told}."
    if found["UNDECIDED"] and doubt:
        return f"Undecided: {told}. Settle first whether the response is right."
    if found["UNDECIDED"]:
        return (
            f"Undecided: {told}. Measure again at further source levels before adjusting "
            f"{_stages(found['UNDECIDED'])}."
        )
    return f"Leave {_stages(found['PASS'])} as {'it is' if len(limited) == 1 else 'they are'}: " \
           f"{told}."  # fmt: skip


def _stages(numbers: Sequence[int]) -> str:
    return " and ".join(f"stage {number}" for number in numbers)


def _by_ratio(answer: Answer) -> str:
    ratios = [model["contribution_ratio"] for model in answer.models]
    spans = [span_of(ratio) for ratio in ratios]
    low, high = min(s[0] for s in spans), min(1.0, max(s[1] for s in spans))
    span = f"{100 * low:.0f} to {100 * high:.0f} %"
    has_three = "b3_deg" in answer.models[0]
    what = "the backlash of stages 1 and 2" if has_three else "the backlash"
    if len(ratios) == 1:
        share = f"{100 * ratios[0]['value']:.0f} % of {what} sits in stage 1 (95 %: {span})"
        share += f", by the {_by(answer)}"
    else:
        share = f"{span} of {what} sits in stage 1 (95 %, over the {len(ratios)} models left)"
    if low > _HALF:
        return f"Adjust stage 1 first: {share}."
    if high < _HALF:
        return f"Adjust stage 2 first: {share}."
    if all(least <= _HALF <= most for least, most in spans):
        return f"Neither stage stands out: {share}. Measure at more levels before adjusting one."
    names = ", ".join(model_name(model["causes"]) for model in answer.models)
    return (
        f"Undecided, adjust no stage yet: {share}. The models left are {names}; a further "
        "measurement has to decide between them."
    )


def _by(answer: Answer) -> str:
    if answer.state == "not judged":
        return f"{answer.source} yet"
    return f"model {answer.source}" if answer.models[0]["causes"] else answer.source


_ACTIONS: Mapping[Verdict, str] = {
    "PASS": "leave it.",
    "FAIL": (
        "adjust its mesh (centre distance or preload) and measure again; replace the gear pair "
        "where nothing is left to adjust, or where the play came with wear."
    ),
    "UNDECIDED": "measure again at further source levels before adjusting it.",
}
