"""In which order the laws of a system are solved within a step.

Owns what one law does to another over a step, and what follows from it: which
are solved side by side, which again and again until they agree. It solves none.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sim.engine.layout import PAIR, STRIBECK
from sim.engine.system import SAMPLED, Law, Nonlinearity

__all__ = ["kinds_of", "law_coefficients", "law_parameters", "order_of"]

_HARDENING_SWEEPS = 3
"""Passes where a hardening shaft and a play push one tiny inertia; the shaft goes once more."""

_MOST_PASSES = 8
"""Passes at most where one play pushes another within a step, as through a heavily damped shaft."""

_LOOSE = 1e-4
"""Share of its motion that a law may take over from another before that counts."""

_OF_A_LAW = 7


def kinds_of(laws: Sequence[Nonlinearity]) -> tuple[int, ...]:
    """Kinds as `sim.engine.layout` has them: friction that peaks at rest, springs in pairs."""
    kinds = [
        STRIBECK if law.law is Law.FRICTION and law.parameters[1] != 0.0 else int(law.law)
        for law in laws
    ]
    for j in range(len(kinds) - 1):
        led = j > 0 and kinds[j - 1] == PAIR
        if kinds[j] == kinds[j + 1] == Law.CUBIC and not led:
            kinds[j] = PAIR
    return tuple(kinds)


def order_of(
    kinds: Sequence[int], gain: NDArray[np.float64], fixed: Sequence[tuple[float, float]]
) -> tuple[tuple[int, ...], ...]:
    """Laws in an order that settles what they do to each other within one step.

    Where springs harden, or plays push each other, these are gone through until they agree;
    what acts on the heavy inertias alone follows once. Neighbours that hardly feel each other
    are solved side by side, as each then waits less for the other.

    `gain` (m or more, m): what laws see of forces. `fixed`: stiffness and damping over a step.
    """
    followers = [j + 1 for j, kind in enumerate(kinds) if kind == PAIR]
    once = [j for j in range(len(kinds)) if j not in followers]
    springs = [j for j in once if kinds[j] in (Law.CUBIC, PAIR)]
    plays = [j for j in once if kinds[j] == Law.PLAY]
    slope = np.array([fixed[j][0] + 2.0 * fixed[j][1] for j in plays])
    taken_over = np.abs(gain[np.ix_(plays, plays)]) * slope
    np.fill_diagonal(taken_over, 0.0)
    passes = _passes(taken_over.max(initial=0.0))
    rest = [j for j in once if j not in springs and j not in plays]
    if springs:
        order = (springs + plays) * max(_HARDENING_SWEEPS, passes // 2) + springs + rest
        return _side_by_side(order, kinds, gain)
    if passes == 1:
        return _side_by_side(once, kinds, gain)
    return (tuple(plays),) * passes + _side_by_side(rest, kinds, gain)


def _passes(taken_over: float) -> int:
    """Passes, side by side, after which plays that take over such a share from each other agree.

    What is left after each is that share of what was left before, and before the first all by
    which a force has changed since the last step.
    """
    left = taken_over ** np.arange(1, _MOST_PASSES)
    return int(np.count_nonzero(left > _LOOSE)) + 1


def _side_by_side(
    order: Sequence[int], kinds: Sequence[int], gain: NDArray[np.float64]
) -> tuple[tuple[int, ...], ...]:
    groups: list[list[int]] = []
    for j in order:
        if groups and all(_hardly_feel(j, k, kinds, gain) for k in groups[-1]):
            groups[-1].append(j)
        else:
            groups.append([j])
    return tuple(tuple(group) for group in groups)


def _hardly_feel(j: int, k: int, kinds: Sequence[int], gain: NDArray[np.float64]) -> bool:
    """Whether what two laws do to each other is little beside what they do to themselves."""
    single = (Law.PLAY, Law.FRICTION, STRIBECK)
    if j == k or kinds[j] not in single or kinds[k] not in single:
        return False
    return bool(abs(gain[j, k] * gain[k, j]) <= _LOOSE**2 * abs(gain[j, j] * gain[k, k]))


def law_coefficients(
    kinds: Sequence[int], gain: NDArray[np.float64], fixed: Sequence[tuple[float, float]]
) -> NDArray[np.float64]:
    """(m, 7) what solving each law takes besides its parameters, see `sim.engine.layout.Layout`."""
    found = np.zeros((len(kinds), _OF_A_LAW))
    for j, (kind, (k, c)) in enumerate(zip(kinds, fixed, strict=True)):
        beta = gain[j, j]
        if kind == Law.PLAY:
            half, damp = 0.5 * k * beta, c * beta
            away = half + damp
            found[j] = 0.5 * k, c, half, half - damp, away, away - 1.0, 1.0 / (1.0 - away)
        else:
            found[j, :2] = beta, -1.0 / beta if beta else 0.0
    return found


def law_parameters(
    kinds: Sequence[int],
    parameters: NDArray[np.float64],
    gain: NDArray[np.float64],
    step_s: float,
) -> NDArray[np.float64]:
    """(3 m, lanes) parameters, and in free places what follows from them and does not change.

    `parameters` (m, 3, lanes). Of a play its lower end, of a friction by how much it can slow the
    motion down within a step. Of a sampled law see `sim.engine.laws.Sampler`.
    """
    found = parameters.copy()
    for j, kind in enumerate(kinds):
        if kind == Law.PLAY:
            found[j, 1] = -found[j, 0]
        elif kind == Law.FRICTION:
            found[j, 1] = gain[j, j] * found[j, 0]
        elif kind in SAMPLED:
            rate, size = parameters[j, :2]
            found[j, 0] = rate * step_s
            if kind != Law.HOLD:
                found[j, 1] = 1.0 / size
                found[j, 2] = size * rate if kind == Law.COUNT_RATE else size
    return found.reshape(3 * len(kinds), found.shape[-1])
