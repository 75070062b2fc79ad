"""The inner loop of the engine: many steps of many lanes, written for one kind of system.

Owns the order of work in a step and the layout in memory; the numbers it is
given are the propagator's, the laws those of `sim.engine.laws`. For every structure
that occurs (which laws, how many coordinates, in which order they are solved)
it writes a program in which every coefficient has its place.

What takes time in a step is that laws wait for each other. Several vectors of
lanes at once, and laws that hardly feel each other side by side, fill these waits.
A single vector in double precision branches around what is seldom needed.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import ir
from numpy.typing import NDArray

from sim.engine import laws
from sim.engine.lanes import VECTOR_BYTES, Code, Lanes, greatest
from sim.engine.layout import HELD, PAIR, STEPS_SEEN, STRIBECK, SUMS, Layout, Structure
from sim.engine.machine_code import architecture, compiled, multiplies_and_adds
from sim.engine.system import SAMPLED, Law

__all__ = ["FIRST_SWEEPS", "MOST_VECTORS", "Program", "program_by", "step_cycles"]

MOST_VECTORS = 4
"""Vectors that one call steps at most: registers suffice for no more."""

_LAWS_BESIDE = 4 if VECTOR_BYTES == 64 else 2
"""Vectors whose laws are solved side by side: machines with narrower ones have half as many
registers, and what does not fit goes by way of memory."""

FIRST_SWEEPS = 8
"""How often laws are gone through in the first step, which knows no last forces to start from."""

_WAVES = 8
"""Numbers in a row of the table of waves: six, and room."""

_INT = ir.IntType(64)


def step_cycles(
    layout: Layout,
    coefficients: NDArray,
    lanes: NDArray,
    waves: NDArray,
    settle_cycles: int,
    kept_cycles: int,
) -> NDArray:
    """Step some vectors of lanes through settle and kept cycles.

    Parameters
    ----------
    layout
        Where what stands; every array has its precision.
    coefficients
        (systems, places), one row for each of the systems that lanes belong to.
    lanes
        (rows, lanes), 1, 2 or 4 vectors of them, made by `Layout.blank`; overwritten by how
        they end. Every system has as many vectors, its own side by side.
    waves
        (steps, 6): cosine and sine of harmonics 1 to 3 over a cycle, a multiple of
        `sim.engine.layout.STEPS_SEEN` of them.

    Returns
    -------
    ndarray
        (cycles, 7, lanes): the sum, then the products of the output with each
        column of `waves`, over those steps of each kept cycle at whose end it is looked at.
    """
    steps, count = len(waves), lanes.shape[1]
    table = layout.blank(steps, _WAVES)
    table[:, : waves.shape[1]] = waves
    sums = layout.blank(kept_cycles, SUMS, count)
    own = np.ascontiguousarray(coefficients, dtype=layout.dtype)
    program_by(Program, __file__, layout.structure, count // layout.width, len(own))(
        own.ctypes.data, lanes.ctypes.data, table.ctypes.data, steps, settle_cycles, kept_cycles,
        sums.ctypes.data,
    )  # fmt: skip
    return sums


@cache
def program_by(
    writer: type[Program], file: str, structure: Structure, vectors: int, systems: int = 1
) -> Any:
    """The program that a class writes, in machine code; `file` is where that class is."""
    can = multiplies_and_adds(), architecture()
    files = dict.fromkeys((Path(file).name, "kernel.py", "layout.py", "laws.py", "lanes.py"))
    return compiled(
        f"{writer.__name__} {structure} {vectors} {systems} {can}",
        [Path(__file__).with_name(name) for name in files],
        lambda: writer(Layout(structure), vectors, systems, *can).text(),
    )


class Program:
    """Writes the program of one structure, for some systems that have as many vectors each."""

    def __init__(
        self, layout: Layout, vectors: int, systems: int, fused: bool, architecture: str
    ) -> None:
        self._layout, self._structure = layout, layout.structure
        self._whole, self._steady = not layout.structure.turning, layout.structure.steady
        self._all, self._of_each = range(vectors), vectors // systems
        self._beside = [self._all[v : v + _LAWS_BESIDE] for v in self._all[::_LAWS_BESIDE]]
        self._module = ir.Module()
        scalar = ir.FloatType() if layout.structure.single else ir.DoubleType()
        pointer = scalar.as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [*[pointer] * 3, *[_INT] * 3, pointer])
        self._function = ir.Function(self._module, kind, "step")
        # What may lie where is not promised: the compiler would keep coefficients in whole
        # vectors and wait for these, where a number of its own for each use costs nothing.
        (self._coefficients, self._lanes, self._table, self._steps, settle, kept, self._sums) = (
            self._function.args
        )
        self._emit = ir.IRBuilder(self._function.append_basic_block())
        # A few lanes of double precision wait for each other, and hardly ever cross an end at once.
        branches = vectors == 1 and not layout.structure.single
        self._code = Code(self._module, self._emit, layout.structure.single, fused, branches)
        self._sweeps: Any = self._emit.alloca(_INT)
        # Aligns the stack with it: a vector that lies across two lines of the cache costs twice.
        self._sweeps.align = VECTOR_BYTES
        self._emit.store(_INT(FIRST_SWEEPS), self._sweeps)
        with self._code.without_denormals(architecture):
            self._run(settle, kept)
        self._emit.ret_void()

    def text(self) -> str:
        """The program in the compiler's own language."""
        return str(self._module)

    def _run(self, settle: Any, kept: Any) -> None:
        """All cycles."""
        with self._times(self._emit.add(settle, kept)) as cycle:
            self._cycle(self._emit.sub(cycle, settle))

    def _cycle(self, number: Any) -> None:
        """All steps of a cycle; the output is looked at if it is kept, one of number 0 or more."""
        kept = self._emit.icmp_signed(">=", number, _INT(0))
        with self._times(self._emit.sdiv(self._steps, _INT(STEPS_SEEN))) as share:
            first = self._emit.mul(share, _INT(STEPS_SEEN))
            with self._times(_INT(STEPS_SEEN)) as step:
                self._step(self._wave_at(self._emit.add(first, step)))
            with self._emit.if_then(kept):
                at = self._wave_at(self._emit.add(first, _INT(STEPS_SEEN - 1)))
                self._accumulate(at, self._output(at))
            self._look_anew()
        with self._emit.if_then(kept):
            self._hand_over(number)

    def _wave_at(self, step: Any) -> Any:
        """Where the waves at the end of a step stand."""
        following = self._emit.add(step, _INT(1))
        wraps = self._emit.icmp_signed("<", following, self._steps)
        return self._emit.mul(self._emit.select(wraps, following, _INT(0)), _INT(_WAVES))

    def _step(self, at: Any) -> None:
        free = self._turn(at)
        with self._times(self._emit.load(self._sweeps)):
            self._solve(free)
        self._emit.store(_INT(1), self._sweeps)
        self._see(free)

    def _turn(self, at: Any) -> list[Lanes]:
        """Coordinates go one step on; what laws would see at its end without any force.

        Vector by vector, as there is enough to do side by side within each.
        """
        p, m = self._layout.p, self._layout.m
        free: list[list[Any]] = [[] for _ in range(m)]
        for v in self._all:
            force = [self._load("force", j, [v]) for j in range(m)]
            seen = [self._driven(j, at, [v]) for j in range(m)]
            # Each feels where others were: what is new is written once all of these are read.
            before = {i: self._load("q", i, [v]) for i in range(p)} if self._whole else {}
            for first in range(0, p, 2):
                pair = range(first, min(first + 2, p))
                there_now = before or {i: self._load("q", i, [v]) for i in pair}
                for i in pair:
                    now = self._carried(i, pair, there_now, v)
                    if self._steady:
                        now = now + self._load("drift", i, [v])
                    for j in range(m):
                        now = self._take("push", i * m + j, [v]) * force[j] + now.lanes()
                    new = now.lanes()
                    self._store("q", i, new, [v])
                    if self._structure.heard[i]:
                        for j in range(m):
                            seen[j] = self._take("look", j * p + i, [v]) * new + seen[j]
            for j in range(m):
                free[j] += seen[j].vectors
        return [Lanes(self._code, of) for of in free]

    def _driven(self, j: int, at: Any, vectors: Sequence[int]) -> Lanes:
        """What the drive alone makes law j, or the output, see."""
        cosine, sine = (self._wave(at, k, vectors) for k in (0, 1))
        turning = self._load("waves", 3 * j, vectors) * sine
        there = self._load("waves", 3 * j + 1, vectors) * cosine + turning.lanes()
        return there + self._load("waves", 3 * j + 2, vectors) if self._steady else there

    def _carried(self, i: int, pair: range, before: dict[int, Lanes], v: int) -> Any:
        """Coordinate i a step later, by those that it feels and no force."""
        if self._whole:
            felt, row = range(self._layout.p), i * self._layout.p
        else:
            turns = self._structure.turning[i // 2] and len(pair) == 2
            felt, row = (pair if turns else range(i, i + 1)), 2 * i - pair[0]
        now: Any = None
        for k in felt:
            share = self._take("carry", row + k, [v]) * before[k]
            now = share if now is None else share + now.lanes()
        return now

    def _solve(self, free: list[Lanes]) -> None:
        """Forces of all laws, each with the newest ones of the others."""
        m = self._layout.m
        force = [[self._load("force", j, some) for j in range(m)] for some in self._beside]
        for group in self._structure.order:
            for i, some in enumerate(self._beside):
                without = [Lanes(self._code, (of.vectors[v] for v in some)) for of in free]
                force[i] = self._newest(group, without, force[i], some)
        for some, found in zip(self._beside, force, strict=True):
            for j, newest in enumerate(found):
                self._store("force", j, newest, some)

    def _newest(
        self, group: Sequence[int], free: list[Lanes], force: list[Lanes], some: Sequence[int]
    ) -> list[Lanes]:
        """Forces of all laws in some vectors, once those of a group are solved side by side."""
        m, kinds, newest = self._layout.m, self._structure.kinds, list(force)
        for j in group:
            together = [j, j + 1] if kinds[j] == PAIR else [j]
            others = [i for i in range(m) if i not in together]
            ahead = [self._felt(k, free[k], force, others, some) for k in together]
            newest[j : j + len(together)] = self._force(j, ahead, free, force, some)
        return newest

    def _force(
        self, j: int, ahead: list[Lanes], free: list[Lanes], last: list[Lanes], some: Sequence[int]
    ) -> Sequence[Lanes]:
        """The force of law j, or of a pair of them, in some vectors."""
        kind, m = self._structure.kinds[j], self._layout.m
        y0 = self._load("seen", j, some)
        if kind in SAMPLED:
            return [self._sampler(j, some).force(y0, ahead[0])]
        a, b, c = (lambda i=i: self._load("parameters", 3 * j + i, some) for i in range(3))
        fixed = [self._take("law", 7 * j + i, some) for i in range(7)]
        if kind == Law.PLAY:
            return [laws.play_force(y0, ahead[0], a(), b(), laws.PlayOverStep(*fixed))]
        beta, per_beta = fixed[:2]
        if kind == Law.FRICTION:
            return [laws.friction_force(y0, ahead[0], a(), b(), per_beta)]
        if kind in (STRIBECK, Law.LOADED):
            if kind == STRIBECK:
                w = ((beta * last[j] + ahead[0] + y0) * 0.5).lanes()
                most = laws.peaked_friction(w, a(), b(), c())
            else:
                i = self._structure.loads[j]
                ends = self._load("seen", i, some), self._felt(i, free[i], last, range(m), some)
                over_step = [self._take("law", 7 * i + k, some) for k in range(2)]
                most = abs(laws.transmitted(*ends, last[i], *over_step)) * b() + a()
            return [laws.friction_force(y0, ahead[0], most, (beta * most).lanes(), per_beta)]
        if kind == Law.EXCESS:
            return [laws.excess_force(y0 - b(), ahead[0] - b(), a())]
        if kind == Law.CUBIC:
            return [laws.cubic_force(y0, ahead[0], last[j], a(), beta)]
        pair = [self._take("gain", k * m + i, some) for k in (j, j + 1) for i in (j, j + 1)]
        return laws.cubic_pair(
            (y0, self._load("seen", j + 1, some)),
            (ahead[0], ahead[1]),
            (last[j], last[j + 1]),
            (a(), self._load("parameters", 3 * (j + 1), some)),
            laws.Coupling(*pair),
        )

    def _see(self, free: list[Lanes]) -> None:
        """What laws see at the end of the step."""
        m = self._layout.m
        force = [self._load("force", j, self._all) for j in range(m)]
        seen = [self._felt(j, there, force, range(m), self._all) for j, there in enumerate(free)]
        for j in self._layout.sampled:
            now = self._sampler(j, self._all).after(self._load("seen", j, self._all), seen[j])
            summed = self._load("held", self._held(j) + 4, self._all) + force[j]
            for i, kept in zip((0, 2, 3, 4), (*now, summed), strict=True):
                self._store("held", self._held(j) + i, kept, self._all)
        for j, there in enumerate(seen):
            self._store("seen", j, there, self._all)

    def _held(self, j: int) -> int:
        """The first of the rows in which sampled law j keeps what it holds."""
        return HELD * self._layout.sampled.index(j)

    def _sampler(self, j: int, some: Sequence[int]) -> laws.Sampler:
        kept = (self._load("held", self._held(j) + i, some) for i in range(4))
        numbers = (self._load("parameters", 3 * j + i, some) for i in range(3))
        kind = self._structure.kinds[j]
        return laws.Sampler(kind != Law.HOLD, kind == Law.COUNT_RATE, *kept, *numbers)

    def _output(self, at: Any) -> Lanes:
        """The output where the last step ended."""
        p, m = self._layout.p, self._layout.m
        seen = self._driven(m, at, self._all)
        for i in range(p):
            at_i = self._take("look", m * p + i, self._all)
            seen = at_i * self._load("q", i, self._all) + seen
        force = [self._load("force", j, self._all) for j in range(m)]
        for j in self._layout.sampled:
            # Seen now and then, steps would be seen late by half of the time between.
            summed = self._load("held", self._held(j) + 4, self._all)
            force[j] = (summed * (1.0 / STEPS_SEEN)).lanes()
        return self._felt(m, seen, force, range(m), self._all)

    def _look_anew(self) -> None:
        """Begin the sums of sampled laws anew, once the output was or could have been looked at."""
        for j in self._layout.sampled:
            zero = self._code.constant(0.0, len(self._all))
            self._store("held", self._held(j) + 4, zero, self._all)

    def _felt(
        self, j: int, free: Lanes, force: Sequence[Lanes], of: Sequence[int], some: Sequence[int]
    ) -> Lanes:
        """What law j, or the output, sees with the forces of some laws, in some vectors."""
        for k in of:
            free = self._take("gain", j * self._layout.m + k, some) * force[k] + free
        return free

    def _accumulate(self, at: Any, output: Lanes) -> None:
        """Add the output to the sums of its cycle, and keep its largest magnitude."""
        self._store("sums", 0, self._load("sums", 0, self._all) + output, self._all)
        for k in range(SUMS - 1):
            share = self._wave(at, k, self._all) * output
            self._store("sums", k + 1, share + self._load("sums", k + 1, self._all), self._all)
        largest = self._load("peak", 0, self._all)
        self._store("peak", 0, greatest(abs(output), largest), self._all)

    def _hand_over(self, cycle: Any) -> None:
        """Write the sums of a cycle where they are kept, and begin anew."""
        for k in range(SUMS):
            done = self._load("sums", k, self._all)
            row = self._emit.add(self._emit.mul(cycle, _INT(SUMS)), _INT(k))
            for v, vector in zip(self._all, done.vectors, strict=True):
                first = self._emit.add(self._emit.mul(row, _INT(len(self._all))), _INT(v))
                place = self._emit.mul(first, _INT(self._code.width))
                self._emit.store(vector, self._vector_at(self._sums, place), align=VECTOR_BYTES)
            self._store("sums", k, self._code.constant(0.0, len(self._all)), self._all)

    @contextmanager
    def _times(self, count: Any) -> Iterator[Any]:
        """A loop around what is emitted inside; yields its counter."""
        head = self._function.append_basic_block()
        body, done = (self._function.append_basic_block() for _ in range(2))
        before = self._emit.block
        self._emit.branch(head)
        self._emit.position_at_end(head)
        counter = self._emit.phi(_INT)
        counter.add_incoming(_INT(0), before)
        self._emit.cbranch(self._emit.icmp_signed("<", counter, count), body, done)
        self._emit.position_at_end(body)
        yield counter
        counter.add_incoming(self._emit.add(counter, _INT(1)), self._emit.block)
        self._emit.branch(head)
        self._emit.position_at_end(done)

    def _vector_at(self, base: Any, place: Any) -> Any:
        return self._emit.bitcast(self._emit.gep(base, [place]), self._code.vector.as_pointer())

    def _lane_row(self, name: str, i: int, v: int) -> Any:
        row = self._layout.lanes[name][i]
        place = (row * len(self._all) + v) * self._code.width
        return self._vector_at(self._lanes, _INT(place))

    def _load(self, name: str, i: int, vectors: Sequence[int]) -> Lanes:
        found = [self._emit.load(self._lane_row(name, i, v), align=VECTOR_BYTES) for v in vectors]
        return Lanes(self._code, found)

    def _store(self, name: str, i: int, value: Lanes, vectors: Sequence[int]) -> None:
        for v, vector in zip(vectors, value.vectors, strict=True):
            self._emit.store(vector, self._lane_row(name, i, v), align=VECTOR_BYTES)

    def _take(self, name: str, i: int, vectors: Sequence[int]) -> Lanes:
        """A coefficient in all lanes of some vectors."""
        first, places = self._layout.coefficients[name][i], self._layout.places
        # Asked for anew by every vector: it costs nothing, where a register to keep it does.
        found = [_INT(v // self._of_each * places + first) for v in vectors]
        loads = [self._emit.load(self._emit.gep(self._coefficients, [one])) for one in found]
        return Lanes(self._code, [self._code.everywhere(one) for one in loads])

    def _wave(self, at: Any, k: int, vectors: Sequence[int]) -> Lanes:
        """One wave of the table, the same in some vectors."""
        place = self._emit.gep(self._table, [self._emit.add(at, _INT(k))])
        return Lanes(self._code, [self._code.everywhere(self._emit.load(place))] * len(vectors))
