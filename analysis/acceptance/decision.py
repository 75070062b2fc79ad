"""One value against one limit: the decision rule of ISO 14253-1 with guard bands.

Owns the rule. A value passes where the whole of value +- k u lies within the limits, fails
where the whole of it lies outside of one, and is undecided in between. It knows no servo.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal

__all__ = ["EXIT_CODES", "RULE", "Verdict", "combine", "decide", "false_pass_share", "reasons"]

Verdict = Literal["PASS", "FAIL", "UNDECIDED"]

RULE = "ISO 14253-1"
EXIT_CODES: Mapping[Verdict, int] = {"PASS": 0, "FAIL": 6, "UNDECIDED": 7}
"""Of a command that judges."""


def decide(
    low: float, high: float, lower: float | None = None, upper: float | None = None
) -> Verdict:
    """An uncertainty interval against a limit.

    Parameters
    ----------
    low, high
        Ends of value - k u and value + k u.
    lower, upper
        The limits, None where there is none; a value at a limit is within.
    """
    least = -math.inf if lower is None else lower
    most = math.inf if upper is None else upper
    if not low <= high:
        return "UNDECIDED"
    if least <= low and high <= most:
        return "PASS"
    if high < least or low > most:
        return "FAIL"
    return "UNDECIDED"


def combine(verdicts: Sequence[Verdict]) -> Verdict:
    """What several limits say together: the worst, FAIL before UNDECIDED before PASS.

    Nothing judged is undecided.
    """
    if "FAIL" in verdicts:
        return "FAIL"
    if not verdicts or "UNDECIDED" in verdicts:
        return "UNDECIDED"
    return "PASS"


def reasons(failed: Sequence[str], undecided: Sequence[str]) -> str:
    """What a verdict rests on, in words: the names of what failed, and of what is undecided."""
    told = [f"out of limits: {', '.join(failed)}"] if failed else []
    told += [f"undecided: {', '.join(undecided)}"] if undecided else []
    return "; ".join(told)


def false_pass_share(k: float) -> float:
    """Largest probability that a unit outside of one limit passes, with normal errors."""
    return 0.5 * math.erfc(k / math.sqrt(2.0))
