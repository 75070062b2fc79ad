"""Stretches that are stepped, and systems that are stepped in one call.

Owns what the engine asks of the kernel and what it gets: who has something to step asks for it by
yielding `Steps`, and is sent `Stepped`. What several ask for at a time is done at once where one
program steps it: laws wait for each other, and twice as many vectors fill these waits. Nothing
that anybody gets depends on who else asked.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sim.engine.kernel import MOST_VECTORS, step_cycles
from sim.engine.lanes import VECTOR_BYTES
from sim.engine.layout import SUMS, Layout

__all__ = ["Asking", "Stepped", "Steps", "shared_out", "step_together"]

T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """Lanes of one system, and so many steps a cycle, settle cycles and kept cycles.

    `coefficients` (places,); `lanes` (rows, lanes) by name: see `sim.engine.layout.Layout`.
    """

    layout: Layout
    coefficients: NDArray[np.float64]
    lanes: dict[str, NDArray[np.float64]]
    steps: int
    settle_cycles: int
    kept_cycles: int

    @property
    def count(self) -> int:
        """Lanes."""
        return self.lanes["q"].shape[1]

    @property
    def vectors(self) -> int:
        """Vectors that they fill, the last of them perhaps in part."""
        return -(-self.count // self.layout.width)

    @property
    def goes_with(self) -> tuple[object, ...]:
        """Whoever has the same may be stepped in one call."""
        dwell = self.steps, self.settle_cycles, self.kept_cycles
        return self.layout.structure, self.vectors, *dwell


@dataclass(frozen=True, slots=True, eq=False)
class Stepped:
    """What came of it.

    `sums` (cycles, 7, lanes): see `sim.engine.kernel.step_cycles`; `peak` (lanes,): largest
    magnitude of the output; `q` (p, lanes), `force` (m, lanes), `held` (5 per sampled law, lanes):
    how the lanes end.
    """

    sums: NDArray[np.float64]
    peak: NDArray[np.float64]
    q: NDArray[np.float64]
    force: NDArray[np.float64]
    held: NDArray[np.float64]

    @classmethod
    def room(cls, layout: Layout, cycles: int, count: int) -> Stepped:
        """Room for what comes of so many kept cycles and lanes."""
        rows = {name: len(layout.lanes[name]) for name in ("q", "force", "held")}
        return cls(
            np.empty((cycles, SUMS, count)),
            np.empty(count),
            *(np.empty((rows[name], count)) for name in rows),
        )


Asking = Generator[Steps, Stepped, T]


def step_together(askers: Sequence[Asking[T]]) -> list[T]:
    """Do what each asks for until all are done; what they return, in their order.

    Raises
    ------
    Exception
        Whatever one of them raises; the others are left where they are.
    """
    returned: dict[int, T] = {}
    asked: dict[int, Steps] = {}

    def go_on(i: int, hear: Callable[[], Steps]) -> None:
        try:
            asked[i] = hear()
        except StopIteration as end:
            returned[i] = end.value

    for i, one in enumerate(askers):
        go_on(i, partial(next, one))
    while asked:
        for lot in _lots(asked):
            for i, stepped in zip(lot, _step([asked.pop(i) for i in lot]), strict=True):
                go_on(i, partial(askers[i].send, stepped))
    return [returned[i] for i in range(len(askers))]


def shared_out(
    kinds: Sequence[Hashable], cores: int, lanes: int, single: bool = True
) -> list[list[int]]:
    """Lots of systems to step together, by their numbers, of so many `lanes` each.

    Those of one kind are kept together, as one program may step them. Two take less than twice as
    long as one, but longer: what is left after whole rounds is shared out among all cores.
    """
    vectors = -(-lanes // (VECTOR_BYTES // (4 if single else 8)))
    together = _together(vectors)
    alike: dict[Hashable, list[int]] = {}
    for i, kind in enumerate(kinds):
        alike.setdefault(kind, []).append(i)
    lots, rest = [], []
    for members in alike.values():
        whole = len(members) - len(members) % together
        lots += _cut(members[:whole], whole // together)
        rest += members[whole:]
    lots += _cut(rest, -(-len(rest) // together))
    rounds = len(lots) - len(lots) % cores
    left = [i for lot in lots[rounds:] for i in lot]
    return lots[:rounds] + _cut(left, min(cores, len(left)))


def _together(vectors: int) -> int:
    """Systems of so many vectors that one call steps at most; a large one takes several calls."""
    return max(MOST_VECTORS // vectors, 1)


def _cut(members: list[int], count: int) -> list[list[int]]:
    """So many lots of about the same size."""
    ends = [len(members) * i // count for i in range(count + 1)] if count else []
    return [members[first:last] for first, last in pairwise(ends)]


def _lots(asked: Mapping[int, Steps]) -> list[list[int]]:
    """Who is stepped in one call: as many as registers suffice for."""
    alike: dict[tuple[object, ...], list[int]] = {}
    for i, steps in asked.items():
        alike.setdefault(steps.goes_with, []).append(i)
    lots = []
    for members in alike.values():
        vectors = asked[members[0]].vectors
        while members:
            most = min(_together(vectors), len(members))
            taken = 1 << (most.bit_length() - 1)
            lots.append(members[:taken])
            members = members[taken:]
    return lots


def _step(lot: Sequence[Steps]) -> list[Stepped]:
    """What comes of those that one program steps."""
    layout, cycles = lot[0].layout, lot[0].kept_cycles
    rows = {name: slice(at.start, at.stop) for name, at in layout.lanes.items()}
    done = [Stepped.room(layout, cycles, one.count) for one in lot]
    for call in _calls(lot):
        block = layout.blank(rows["peak"].stop, sum(of.size for of in call.values()))
        own, at = {}, 0
        for i, of in call.items():
            own[i] = slice(at, at := at + of.size)
            for name, known in lot[i].lanes.items():
                block[rows[name], own[i]] = known[:, of]
        coefficients = np.stack([lot[i].coefficients for i in call])
        waves = _waves(lot[0].steps)
        sums = step_cycles(layout, coefficients, block, waves, lot[0].settle_cycles, cycles)
        for i, of in call.items():
            # Lanes that are repeated end alike, and are written twice.
            done[i].sums[..., of] = sums[..., own[i]]
            done[i].peak[of] = block[rows["peak"].start, own[i]]
            done[i].q[:, of] = block[rows["q"], own[i]]
            done[i].force[:, of] = block[rows["force"], own[i]]
            done[i].held[:, of] = block[rows["held"], own[i]]
    return done


def _calls(lot: Sequence[Steps]) -> Iterator[dict[int, NDArray[np.intp]]]:
    """Lanes of each call by whose they are: of all together, or four vectors of one at a time.

    What is left of one goes in two and one. A vector that is not full repeats lanes: idle ones of
    zeros would run into denormals.
    """
    width = lot[0].layout.width
    if len(lot) > 1:
        yield {i: np.resize(np.arange(one.count), one.vectors * width) for i, one in enumerate(lot)}
        return
    (one,) = lot
    at, vectors = 0, one.vectors
    while vectors:
        taken = min(MOST_VECTORS, 1 << (vectors.bit_length() - 1))
        lanes = np.arange(at, min(at + taken * width, one.count))
        yield {0: np.resize(lanes, taken * width)}
        at, vectors = at + taken * width, vectors - taken


@lru_cache(maxsize=256)
def _waves(steps: int) -> NDArray[np.float64]:
    """(steps, 6): cosine and sine of harmonics 1 to 3 over a cycle."""
    angle = 2.0 * np.pi * np.arange(steps) / steps
    return np.stack([wave(k * angle) for k in (1, 2, 3) for wave in (np.cos, np.sin)], axis=1)
