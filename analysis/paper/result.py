"""What a reproduction of the paper found: the rows of Table 2 and the numbers beside them.

Owns the record and its document. It computes nothing, and has no words and no pictures:
`analysis.paper.text` and `analysis.paper.figures` take what is here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from analysis.paper.index_curves import IndexCurve
from analysis.paper.published import PaperNumbers, UnitName
from analysis.paper.section5 import Section5
from analysis.paper.table2 import ReproducedRow


@dataclass(frozen=True, slots=True)
class ReproductionNumbers:
    """Everything that was recomputed, beside everything that was printed."""

    paper: PaperNumbers
    rows: tuple[ReproducedRow, ...]
    index: tuple[IndexCurve, ...]
    section_5: tuple[Section5, ...]
    paper_runs: int
    exact_runs: int
    elapsed_s: float

    def of_unit(self, unit: UnitName) -> tuple[ReproducedRow, ...]:
        """The rows of one unit, in the order of Table 2."""
        return tuple(row for row in self.rows if row.published.unit == unit)

    def to_json(self) -> dict[str, Any]:
        """The document of ``reproduce --json``."""
        return {
            "table2": [
                {
                    "unit": row.published.unit,
                    "ratio_percent": row.published.ratio_percent,
                    "arf": row.arf.to_json(),
                    "rf": row.rf.to_json(),
                    "flags": row.flags,
                }
                for row in self.rows
            ],
            "error_index": {curve.unit: curve.to_json() for curve in self.index},
            "damping": {part.unit: part.to_json() for part in self.section_5},
            "paper_runs": self.paper_runs,
            "exact_runs": self.exact_runs,
            "elapsed_s": self.elapsed_s,
        }
