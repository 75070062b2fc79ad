"""Go or no-go: measured values against limits, by the decision rule of ISO 14253-1.

Owns the rule, the limits and what was decided. It measures and estimates nothing.
"""

from __future__ import annotations

from analysis.acceptance.decision import EXIT_CODES, Verdict, combine, decide, reasons
from analysis.acceptance.judgement import Item, Judgement, judge, judge_stages
from analysis.acceptance.limits import LimitSet, limits_of_stages, limits_of_unit, load_limits

__all__ = [
    "EXIT_CODES",
    "Item",
    "Judgement",
    "LimitSet",
    "Verdict",
    "combine",
    "decide",
    "judge",
    "judge_stages",
    "limits_of_stages",
    "limits_of_unit",
    "load_limits",
    "reasons",
]
