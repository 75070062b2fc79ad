"""Judgement: resonances, damping, backlash, discrepancies, reports.

The third floor. It turns frequency responses into statements with error bars
and draws nothing on a terminal.
"""

__distribution__ = "lashbench"
"""Another distribution may bring a package of this name; `tui.entry` tells them apart."""

__all__ = [
    "advice",
    "answer",
    "diagnosis",
    "estimate",
    "paper",
    "paper_diagnosis",
    "report",
    "resonance",
    "response_figure",
    "trend",
]
"""The modules whose names others may rely on; docs/api.md lists them."""
