"""The reproduction of the paper: Table 2, its figures, the error index and section 5.

Owns which runs are made and what is held beside what. The paper's own scheme
(`sim.paper_scheme`) makes the numbers that the printed ones are judged by; the
exact engine repeats the same procedure to show what that scheme shifted. It
draws nothing itself and prints nothing.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.execution.blas import on_one_core
from analysis.execution.progress import Progress
from analysis.paper.index_curves import index_curves
from analysis.paper.published import PublishedRow, UnitName, load_paper
from analysis.paper.result import ReproductionNumbers
from analysis.paper.runs import exact_runs_db, grid_hz, paper_runs_db
from analysis.paper.section5 import section_5
from analysis.paper.table2 import ReproducedRow, compare, read_grid
from analysis.paper.text import summarise
from daq.errors import InputError

__all__ = ["Reproduction", "ReproducedRow", "reproduce"]


class Reproduction(ReproductionNumbers):
    """Everything that was recomputed, beside everything that was printed."""

    __slots__ = ()

    def summary(self) -> list[str]:
        """The result in lines of text for people."""
        return summarise(self)

    def plot(self, directory: Path | str) -> list[Path]:
        """Write Fig. 2, 3 and 4(e) as PNG files and return their paths."""
        from analysis.paper.figures import draw  # loads matplotlib

        return draw(self, Path(directory))


@on_one_core()
def reproduce(
    progress: Progress | None = None,
    seed: int = 0,
    *,
    paper_runs: int = 16,
    exact_runs: int = 12,
    rows: Sequence[tuple[UnitName, int]] | None = None,
) -> Reproduction:
    """Recompute the paper.

    Parameters
    ----------
    progress
        Called with the share done, 0 to 1, and what is being done.
    seed
        Seed of the starts.
    paper_runs, exact_runs
        Runs per frequency and row by the paper's scheme and by the exact engine.
    rows
        Rows of Table 2 as (unit, ratio in percent); all ten if not given.

    Raises
    ------
    InputError
        If Table 2 has none of the rows asked for, or fewer than two runs are asked for.
    """
    if min(paper_runs, exact_runs) < 2:
        raise InputError("reproduction: a spread needs 2 runs or more; ask for more runs")
    began = time.monotonic()
    paper = load_paper()
    wanted = [
        row for row in paper.simulated if rows is None or (row.unit, row.ratio_percent) in rows
    ]
    if not wanted:
        raise InputError(f"reproduction: Table 2 has no row {rows}; give (unit, percent)")
    units: list[UnitName] = list(dict.fromkeys(row.unit for row in wanted))
    done: list[ReproducedRow] = []
    for number, unit in enumerate(units):
        of_unit = [row for row in wanted if row.unit == unit]

        def tell(share: float, what: str, number: int = number) -> None:
            if progress is not None:
                progress((number + share) / len(units), what)

        done += _reproduce_unit(unit, of_unit, seed, (paper_runs, exact_runs), tell)
    return Reproduction(
        paper=paper,
        rows=tuple(done),
        index=tuple(
            index_curves(paper, unit, [r for r in done if r.published.unit == unit])
            for unit in units
        ),
        section_5=tuple(section_5(paper, unit) for unit in units),
        paper_runs=paper_runs,
        exact_runs=exact_runs,
        elapsed_s=time.monotonic() - began,
    )


def _reproduce_unit(
    unit: UnitName,
    rows: Sequence[PublishedRow],
    seed: int,
    runs: tuple[int, int],
    tell: Progress,
) -> list[ReproducedRow]:
    paper_db = []
    for number, row in enumerate(rows):
        tell(0.5 * number / len(rows), f"{unit} {row.ratio_percent} %, the paper's scheme")
        paper_db.append(paper_runs_db(unit, row.ratio_percent, runs[0], seed))
    exact_db = exact_runs_db(
        unit,
        [row.ratio_percent for row in rows],
        runs[1],
        seed,
        lambda share: tell(0.5 + 0.5 * share, f"{unit}, exact engine"),
    )
    return [_row(*of_row) for of_row in zip(rows, paper_db, exact_db, strict=True)]


def _row(
    row: PublishedRow, gain_db: NDArray[np.float64], exact_db: NDArray[np.float64]
) -> ReproducedRow:
    frequency_hz = grid_hz(row.unit)
    paper, exact = read_grid(frequency_hz, gain_db), read_grid(frequency_hz, exact_db)
    return ReproducedRow(
        published=row,
        frequency_hz=frequency_hz,
        gain_db=gain_db,
        exact_db=exact_db,
        arf=compare(row.arf_hz, row.arf_db, paper.arf_hz, paper.arf_db, exact.arf_hz, exact.arf_db),
        rf=compare(row.rf_hz, row.rf_db, paper.rf_hz, paper.rf_db, exact.rf_hz, exact.rf_db),
    )
