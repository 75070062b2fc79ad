"""The parts of a report that make it a certificate: what limits say of the unit.

Owns their wording and order. Like the other sections it reads nothing but the document.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from analysis.acceptance.judgement import Judgement
from analysis.report.html import Markup, element, table

__all__ = ["judgement_section"]

Data = Mapping[str, Any]


def judgement_section(judgement: Judgement | None) -> Markup:
    """The verdict, each limit with the value and its guard band, and the decision rule."""
    if judgement is None:
        return Markup("")
    rows = [
        (item.name, item.measured, _guarded(item.to_json()["guarded"]), item.limit,
         f"{item.verdict}{f': {item.reason}' if item.reason else ''}")
        for item in judgement.items
    ]  # fmt: skip
    head = ("quantity", "value", "with guard band", "limit", "decision")
    return element(
        "section",
        element("h2", "Conformity"),
        element(
            "p",
            element("b", judgement.verdict, class_=f"verdict {judgement.verdict.lower()}"),
            f" by limits {judgement.limits.name}.",
        ),
        table(rows, head),
        element("p", f"Decision rule: {judgement.rule}.", class_="small"),
    )


def _guarded(span: Any) -> str:
    return "-" if span is None else f"{span[0]:.4g} to {span[1]:.4g}"
