"""How much arithmetic the steps of one lane are, and how much this machine can do.

Owns the count of additions, multiplications, divisions and comparisons in the
kernel's steps, made by watching its program being written, and the measured
limit of one core: fused multiply-adds on registers.
"""

from __future__ import annotations

import time
from collections import Counter
from typing import Any
from unittest.mock import patch

import numpy as np
from llvmlite import ir

from sim.engine.compiling import njit
from sim.engine.kernel import Program
from sim.engine.layout import STEPS_SEEN, Layout, Structure

_KINDS = {"fadd": "add or multiply", "fsub": "add or multiply", "fmul": "add or multiply",
          "fdiv": "divide", "fcmp_ordered": "compare"}  # fmt: skip

LANES = 64


SERVO = Structure(
    kinds=(0, 0, 1, 1),
    order=((0, 1), (2, 3)),
    turning=(True,) * 4 + (False,) * 3,
    heard=(True,) * 8 + (False,) * 2 + (True,) * 3,
    steady=False,
    single=False,
    loads=(-1,) * 4,
)
"""Of the paper's units: two plays, two frictions, four turning pairs of modes, and the filter's two
that only the output sees."""


def count_steps(structure: Structure) -> Counter[str]:
    """Operations of one lane from one look at the output to the next, `STEPS_SEEN` steps.

    In a kept cycle, where the laws are solved once.
    """
    tally: Counter[str] = Counter()

    class Counting(ir.IRBuilder):
        """Writes as the other does, and counts."""

        def call(self, function, *args, **kwargs):
            if "fma" in function.name:
                tally["add or multiply"] += 2
            return super().call(function, *args, **kwargs)

    for name, kind in _KINDS.items():
        setattr(Counting, name, _counted(getattr(ir.IRBuilder, name), kind, tally))
    counts: dict[str, Counter[str]] = {}

    class Watched(Program):
        """Notes what a step adds to the count, and a cycle: a step and a look at the output."""

        def _step(self, at: Any) -> None:
            before = tally.copy()
            super()._step(at)
            counts["step"] = tally - before

        def _cycle(self, number: Any) -> None:
            before = tally.copy()
            super()._cycle(number)
            counts["cycle"] = tally - before

    with patch.object(ir, "IRBuilder", Counting):
        Watched(Layout(structure), 1, 1, True, "")
    total = counts["cycle"]
    for _ in range(STEPS_SEEN - 1):
        total += counts["step"]
    return total


def _counted(plain, kind: str, tally: Counter[str]):
    def operate(self, *args, **kwargs):
        tally[kind] += 1
        return plain(self, *args, **kwargs)

    return operate


@njit(inline="always", fastmath={"contract"})
def _eight(a, f):
    a = (a * f + 1.0) * f + 1.0
    a = (a * f + 1.0) * f + 1.0
    a = (a * f + 1.0) * f + 1.0
    return (a * f + 1.0) * f + 1.0


@njit(cache=True, fastmath={"contract"})
def _multiply_add(x, f, rounds):
    for _ in range(rounds):
        for s in range(x.shape[1]):
            # Chains side by side: one alone would wait for itself.
            a, b, c, d = x[0, s], x[1, s], x[2, s], x[3, s]
            a, b, c, d = _eight(a, f), _eight(b, f), _eight(c, f), _eight(d, f)
            a, b, c, d = _eight(a, f), _eight(b, f), _eight(c, f), _eight(d, f)
            x[0, s], x[1, s], x[2, s], x[3, s] = a, b, c, d


def peak_flops(repeats: int = 9) -> float:
    """Floating-point operations a second of one core in fused multiply-adds, as measured."""
    x = np.ones((4, LANES))
    rounds, times = 50_000, []
    _multiply_add(x, 0.5, 1)
    for _ in range(repeats):
        began = time.process_time()
        _multiply_add(x, 0.5, rounds)
        times.append(time.process_time() - began)
    return rounds * x.size * 16 * 2 / min(times)
