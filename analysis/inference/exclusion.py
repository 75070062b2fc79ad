"""What may be there beside what was found: a cause, and between which sizes it does not show.

Owns the record of it, as a document and in words for a person. It imports nothing heavy, so that a
screen may say it; the sizes are computed in `analysis.inference.posterior`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

__all__ = ["ExclusionLimit", "describe_unseen", "head_unseen", "list_unseen"]


@dataclass(frozen=True, slots=True)
class ExclusionLimit:
    """Between which sizes a cause may be there unseen, if no other is there but what is named.

    `parameter` is its first; the others may be anything. `low`, `high`: ends of the 95 % interval
    of its size, None where that is open on that side. Most causes are absent at zero and have a
    `high` alone; what may be off both ways is a datasheet value that lies amid its range.
    """

    effect: str
    parameter: str
    unit_symbol: str
    low: float | None
    high: float | None
    datasheet: float | None

    def to_json(self) -> dict[str, Any]:
        """One entry of ``unseen``."""
        return {
            "effect": self.effect,
            "parameter": self.parameter,
            "unit": self.unit_symbol,
            "low": self.low,
            "high": self.high,
            "datasheet": self.datasheet,
        }


def head_unseen(verdict: str) -> str:
    """What stands above the entries of ``unseen`` of a diagnosis with that verdict."""
    further = "" if verdict == "consistent" else "further "
    return f"sizes of {further}causes that this sweep cannot exclude, one cause at a time"


def list_unseen(entries: Sequence[Mapping[str, Any]]) -> list[str]:
    """The entries of ``unseen`` a line each, those that say something of their cause first."""
    silent = [one["effect"] for one in entries if one["low"] is None is one["high"]]
    told = [one for one in entries if one["effect"] not in silent]
    lines = [f"{one['effect']}: {describe_unseen(one)}" for one in told]
    return [*lines, f"no limit: {', '.join(silent)}"] if silent else lines


def describe_unseen(unseen: Mapping[str, Any]) -> str:
    """One entry of ``unseen`` in words for a person."""
    symbol = "" if unseen["unit"] == "1" else f" {unseen['unit']}"
    low, high = unseen["low"], unseen["high"]
    if low is not None and high is not None:
        size = f"{low:.3g} to {high:.3g}{symbol}"
    elif high is not None:
        size = f"below {high:.3g}{symbol}"
    elif low is not None:
        size = f"above {low:.3g}{symbol}"
    else:
        size = "of any size"
    known = unseen["datasheet"]
    said = "" if known is None else f" (datasheet {known:.4g})"
    return f"{unseen['parameter']} {size}{said}"
