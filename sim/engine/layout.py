"""What the systems have in common that one program steps, and where what stands in its arrays.

Owns both descriptions; the program is the kernel's (`sim.engine.kernel`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sim.engine.lanes import VECTOR_BYTES
from sim.engine.system import SAMPLED

__all__ = ["HELD", "PAIR", "STEPS_SEEN", "STRIBECK", "SUMS", "Layout", "Structure"]

STRIBECK = 4
"""Kind of a friction that peaks at rest; the other kinds are those of `sim.engine.system.Law`."""

PAIR = 5
"""Kind of a hardening spring that is solved together with the law after it, another such spring."""

STEPS_SEEN = 4
"""The output is looked at after so many steps each time; what passed its filter moves slowly."""

HELD = 5
"""Numbers that a sampled law keeps: phase of its clock, offset of its counts, last count, value,
and the sum of its forces since the output was last looked at."""

SUMS = 7
"""Sums kept of every cycle; the largest magnitude of the output is kept over all."""


@dataclass(frozen=True, slots=True)
class Structure:
    """What systems have in common that one program steps.

    `kinds` (m,) of the laws; `order`: laws in the order in which each step solves
    them, those of one group side by side, with the newest forces of all others. `turning`: which
    pairs of coordinates turn into each other, the others decay alone; empty where each feels
    every other. `heard` (p,): which coordinates the laws see, or else the output alone.
    `steady`: whether anything constant acts. `single`: precision. `loads` (m,): number of the play
    that loads each friction of kind `Law.LOADED`, -1 of other laws.
    """

    kinds: tuple[int, ...]
    order: tuple[tuple[int, ...], ...]
    turning: tuple[bool, ...]
    heard: tuple[bool, ...]
    steady: bool
    single: bool
    loads: tuple[int, ...]


@dataclass(frozen=True)
class Layout:
    """Where what stands, m laws and p coordinates; every entry is a range of rows.

    Of lanes: `q` coordinates, `seen` what laws and output see at the start of a step,
    `force`, `drift` what is added to the coordinates in every step, `waves` sine,
    cosine and constant part of what the drive alone makes laws and output see,
    `parameters` three of each law, `held` five of each sampled law, `sums` and `peak` of the
    output so far.

    Of coefficients, which all lanes share: `carry` (p, 2 or p), `push` (p, m), `look`
    (m + 1, p), `gain` (m + 1, m): see `sim.engine.propagator.Propagator`; look and gain are what
    each law and, last, the output see of the coordinates and of the forces. `law` (m, 7): of a
    play what `sim.engine.laws.PlayOverStep` holds, of others beta and -1/beta.
    """

    structure: Structure

    @property
    def m(self) -> int:
        """Number of laws."""
        return len(self.structure.kinds)

    @property
    def sampled(self) -> tuple[int, ...]:
        """Numbers of the laws that a clock samples."""
        return tuple(j for j, kind in enumerate(self.structure.kinds) if kind in SAMPLED)

    @property
    def p(self) -> int:
        """Number of coordinates."""
        return len(self.structure.heard)

    @cached_property
    def lanes(self) -> dict[str, range]:
        """Rows of what every lane has."""
        m, p = self.m, self.p
        return _rows(q=p, seen=m + 1, force=m, drift=p, waves=3 * m + 3, parameters=3 * m,
                     held=HELD * len(self.sampled), sums=SUMS, peak=1)  # fmt: skip

    @cached_property
    def coefficients(self) -> dict[str, range]:
        """Places of what all share."""
        m, p = self.m, self.p
        across = 2 if self.structure.turning else p
        return _rows(carry=p * across, push=p * m, look=(m + 1) * p, gain=(m + 1) * m, law=7 * m)

    @property
    def places(self) -> int:
        """How many numbers all lanes of a system share."""
        return self.coefficients["law"].stop

    @property
    def dtype(self) -> type[np.floating]:
        """Of all arrays."""
        return np.float32 if self.structure.single else np.float64

    @property
    def width(self) -> int:
        """Lanes in a vector."""
        return VECTOR_BYTES // np.dtype(self.dtype).itemsize

    def blank(self, *shape: int) -> NDArray:
        """Zeros that begin where a vector may, and no vector lies across two lines of a cache."""
        size = np.dtype(self.dtype).itemsize
        store = np.zeros(int(np.prod(shape)) * size + VECTOR_BYTES, dtype=np.uint8)
        skip = -store.ctypes.data % VECTOR_BYTES
        whole = store[skip : skip + int(np.prod(shape)) * size].view(self.dtype)
        return whole.reshape(shape)


def _rows(**counts: int) -> dict[str, range]:
    found, at = {}, 0
    for name, count in counts.items():
        found[name] = range(at, at + count)
        at += count
    return found
