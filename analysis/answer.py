"""Which model of the unit is accepted, and what that model says of the backlash of each stage.

Owns the choice between the plain model and an extended one, from the documents of
``estimate --json`` and ``diagnose --json`` alone. It computes no number and words no advice.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeGuard

__all__ = [
    "CALL_FOR_DIAGNOSIS",
    "QUANTITIES",
    "Answer",
    "State",
    "accept_model",
    "model_name",
    "span_of",
]

Number = Mapping[str, Any]
"""``{"value", "std"}``, with ``"interval95"`` where it is known."""

State = Literal["accepted", "not judged", "open", "refuted", "none"]

QUANTITIES = ("contribution_ratio", "b1_deg", "b2_deg", "b_t_deg", "b3_deg")
"""The last is told of a drive with three stages alone."""

CALL_FOR_DIAGNOSIS = "run diagnose before trusting the ratio"
"""End of the warning by which an estimate says that the plain model does not fit."""

PLAIN = "plain model"

_SIGMA = 2.0
"""Standard deviations on either side that stand for a 95 % interval which is not stated."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What is known of the backlash of a unit, and from which model.

    Parameters
    ----------
    state
        "accepted": a diagnosis accepts one model. "not judged": the estimate of the plain model
        fits, and no diagnosis was made. "open": a diagnosis leaves several models. "refuted":
        the plain model does not fit and no other model is accepted. "none": nothing was
        estimated.
    source
        Where the numbers come from, in words for a person.
    numbers
        The numbers of `QUANTITIES` of the model in force; empty where the state is "open",
        "refuted" or "none".
    models
        Every model that may be true, the accepted or likeliest first. Each holds ``causes``,
        ``probability`` (None where it was not judged) and `QUANTITIES`.
    diagnosed
        Whether a diagnosis was made.
    """

    state: State
    source: str
    numbers: Mapping[str, Number]
    models: tuple[Mapping[str, Any], ...] = ()
    diagnosed: bool = False

    def over_models(self, name: str) -> Number | None:
        """A quantity over every model that is left, weighted by its probability.

        Mean and standard deviation of the mixture (Bayesian model averaging, Hoeting et al. 1999);
        the interval spans those of all models. None where one model is left, or one does not tell
        the quantity.
        """
        told = [model.get(name) for model in self.models]
        numbers = [number for number in told if number is not None]
        if len(numbers) < 2 or len(numbers) != len(told):
            return None
        weights = [
            1.0 if model.get("probability") is None else float(model["probability"])
            for model in self.models
        ]
        if (total := sum(weights)) <= 0.0:
            return None
        shares = [weight / total for weight in weights]
        mean = sum(s * n["value"] for s, n in zip(shares, numbers, strict=True))
        square = sum(
            s * ((n["std"] or 0.0) ** 2 + (n["value"] - mean) ** 2)
            for s, n in zip(shares, numbers, strict=True)
        )
        spans = [span_of(number) for number in numbers]
        interval = [min(low for low, _ in spans), max(high for _, high in spans)]
        return {"value": mean, "std": square**0.5, "interval95": interval}

    @property
    def contribution_ratio(self) -> Number | None:
        """Share of stage 1 in the backlash seen at the output, or in what a third stage leaves.

        None where no model is in force.
        """
        return self.numbers.get("contribution_ratio")

    @property
    def b1_deg(self) -> Number | None:
        """Backlash of stage 1, degrees at shaft 1; None where no model is in force."""
        return self.numbers.get("b1_deg")

    @property
    def b2_deg(self) -> Number | None:
        """Backlash of stage 2, degrees at its gear; None where no model is in force."""
        return self.numbers.get("b2_deg")

    @property
    def b_t_deg(self) -> Number | None:
        """Total backlash, degrees at the output; None where no model is in force."""
        return self.numbers.get("b_t_deg")


def span_of(number: Mapping[str, Any]) -> tuple[float, float]:
    """The 95 % interval of a number; two standard deviations on either side if it is not stated."""
    if number.get("interval95"):
        low, high = number["interval95"]
        return float(low), float(high)
    std = number["std"] or 0.0
    return max(0.0, number["value"] - _SIGMA * std), number["value"] + _SIGMA * std


def accept_model(
    estimate: Mapping[str, Any] | None, diagnosis: Mapping[str, Any] | None = None
) -> Answer:
    """Choose the model whose numbers are told.

    A diagnosis decides where there is one. Without it the plain model is taken, unless the
    estimate itself says that this model does not fit.

    Parameters
    ----------
    estimate
        Document of ``estimate --json``; None, or a document without a ratio, if there is none.
    diagnosis
        Document of ``diagnose --json`` of the same points; None if none was made.
    """
    if diagnosis is not None and "verdict" in diagnosis:
        return _of_diagnosis(diagnosis)
    numbers = {} if estimate is None else _numbers(estimate)
    if estimate is None or "contribution_ratio" not in numbers:
        return Answer("none", "no estimate: none", {})
    if _refuted(estimate):
        return Answer("refuted", f"{PLAIN} refuted: none", {})
    model: dict[str, Any] = {"causes": [], "probability": None, **numbers}
    return Answer("not judged", f"{PLAIN}, not judged", numbers, (model,))


def _refuted(estimate: Mapping[str, Any]) -> bool:
    """Whether an estimate says that the plain model does not fit; older ones say it in words."""
    said = estimate.get("refuted")
    if said is not None:
        return bool(said)
    return any(CALL_FOR_DIAGNOSIS in str(text) for text in _list(estimate.get("warnings")))


def _of_diagnosis(diagnosis: Mapping[str, Any]) -> Answer:
    word = diagnosis["verdict"]
    if word == "unexplained":
        source = f"{PLAIN} refuted, and no known cause explains the response: none"
        return Answer("refuted", source, {}, diagnosed=True)
    models = tuple(filter(None, (_model(one) for one in _list(diagnosis.get("models")))))
    if word not in ("consistent", "explained"):
        names = _and([model_name(model["causes"]) for model in models])
        source = f"undecided between {names}: none" if models else "undecided: none"
        return Answer("open", source, {}, models, diagnosed=True)
    causes = [name for one in _list(diagnosis.get("causes")) if (name := _field(one, "effect"))]
    source = f"extended by {' and '.join(map(str, causes))}" if causes else f"{PLAIN}, consistent"
    ratio = _field(diagnosis.get("contribution_ratio"), "extended")
    numbers = _numbers({**diagnosis, "contribution_ratio": ratio})
    if numbers and not models:
        models = ({"causes": causes, "probability": None, **numbers},)
    return Answer("accepted", source, numbers, models, diagnosed=True)


def model_name(causes: Sequence[str]) -> str:
    """A model in words: its causes, or that it is the plain one."""
    return " with ".join(causes) or PLAIN


def _and(names: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


def _model(document: Any) -> dict[str, Any] | None:
    """One entry of ``models``; None where it is none: a history may hold anything."""
    if not isinstance(document, Mapping):
        return None
    probability = document.get("probability")
    return {
        "causes": [str(name) for name in _list(document.get("causes"))],
        "probability": probability if _is_number(probability) else None,
        **_numbers(document),
    }


def _numbers(document: Mapping[str, Any]) -> dict[str, Number]:
    """Those that are there and are numbers; what is not finite is null in a document."""
    told = {name: document.get(name) for name in QUANTITIES}
    return {name: one for name, one in told.items() if _is_uncertain(one)}


def _is_uncertain(one: Any) -> TypeGuard[Number]:
    if not isinstance(one, Mapping) or not _is_number(one.get("value")):
        return False
    interval, std = one.get("interval95"), one.get("std")
    stated = interval is None or (len(_list(interval)) == 2 and all(map(_is_number, interval)))
    return stated and "std" in one and (std is None or _is_number(std))


def _is_number(one: Any) -> bool:
    return isinstance(one, int | float) and not isinstance(one, bool) and math.isfinite(one)


def _list(one: Any) -> Sequence[Any]:
    return one if isinstance(one, list | tuple) else ()


def _field(one: Any, name: str) -> Any:
    return one.get(name) if isinstance(one, Mapping) else None
