"""Lanes that come and go: dwells of any systems and frequencies, side by side in one block.

Owns which lane does what and when. Who has something to step asks as for `sim.engine.stepping`, and
gets the same to the last bit; each lane that is asked for is work of its own here, and a lane that
is done takes the next. It steps nothing and knows no numbers.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from typing import Generic, TypeVar

from numpy.typing import NDArray

from sim.engine.independent import Block, wave_table
from sim.engine.kernel import FIRST_SWEEPS
from sim.engine.lanes import VECTOR_BYTES
from sim.engine.layout import SUMS, Layout
from sim.engine.stepping import Asking, Stepped, Steps

__all__ = ["dealt_out", "goes_freely", "step_freely"]

T = TypeVar("T")

_VECTORS = 2
"""Of a block at most: coefficients of more do not fit beside each other into the nearest cache."""

_MOST_BLOCKS = 1 << 14
"""Blocks of steps before Python is back, whatever is done by then."""

_FULL = 0.5
"""Share of the lanes of shared vectors that are used, above which it does not pay to go freely:
sixteen machines of six levels (0.38) gained a third, of nine (0.56) lost a sixth."""


def goes_freely(lanes: int, systems: int, single: bool) -> bool:
    """Whether so many systems of so many lanes each are stepped faster by `step_freely`.

    Lanes that share their coefficients take less time where they fill their vectors.
    """
    width = VECTOR_BYTES // (4 if single else 8)
    return lanes <= _FULL * width * -(-lanes // width) and systems * lanes > width


def dealt_out(tasks: int, cores: int) -> list[list[int]]:
    """Numbers of tasks for each core: in turn, as those before take about as long."""
    return [list(range(first, tasks, cores)) for first in range(min(tasks, cores))]


def step_freely(askers: Iterable[Asking[T]]) -> list[T]:
    """Do what each asks for until all are done; what they return, in their order.

    Askers are begun when a lane is free for them: those that take long should come first.

    Raises
    ------
    Exception
        Whatever one of them raises; the others are left where they are.
    """
    desk = _Desk(askers)
    while (layout := desk.next_layout()) is not None:
        _step_all(layout, desk)
    return [value for _, value in sorted(desk.returned.items())]


class _Dwell:
    """What one asked for, and what came of it so far."""

    def __init__(self, asker: int, steps: Steps) -> None:
        self.asker, self.steps, self.left = asker, steps, steps.count
        self.stepped = Stepped.room(steps.layout, steps.kept_cycles, steps.count)


class _Lane:
    """One lane of a dwell."""

    def __init__(self, dwell: _Dwell, number: int) -> None:
        self.dwell, self.number = dwell, number
        self._sums = dwell.steps.layout.blank(dwell.steps.kept_cycles, SUMS)

    def load(self, block: Block, lane: int) -> None:
        """Begin in a lane of a block."""
        steps = self.dwell.steps
        rows = {name: known[:, self.number] for name, known in steps.lanes.items()}
        table = wave_table(steps.layout, steps.steps)
        block.load(lane, steps.coefficients, rows, table, steps.settle_cycles, self._sums)

    def end(self, rows: dict[str, NDArray]) -> bool:
        """Keep what came of it; whether the whole dwell is done."""
        stepped = self.dwell.stepped
        stepped.sums[..., self.number] = self._sums
        stepped.peak[self.number] = rows["peak"][0]
        stepped.q[:, self.number] = rows["q"]
        stepped.force[:, self.number] = rows["force"]
        stepped.held[:, self.number] = rows["held"]
        self.dwell.left -= 1
        return not self.dwell.left


class _Desk(Generic[T]):
    """Askers, what they wait for, and what they returned."""

    def __init__(self, askers: Iterable[Asking[T]]) -> None:
        self.returned: dict[int, T] = {}
        self._source: Iterator[tuple[int, Asking[T]]] = iter(enumerate(askers))
        self._asking: dict[int, Asking[T]] = {}
        self._waiting: dict[Layout, deque[_Lane]] = {}

    def next_layout(self) -> Layout | None:
        """Of what waits to be stepped; None if nothing is left to do."""
        while not self._waiting and self._begin():
            pass
        return next(iter(self._waiting), None)

    def next_lane(self, layout: Layout) -> _Lane | None:
        """One that waits for a lane of a layout; None if nobody does."""
        while layout not in self._waiting and self._begin():
            pass
        waiting = self._waiting.get(layout)
        if waiting is None:
            return None
        lane = waiting.popleft()
        if not waiting:
            del self._waiting[layout]
        return lane

    def answer(self, dwell: _Dwell) -> None:
        """Tell one what came of what it asked for, and hear what is next."""
        self._hear(dwell.asker, dwell.stepped)

    def _begin(self) -> bool:
        """Hear the next of the askers; whether there was one."""
        for i, asker in self._source:
            self._asking[i] = asker
            self._hear(i, None)
            return True
        return False

    def _hear(self, i: int, stepped: Stepped | None) -> None:
        asker = self._asking[i]
        try:
            steps = next(asker) if stepped is None else asker.send(stepped)
        except StopIteration as end:
            self.returned[i] = end.value
            del self._asking[i]
            return
        dwell = _Dwell(i, steps)
        lanes = (_Lane(dwell, number) for number in range(steps.count))
        self._waiting.setdefault(steps.layout, deque()).extend(lanes)


def _step_all(layout: Layout, desk: _Desk[T]) -> None:
    """Step all that waits for lanes of one layout, and what follows from it there."""
    block = Block(layout, _VECTORS)
    beginners = Block(layout, _VECTORS)
    busy: dict[int, _Lane] = {}
    while True:
        free = [lane for lane in range(block.count) if lane not in busy]
        begun: list[_Lane] = []
        while len(begun) < len(free) and (one := desk.next_lane(layout)) is not None:
            one.load(beginners, len(begun))
            begun.append(one)
        if begun:
            beginners.step(1, FIRST_SWEEPS)
            places = free[: len(begun)]
            block.take(places, beginners, range(len(begun)))
            busy.update(zip(places, begun, strict=True))
        if not busy:
            return
        if len(busy) <= layout.width < block.count:
            few = Block(layout, 1)
            few.take(range(len(busy)), block, list(busy))
            block, busy = few, dict(enumerate(busy.values()))
        done = block.step(_MOST_BLOCKS)
        block.leave(done)
        for lane in done:
            one = busy.pop(lane)
            if one.end(block.ended(lane)):
                desk.answer(one.dwell)
