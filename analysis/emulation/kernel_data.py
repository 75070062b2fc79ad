"""The form in which runs and readings come to the compiled arithmetic of a fit.

Owns that form, and that all of it is compiled beforehand where a set-up asks for it. It
computes nothing (`analysis.emulation.kernels`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.kernels import BLUR, agree, log_shares, weigh

__all__ = ["Readings", "Runs", "compile_all"]


class Runs(NamedTuple):
    """Runs of one hypothesis; rows are those of an observation, k coordinates of its chart.

    `charted` (1 or rows, k, n): where they are, one for all rows where they are alike. `width`
    (k,). `enough`: weight of the runs that a regression takes; `most`: how many of the nearest take
    part, where every row has its own. `tailed`: see `analysis.emulation.kernels.solve_plane`.
    `plain` (3 len(plain_rows), n): what they show minus what was observed, at rows where all runs
    count; `mixed` (len(mixed_rows), 3, n): at the others, where they count as `alike` (rows, n)
    says; `values` (rows, 3, n): at all. `neighbours` (rows, 5): which rows of its level a scatter
    is smoothed over. `least` (3, rows): variance that is always there.
    """

    charted: NDArray[np.float64]
    width: NDArray[np.float64]
    enough: float
    most: int
    tailed: bool
    plain: NDArray[np.float32]
    plain_rows: NDArray[np.int64]
    mixed: NDArray[np.float32]
    mixed_rows: NDArray[np.int64]
    values: NDArray[np.float32]
    alike: NDArray[np.float64]
    neighbours: NDArray[np.int64]
    least: NDArray[np.float64]

    @staticmethod
    def smoothed_over(blocks: list[slice]) -> NDArray[np.int64]:
        """`neighbours` where levels are blocks of rows."""
        shifts = np.arange(len(BLUR)) - len(BLUR) // 2
        return np.concatenate(
            [np.clip(np.arange(b.start, b.stop)[:, None] + shifts, b.start, b.stop - 1)
             for b in blocks]
        )  # fmt: skip


class Readings(NamedTuple):
    """What was observed, and how it may lean on datasheet values.

    `observed` (3, rows): where anything was. `slopes` (k, 3 rows): what a deviation does;
    `sigmas` (k,): its standard deviation. `before`, `both` (n, rows): which runs did one
    row before as was observed, and there too; `prior` (rows,): how many are believed to
    (`analysis.emulation.regimes`).
    """

    observed: NDArray[np.bool_]
    slopes: NDArray[np.float64]
    sigmas: NDArray[np.float64]
    before: NDArray[np.float64]
    both: NDArray[np.float64]
    prior: NDArray[np.float64]


def compile_all() -> None:
    """Compile what is here, or load what was: seconds that a set-up may spend beforehand."""
    n, rows, k = 6, 4, 1
    line = np.linspace(-1.0, 1.0, n)[:, None]
    values, alike = np.zeros((rows, 3, n), np.float32), np.ones((rows, n))
    every, none = np.arange(rows), np.arange(0)
    runs = Runs(
        line.T[None].copy(), np.ones(k), 1.0, n, True, values.reshape(-1, n), every, values[:0],
        none, values, alike, Runs.smoothed_over([slice(0, rows)]), np.ones((3, rows)),
    )  # fmt: skip
    observed, many = np.ones((3, rows), bool), np.ones((2, 3 * rows))
    share = np.ones((n, rows))
    readings = Readings(observed, many, np.ones(2), share, share, np.ones(rows))
    agree(runs, readings, line[None, None, 0], observed[0], True)
    weigh(np.ones(n), 1.0)
    log_shares(share[:, 0].copy(), share, share, np.ones(rows))
