"""The inner loop of the engine for lanes that share nothing: system, step and drive are a lane's.

Owns the layout of such lanes in memory and when the program hands a cycle over. The step itself is
that of `sim.engine.kernel`, number by number: what a lane gives does not depend on which of the
two stepped it. It schedules nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from llvmlite import ir
from numpy.typing import NDArray

from sim.engine.kernel import Program, program_by
from sim.engine.lanes import VECTOR_BYTES, Lanes
from sim.engine.layout import STEPS_SEEN, SUMS, Layout

__all__ = ["Block", "wave_table"]

_AT, _LEFT, _BLOCKS, _CYCLE, _KEPT, _SUMS, _TABLE = range(_CONTROLS := 7)
"""Rows of what controls a lane: address of its waves now, blocks of `STEPS_SEEN` steps left in its
cycle and in a whole one, number of the cycle (negative ones settle), number of those that are
kept, and the addresses of their sums and of the waves from the start of a cycle."""

_ROW = 16
"""Numbers for a block in a table of waves: cosine and sine for each step, and at its end
those of all harmonics; the rest is room."""

_IDLE = -(1 << 40)
"""Number of the cycle of a lane without work."""

_INT = ir.IntType(64)


@lru_cache(maxsize=256)
def wave_table(layout: Layout, steps: int) -> NDArray:
    """(blocks, 16) waves over a cycle of so many steps, at the ends of steps."""
    ends = np.arange(1, steps + 1)
    ends[-1] = 0
    angle = 2.0 * np.pi * ends / steps
    table = layout.blank(steps // STEPS_SEEN, _ROW)
    table[:, 0 : 2 * STEPS_SEEN : 2] = np.cos(angle).reshape(-1, STEPS_SEEN)
    table[:, 1 : 2 * STEPS_SEEN : 2] = np.sin(angle).reshape(-1, STEPS_SEEN)
    seen = angle[STEPS_SEEN - 1 :: STEPS_SEEN]
    waves = [wave(k * seen) for k in (1, 2, 3) for wave in (np.cos, np.sin)]
    table[:, 2 * STEPS_SEEN : 2 * STEPS_SEEN + SUMS - 1] = np.stack(waves, axis=1)
    return table


class Block:
    """Some vectors of lanes that are stepped side by side, each as its own work says.

    Parameters
    ----------
    layout
        Where what stands in a lane; the coefficients of each lane are a column as well.
    vectors
        1, 2 or 4 of them.
    """

    def __init__(self, layout: Layout, vectors: int) -> None:
        self.layout, self.count = layout, vectors * layout.width
        self._rows = {name: slice(at.start, at.stop) for name, at in layout.lanes.items()}
        self._lanes = layout.blank(layout.lanes["peak"].stop, self.count)
        self._coefficients = layout.blank(layout.places, self.count)
        self._control = np.zeros((_CONTROLS, self.count), dtype=np.int64)
        self._control[_CYCLE] = _IDLE
        # What lanes without work write.
        self._scratch = layout.blank(1, SUMS)
        # What the addresses of each lane lead to; a lane without work goes round its last table.
        self._reached: list[tuple[NDArray, ...]] = [()] * self.count
        self._step = program_by(_Independent, __file__, layout.structure, vectors)

    def load(
        self,
        lane: int,
        coefficients: NDArray,
        rows: dict[str, NDArray],
        table: NDArray,
        settle_cycles: int,
        sums: NDArray,
    ) -> None:
        """Give a lane work; (cycles, 7) `sums` are what it fills, `table` are its waves."""
        self._lanes[:, lane] = 0.0
        for name, known in rows.items():
            self._lanes[self._rows[name], lane] = known
        self._coefficients[:, lane] = coefficients
        where, blocks = table.ctypes.data, len(table)
        self._control[:, lane] = (
            where, blocks, blocks, -settle_cycles, len(sums), sums.ctypes.data, where,
        )  # fmt: skip
        self._reached[lane] = table, sums

    def take(self, lanes: Sequence[int], other: Block, theirs: Sequence[int]) -> None:
        """Go on with lanes of another block."""
        self._lanes[:, lanes] = other._lanes[:, theirs]
        self._coefficients[:, lanes] = other._coefficients[:, theirs]
        self._control[:, lanes] = other._control[:, theirs]
        for lane, of in zip(lanes, theirs, strict=True):
            self._reached[lane] = other._reached[of]

    def leave(self, lanes: Sequence[int]) -> None:
        """Lanes that have no work any more: they go on, and nobody looks at them."""
        self._control[_CYCLE, lanes] = _IDLE
        self._control[_SUMS, lanes] = self._scratch.ctypes.data

    def step(self, most_blocks: int, sweeps: int = 1) -> list[int]:
        """Step until a lane is done, or for so many blocks; the lanes that are done.

        `sweeps`: how often laws are gone through in the first step.
        """
        idle = [i for i, reached in enumerate(self._reached) if not reached]
        if idle:
            # Lanes of zeros would run into denormals, and have no waves.
            some = next(i for i, reached in enumerate(self._reached) if reached)
            self.take(idle, self, [some] * len(idle))
            self.leave(idle)
        self._step(
            self._coefficients.ctypes.data, self._lanes.ctypes.data, self._control.ctypes.data,
            most_blocks, sweeps, 0, None,
        )  # fmt: skip
        return np.flatnonzero(self._control[_CYCLE] == self._control[_KEPT]).tolist()

    def ended(self, lane: int) -> dict[str, NDArray]:
        """Rows of a lane as it ended, as copies, by name."""
        column = self._lanes[:, lane].astype(float)
        return {name: column[rows] for name, rows in self._rows.items()}


class _Independent(Program):
    """Writes the program of one structure, for vectors of lanes that share nothing.

    The program's arguments are those of `Program`, but for the control in place of the waves, the
    most blocks in place of the steps and the first sweeps in place of the settle cycles.
    """

    def _run(self, settle: Any, kept: Any) -> None:
        emit = self._emit
        self._control = emit.bitcast(self._table, _INT.as_pointer())
        self._lane_count = len(self._all) * self._code.width
        self._run_left, self._until, self._done = (emit.alloca(_INT) for _ in range(3))
        emit.store(settle, self._sweeps)
        emit.store(self._steps, self._run_left)
        head, body, out = (self._function.append_basic_block() for _ in range(3))
        emit.branch(head)
        emit.position_at_end(head)
        emit.store(_INT(0), self._done)
        self._plan()
        emit.branch(body)
        emit.position_at_end(body)
        with self._times(emit.load(self._until)) as block:
            self._block(emit.mul(block, _INT(_ROW * self._code.bytes)))
        left = emit.sub(emit.load(self._run_left), emit.load(self._until))
        emit.store(left, self._run_left)
        with self._times(_INT(self._lane_count)) as lane:
            self._go_on(lane)
        nothing = emit.icmp_signed("==", emit.load(self._done), _INT(0))
        more = emit.and_(nothing, emit.icmp_signed(">", left, _INT(0)))
        emit.cbranch(more, head, out)
        emit.position_at_end(out)

    def _plan(self) -> None:
        """How many blocks there are until some lane's cycle ends."""
        emit = self._emit
        emit.store(emit.load(self._run_left), self._until)
        with self._times(_INT(self._lane_count)) as lane:
            left, most = emit.load(self._word(_LEFT, lane)), emit.load(self._until)
            fewer = emit.select(emit.icmp_signed("<", left, most), left, most)
            emit.store(fewer, self._until)

    def _block(self, offset: Any) -> None:
        """Steps until the output is looked at, so many bytes from where the lanes' waves are."""
        emit, size = self._emit, self._code.bytes
        with self._times(_INT(STEPS_SEEN)) as step:
            further = emit.add(offset, emit.mul(step, _INT(2 * size)))
            self._step(self._own_waves(further, 2))
        at = self._own_waves(emit.add(offset, _INT(2 * STEPS_SEEN * size)), SUMS - 1)
        self._accumulate(at, self._output(at))
        self._look_anew()

    def _go_on(self, lane: Any) -> None:
        """What a lane does when all have made the same number of blocks."""
        emit, until = self._emit, self._emit.load(self._until)
        way = emit.mul(until, _INT(_ROW * self._code.bytes))
        left = emit.sub(emit.load(self._word(_LEFT, lane)), until)
        emit.store(left, self._word(_LEFT, lane))
        at = emit.add(emit.load(self._word(_AT, lane)), way)
        emit.store(at, self._word(_AT, lane))
        with emit.if_then(emit.icmp_signed("==", left, _INT(0))):
            self._end_cycle(lane)

    def _end_cycle(self, lane: Any) -> None:
        """Hand the sums of a lane over; those of cycles that settle are written over."""
        emit, code = self._emit, self._code
        emit.store(emit.load(self._word(_BLOCKS, lane)), self._word(_LEFT, lane))
        emit.store(emit.load(self._word(_TABLE, lane)), self._word(_AT, lane))
        cycle = emit.load(self._word(_CYCLE, lane))
        settles = emit.icmp_signed("<", cycle, _INT(0))
        row = emit.mul(emit.select(settles, _INT(0), cycle), _INT(SUMS * code.bytes))
        to = emit.add(emit.load(self._word(_SUMS, lane)), row)
        zero = ir.Constant(code.scalar, 0.0)
        for k in range(SUMS):
            place = self._scalar("sums", k, lane)
            emit.store(emit.load(place), self._pointer(emit.add(to, _INT(k * code.bytes))))
            emit.store(zero, place)
        with emit.if_then(settles):
            emit.store(zero, self._scalar("peak", 0, lane))
        following = emit.add(cycle, _INT(1))
        emit.store(following, self._word(_CYCLE, lane))
        done = emit.icmp_signed("==", following, emit.load(self._word(_KEPT, lane)))
        with emit.if_then(done):
            emit.store(_INT(1), self._done)

    def _word(self, row: int, lane: Any) -> Any:
        """Where a control of a lane stands."""
        place = self._emit.add(_INT(row * self._lane_count), lane)
        return self._emit.gep(self._control, [place])

    def _scalar(self, name: str, i: int, lane: Any) -> Any:
        """Where a number of a lane stands."""
        row = _INT(self._layout.lanes[name][i] * self._lane_count)
        return self._emit.gep(self._lanes, [self._emit.add(row, lane)])

    def _pointer(self, address: Any) -> Any:
        return self._emit.inttoptr(address, self._code.scalar.as_pointer())

    def _own_waves(self, offset: Any, count: int) -> list[Lanes]:
        """The first of the waves so many bytes from where each lane's are."""
        emit, code = self._emit, self._code
        waves: list[list[Any]] = [[] for _ in range(count)]
        for v in self._all:
            vectors: list[Any] = [ir.Constant(code.vector, ir.Undefined)] * count
            for i in range(code.width):
                word = self._word(_AT, _INT(v * code.width + i))
                place = self._pointer(emit.add(emit.load(word), offset))
                for k in range(count):
                    number = emit.load(emit.gep(place, [_INT(k)]))
                    vectors[k] = emit.insert_element(vectors[k], number, ir.IntType(32)(i))
            for k in range(count):
                waves[k].append(vectors[k])
        return [Lanes(code, some) for some in waves]

    def _wave(self, at: Any, k: int, vectors: Sequence[int]) -> Lanes:
        return Lanes(self._code, [at[k].vectors[v] for v in vectors])

    def _take(self, name: str, i: int, vectors: Sequence[int]) -> Lanes:
        place = self._layout.coefficients[name][i]
        own = [_INT((place * len(self._all) + v) * self._code.width) for v in vectors]
        at = [self._vector_at(self._coefficients, one) for one in own]
        found = [self._emit.load(one, align=VECTOR_BYTES) for one in at]
        return Lanes(self._code, found)
