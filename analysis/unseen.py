"""What may be there though nothing was found: a cause, and between which sizes it does not show.

Owns the record of it, as a document and in words for a person. It imports nothing heavy, so that a
screen may say it; the sizes are computed in `analysis.bounds`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

__all__ = ["Unseen", "describe_unseen"]


@dataclass(frozen=True, slots=True)
class Unseen:
    """Between which sizes a cause may be there unseen, if it is the only one.

    `parameter` is its first; the others may be anything. `low`, `high`: the nearest sizes that are
    ruled out, None where none is on that side. Most causes are absent at zero and have a `high`
    alone; what may be off both ways is a datasheet value that lies amid its range.
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
