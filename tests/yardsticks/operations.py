"""How much arithmetic one step of one lane is, and how much this machine can do.

Owns the count of additions, multiplications, divisions and comparisons in the
kernel's step, made by running its own parts on numbers that count, and the
measured limit of one core: fused multiply-adds on registers.
"""

from __future__ import annotations

import time
from collections import Counter
from unittest.mock import patch

import numpy as np

from sim import kernel
from sim.assembly import Law
from sim.compiling import njit


class Counted(float):
    """A number that counts what is done with it, in `tally`."""

    tally: Counter[str] = Counter()


def _counting(name: str, kind: str):
    plain = getattr(float, name)

    def operate(self, *others):
        Counted.tally[kind] += 1
        done = plain(self, *others)
        return Counted(done) if isinstance(done, float) else done

    return operate


for _name in ("add", "radd", "sub", "rsub", "mul", "rmul"):
    setattr(Counted, f"__{_name}__", _counting(f"__{_name}__", "add or multiply"))
for _name in ("truediv", "rtruediv"):
    setattr(Counted, f"__{_name}__", _counting(f"__{_name}__", "divide"))
for _name in ("lt", "gt", "le", "ge", "eq", "ne"):
    setattr(Counted, f"__{_name}__", _counting(f"__{_name}__", "compare"))


def _numbers(*shape: int) -> np.ndarray:
    drawn = np.random.default_rng(0).uniform(0.5, 1.5, shape)
    return np.array([Counted(v) for v in drawn.ravel()], dtype=object).reshape(shape)


def count_step(kinds: list[int], coordinates: int) -> Counter[str]:
    """Operations of one kept step of one lane, where each law is solved once."""
    m = len(kinds)
    f = m + -m % kernel.FORCES_AT_ONCE
    wide = max(coordinates, kernel.ROWS_AT_ONCE)
    q, force, free = _numbers(wide, 1), _numbers(f, 1), _numbers(m + 1, 1)
    gain, y = _numbers(m + 1, f), _numbers(m + 1, 1)
    Counted.tally = Counter()
    # What a part calls is compiled as well, and would not count.
    with patch.object(kernel, "_push_further", kernel._push_further.py_func):
        push, drift = _numbers(coordinates, f), _numbers(coordinates, 1)
        kernel._turn.py_func(_numbers(coordinates, 2), push, drift, q, force, 1)
    look, waves = _numbers(m + 1, wide), _numbers(3 * m + 3, 1)
    kernel._look.py_func(look, m + 1, waves, Counted(0.5), Counted(0.5), q, free, 1)
    for j, kind in enumerate(kinds):
        kernel._feel.py_func(gain, j, force, free, y, 0, 1)
        _count_law(kind)
    for j in range(m + 1):
        kernel._feel.py_func(gain, j, force, free, y, j, 1)
    kernel._accumulate.py_func(_numbers(1, 6), 0, y, m, _numbers(8, 1), 1)
    return Counted.tally


def _count_law(kind: int) -> None:
    a, b, c, d, e, f = (Counted(v) for v in (0.3, 0.4, 1.0, -0.2, 0.1, -0.3))
    if kind == Law.PLAY:
        kernel.play_force.py_func(a, b, c, d, e, f)
    elif kind == Law.FRICTION:
        kernel.friction_force.py_func(a, b, c, f)
    else:
        raise ValueError(f"no count for a law of kind {kind}")


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
    x = np.ones((4, kernel.MOST_LANES))
    rounds, times = 50_000, []
    _multiply_add(x, 0.5, 1)
    for _ in range(repeats):
        began = time.process_time()
        _multiply_add(x, 0.5, rounds)
        times.append(time.process_time() - began)
    return rounds * x.size * 16 * 2 / min(times)
