"""The judgement of one unit: every limit against what was measured, and what that says together.

Owns which value of which document a limit is about, how wide its guard band is, and the words.
It reads the documents of ``extract``, ``estimate`` and ``diagnose`` and computes none.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from analysis.acceptance.decision import (
    EXIT_CODES,
    RULE,
    Verdict,
    combine,
    decide,
    false_pass_share,
    reasons,
)
from analysis.acceptance.limits import LimitSet, limits_of_stages
from analysis.answer import Answer, accept_model
from analysis.resonance.records import with_error
from sim.acceptance import BACKLASH_QUANTITIES, FEATURE_QUANTITIES, Bound
from sim.unit import Unit

__all__ = ["NAMES", "Item", "Judgement", "judge", "judge_stages"]

Data = Mapping[str, Any]

NAMES: Mapping[str, str] = {
    "r": "contribution ratio r",
    "b1_deg": "b1",
    "b2_deg": "b2",
    "b_t_deg": "b_t",
    "arf_hz": "ARF",
    "rf_hz": "RF",
    "difference_hz": "RF - ARF",
    "arf_gain_db": "gain at ARF",
    "rf_gain_db": "gain at RF",
    "arf_damping": "damping of ARF",
    "rf_damping": "damping of RF",
}
_UNITS = {**BACKLASH_QUANTITIES, **FEATURE_QUANTITIES}
_Z95 = 1.959964
"""Standard deviations on either side of a 95 % interval of a normal distribution."""
_LEVELS_ALIKE = 1e-6
_CAUSE = "cause"
_JUMP = "the response jumps there"
"""Part of a flag of a feature whose place differs from sweep to sweep."""
_SIGNED = ("arf_gain_db", "rf_gain_db", "difference_hz")


@dataclass(frozen=True, slots=True)
class _Value:
    """A value with its standard uncertainty to either side.

    `lack` says why it cannot be judged, `remark` what it depends on.
    """

    value: float | None = None
    std: float | None = None
    u_low: float = 0.0
    u_high: float = 0.0
    lack: str = ""
    remark: str = ""


@dataclass(frozen=True, slots=True)
class Item:
    """One limit and what was decided.

    Parameters
    ----------
    quantity
        A quantity of a limit, or ``"cause"``.
    value, std
        What was measured and its standard uncertainty; None where it is not known, or where
        several models give several.
    low, high
        Ends of value - k u and value + k u, over every model that may be true.
    reason
        Why no value could be judged, or what the value depends on; may be empty.
    cause
        The effect that is not tolerated, for ``"cause"``.
    """

    quantity: str
    verdict: Verdict
    lower: float | None = None
    upper: float | None = None
    source_vpk: float | None = None
    value: float | None = None
    std: float | None = None
    low: float | None = None
    high: float | None = None
    reason: str = ""
    cause: str = ""

    @property
    def name(self) -> str:
        """The quantity in words, with its source level."""
        if self.quantity == _CAUSE:
            return self.cause
        at = "" if self.source_vpk is None else f" at {self.source_vpk:g} V"
        return f"{NAMES[self.quantity]}{at}"

    @property
    def limit(self) -> str:
        """The limit in words."""
        if self.quantity == _CAUSE:
            return "not tolerated"
        unit = f" {_UNITS[self.quantity]}" if _UNITS[self.quantity] else ""
        if self.lower is None:
            return f"at most {self.upper:g}{unit}"
        if self.upper is None:
            return f"at least {self.lower:g}{unit}"
        return f"{self.lower:g} to {self.upper:g}{unit}"

    @property
    def measured(self) -> str:
        """The value in words; a dash where there is none."""
        unit = f" {_UNITS[self.quantity]}" if _UNITS.get(self.quantity) else ""
        if self.value is not None:
            return f"{with_error(self.value, self.std)}{unit}"
        if self.low is not None and self.high is not None:
            return f"{self.low:.4g} to {self.high:.4g}{unit}"
        return "-"

    @property
    def line(self) -> str:
        """The decision in one line."""
        said = self.measured if self.measured != "-" else ""
        text = f"{self.verdict}  {self.name}: {', '.join(filter(None, [said, self.limit]))}"
        return f"{text} ({self.reason})" if self.reason else text

    def to_json(self) -> dict[str, Any]:
        """The fields; numbers that are not known are None."""
        return {
            "quantity": self.quantity,
            "verdict": self.verdict,
            "source_vpk": self.source_vpk,
            "value": self.value,
            "std": self.std,
            "guarded": None if self.low is None else [self.low, self.high],
            "lower": self.lower,
            "upper": self.upper,
            "cause": self.cause or None,
            "reason": self.reason,
        }


@dataclass(frozen=True, slots=True)
class Judgement:
    """What all limits say of one unit."""

    limits: LimitSet
    items: tuple[Item, ...]

    @property
    def verdict(self) -> Verdict:
        """FAIL if a limit is failed, else UNDECIDED if one is not decided, else PASS."""
        return combine([item.verdict for item in self.items])

    @property
    def exit_code(self) -> int:
        """Of a command that judges: 0 PASS, 6 FAIL, 7 UNDECIDED."""
        return EXIT_CODES[self.verdict]

    @property
    def failed(self) -> list[str]:
        """Names of what is out of limits."""
        return [item.name for item in self.items if item.verdict == "FAIL"]

    @property
    def open(self) -> list[str]:
        """Names of what is not decided."""
        return [item.name for item in self.items if item.verdict == "UNDECIDED"]

    @property
    def headline(self) -> str:
        """The verdict and what it rests on, in one sentence."""
        said = f"{self.verdict} by limits {self.limits.name}", reasons(self.failed, self.open)
        return f"{'; '.join(filter(None, said))}."

    @property
    def rule(self) -> str:
        """The decision rule in words."""
        k = self.limits.acceptance.coverage_factor
        return (
            f"{RULE}: PASS where value +- k u lies within the limits, FAIL where it lies outside, "
            f"else UNDECIDED; k = {k:g}, u is the standard uncertainty; a unit beyond a limit "
            f"passes it with a probability of {100 * false_pass_share(k):.2g} % at most"
        )

    def lines(self) -> list[str]:
        """The verdict, a line for each limit, and the rule."""
        head = f"{self.verdict} by limits {self.limits.name}"
        return [head, *(f"  {item.line}" for item in self.items), f"  rule: {self.rule}"]

    def to_json(self) -> dict[str, Any]:
        """The ``judgement`` of a verb's document."""
        return {
            "verdict": self.verdict,
            "limits": {"name": self.limits.name, "sha256": self.limits.digest},
            "rule": self.rule,
            "coverage_factor": self.limits.acceptance.coverage_factor,
            "failed": self.failed,
            "undecided": self.open,
            "items": [item.to_json() for item in self.items],
        }


def judge(
    limits: LimitSet,
    *,
    features: Data | None = None,
    estimate: Data | None = None,
    diagnosis: Data | None = None,
    doubt: str = "",
) -> Judgement:
    """Judge a unit.

    Parameters
    ----------
    features, estimate, diagnosis
        Documents of ``extract``, ``estimate`` and ``diagnose --json``; None for what was not made.
    doubt
        Why the response is not to be trusted; nothing passes or fails then.
    """
    answer = accept_model(estimate, diagnosis)
    k = limits.acceptance.coverage_factor
    items: list[Item] = []
    for quantity, bound in limits.acceptance.bounds():
        if quantity in FEATURE_QUANTITIES:
            items += [
                _judged(quantity, bound, [value], k, level)
                for level, value in _of_levels(features, quantity, bound)
            ]
        else:
            items.append(_judged(quantity, bound, _of_models(answer, estimate, quantity), k))
    items += [_cause(name, answer, diagnosis) for name in limits.acceptance.causes_not_tolerated]
    if doubt:
        items = [_doubted(item, doubt) for item in items]
    return Judgement(limits, tuple(items))


def judge_stages(unit: Unit, answer: Answer, doubt: str = "") -> Judgement | None:
    """Judge each stage by the limits of the unit itself, by the same rule; None if it has none.

    Parameters
    ----------
    answer
        What is known of the backlash.
    doubt
        As `judge`.
    """
    limits = limits_of_stages(unit)
    if limits is None:
        return None
    k = limits.acceptance.coverage_factor
    items = tuple(
        _judged(quantity, bound, _of_models(answer, None, quantity), k)
        for quantity, bound in limits.acceptance.bounds()
    )
    return Judgement(limits, tuple(_doubted(item, doubt) for item in items) if doubt else items)


def _doubted(item: Item, doubt: str) -> Item:
    return replace(item, verdict="UNDECIDED", reason=doubt)


def _judged(
    quantity: str, bound: Bound, values: Sequence[_Value], k: float, level: float | None = None
) -> Item:
    """One limit by every value that may be the true one."""
    lacks = list(dict.fromkeys(value.lack for value in values if value.lack))
    item = Item(quantity, "UNDECIDED", bound.lower, bound.upper, level)
    only = values[0] if len(values) == 1 else _Value()
    if lacks:
        return replace(item, value=only.value, reason=lacks[0])
    remarks = list(dict.fromkeys(value.remark for value in values if value.remark))
    spans = [_span(quantity, value, k) for value in values]
    verdicts = {decide(low, high, bound.lower, bound.upper) for low, high in spans}
    verdict = verdicts.pop() if len(verdicts) == 1 else "UNDECIDED"
    return replace(
        item,
        verdict=verdict,
        value=only.value,
        std=only.std,
        low=min(low for low, _ in spans),
        high=max(high for _, high in spans),
        reason="; ".join(remarks),
    )


def _span(quantity: str, value: _Value, k: float) -> tuple[float, float]:
    """Value - k u to value + k u, within what is possible."""
    assert value.value is not None
    low, high = value.value - k * value.u_low, value.value + k * value.u_high
    if quantity in _SIGNED:
        return low, high
    most = 1.0 if quantity == "r" else math.inf
    return min(max(low, 0.0), most), max(min(high, most), 0.0)


def _of_levels(
    features: Data | None, quantity: str, bound: Bound
) -> Iterator[tuple[float | None, _Value]]:
    """The values of a quantity of a response, level by level, as far as the limit is about it."""
    if features is None:
        yield bound.level_vpk, _Value(lack="no features were read")
        return
    levels = [
        level
        for level in features["levels"]
        if bound.level_vpk is None
        or (level["source_vpk"] is not None and _alike(level["source_vpk"], bound.level_vpk))
    ]
    if not levels:
        yield bound.level_vpk, _Value(lack="the response has no such source level")
    for level in levels:
        yield level["source_vpk"], _feature(level, quantity)


def _alike(one: float, other: float) -> bool:
    return math.isclose(one, other, rel_tol=_LEVELS_ALIKE)


def _feature(level: Data, quantity: str) -> _Value:
    which = quantity.partition("_")[0]
    names = ("arf", "rf") if which == "difference" else (which,)
    for name in names:
        if level[name] is None:
            said = [flag for flag in level["flags"] if flag.startswith((f"{name}:", "level:"))]
            return _Value(lack=said[0] if said else f"there is no {name.upper()}")
    feature = level[which] if which != "difference" else {}
    if quantity == "difference_hz":
        pair = level["difference_hz"] or {}
    elif quantity.endswith("_damping"):
        pair = level["damping_ratio"][which] or {}
    elif quantity.endswith("_gain_db"):
        pair = {"value": feature["gain_db"], "std": feature["gain_std_db"]}
    else:
        pair = {"value": feature["frequency_hz"], "std": feature["std_hz"]}
    jumps = [flag for flag in level["flags"] if flag.startswith(names) and _JUMP in flag]
    found = _uncertain(pair, "its uncertainty is not known")
    return replace(found, remark=jumps[0].partition(": ")[2]) if jumps else found


def _of_models(answer: Answer, estimate: Data | None, quantity: str) -> list[_Value]:
    """The values of a quantity of the unit, by every model that may be true."""
    if answer.state == "none":
        failed = (estimate or {}).get("failed")
        return [_Value(lack=f"no estimate: {failed}" if failed else "no estimate was made")]
    if not answer.models:
        call = "" if answer.diagnosed else "; diagnose it first"
        return [_Value(lack=f"no model is accepted: {answer.source.removesuffix(': none')}{call}")]
    name = "contribution_ratio" if quantity == "r" else quantity
    known = "the total backlash was taken as known; estimate it with --total-backlash-unknown"
    lack = known if quantity == "b_t_deg" else "it was not measured, but taken as known"
    values = []
    for model in answer.models:
        value = _uncertain(model.get(name) or {}, lack)
        total = model.get("b_t_deg") or {}
        if not value.lack and quantity != "b_t_deg" and not total.get("std"):
            value = replace(value, remark="with the total backlash of the unit file")
        values.append(value)
    return values


def _uncertain(number: Data, without: str) -> _Value:
    """A value with its uncertainty; the wider of standard error and stated 95 % interval counts."""
    value, std = number.get("value"), number.get("std")
    if value is None:
        return _Value(lack="it is not known")
    if std is None or not std > 0.0:
        return _Value(value, lack=without)
    u_low = u_high = std
    if number.get("interval95"):
        low, high = number["interval95"]
        u_low, u_high = max(std, (value - low) / _Z95), max(std, (high - value) / _Z95)
    return _Value(value, std, u_low, u_high)


def _cause(name: str, answer: Answer, diagnosis: Data | None) -> Item:
    """A cause that is not tolerated, by every model that may be true."""
    if diagnosis is None or not answer.diagnosed:
        return Item(_CAUSE, "UNDECIDED", cause=name, reason="no diagnosis was made")
    if not answer.models:
        return Item(_CAUSE, "UNDECIDED", cause=name, reason="no known cause explains the response")
    having = [name in model["causes"] for model in answer.models]
    if all(having):
        return Item(_CAUSE, "FAIL", cause=name)
    if any(having):
        return Item(_CAUSE, "UNDECIDED", cause=name, reason="some models that may be true have it")
    return Item(_CAUSE, "PASS", cause=name)
