"""The error index over the ratios of Table 2, from the printed and from the computed features.

Owns the three curves per unit and their least points. The formula is in
`analysis.estimate.error_index`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.estimate.error_index import error_index
from analysis.paper.published import PaperNumbers, UnitName
from analysis.paper.table2 import ReproducedRow

__all__ = ["IndexCurve", "Index", "index_curves"]


@dataclass(frozen=True, slots=True)
class Index:
    """Error index against ratio; arrays of shape (ratios,), Hz.

    The standard error holds the spread of single simulated runs: the paper
    gives no error of its measurement.
    """

    hz: NDArray[np.float64]
    std_hz: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class IndexCurve:
    """Equation (21) for one unit.

    Parameters
    ----------
    unit
        The unit.
    ratio_percent
        Shape (ratios,).
    published
        From the printed simulated features: the paper's arithmetic.
    value, exact
        From the features computed by the paper's scheme and by the exact engine.
    """

    unit: UnitName
    ratio_percent: NDArray[np.int64]
    published: Index
    value: Index
    exact: Index

    def minimum(self, index: Index) -> tuple[int, float]:
        """Ratio (percent) and height (Hz) of the least index."""
        least = int(np.argmin(index.hz))
        return int(self.ratio_percent[least]), float(index.hz[least])

    def to_json(self) -> dict[str, Any]:
        """The minimum of the printed table, then all three curves with theirs."""
        ratio, height = self.minimum(self.published)
        document: dict[str, Any] = {"minimum_ratio_percent": ratio, "minimum_hz": height}
        document["ratio_percent"] = self.ratio_percent.tolist()
        for name in ("published", "value", "exact"):
            index: Index = getattr(self, name)
            ratio, height = self.minimum(index)
            document[name] = {
                "hz": index.hz.tolist(),
                "std_hz": index.std_hz.tolist(),
                "minimum_ratio_percent": ratio,
                "minimum_hz": height,
            }
        return document


def index_curves(paper: PaperNumbers, unit: UnitName, rows: Sequence[ReproducedRow]) -> IndexCurve:
    """Hold the rows of one unit against its measured features, equation (21)."""
    measured = paper.measured_row(unit)

    def index(arf: list[float], rf: list[float], arf_std: Any, rf_std: Any) -> Index:
        return Index(
            *error_index(
                arf,
                rf,
                measured.arf_hz,
                measured.rf_hz,
                arf_s_std_hz=arf_std,
                rf_s_std_hz=rf_std,
            )
        )

    return IndexCurve(
        unit=unit,
        ratio_percent=np.array([row.published.ratio_percent for row in rows], dtype=np.int64),
        published=index(
            [r.arf.published_hz for r in rows], [r.rf.published_hz for r in rows], 0, 0
        ),
        value=index(
            [r.arf.value_hz for r in rows],
            [r.rf.value_hz for r in rows],
            [r.arf.std_hz for r in rows],
            [r.rf.std_hz for r in rows],
        ),
        exact=index(
            [r.arf.exact_hz for r in rows],
            [r.rf.exact_hz for r in rows],
            [r.arf.exact_std_hz for r in rows],
            [r.rf.exact_std_hz for r in rows],
        ),
    )
