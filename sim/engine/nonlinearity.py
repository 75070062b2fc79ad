"""The scalar laws of a system, and how its output is read.

Owns the names of the laws, the record of one, and the gain of holding samples. It builds and
steps nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["SAMPLED", "Law", "Nonlinearity", "Reading", "held"]


class Law(IntEnum):
    """The scalar laws p = law(y) that the engine knows; `parameters` are theirs, in order."""

    PLAY = 0
    """p = k clip(y, -d, d) + c y' while \\|y\\| < d. Parameters d; k and c are fixed."""
    FRICTION = 1
    """p = -(T + T_s exp(-(y/w)^2)) sign(y), set-valued at rest. Parameters T, T_s, w."""
    EXCESS = 2
    """p = clip(z, -limit, limit) - z with z = y - centre. Parameters limit, centre."""
    CUBIC = 3
    """p = -k y^3. Parameter k."""
    HOLD = 6
    """p = y at the last tick of a clock. Parameter: its rate in Hz."""
    COUNT = 7
    """p = y at the last tick in whole counts. Parameters: rate, size of a count."""
    COUNT_RATE = 8
    """p = rate times the change of the counts from tick to tick. Parameters: rate, size."""
    LOADED = 9
    """p = -(T + m \\|F\\|) sign(y), set-valued at rest, F what the mesh of a play transmits.
    Parameters T, m."""


SAMPLED = frozenset({Law.HOLD, Law.COUNT, Law.COUNT_RATE})
"""Laws that see y at the ticks of a clock alone. All clocks of a system tick together."""


@dataclass(frozen=True, slots=True)
class Nonlinearity:
    """One scalar feedback p = law(y) of a piecewise-linear system.

    `inlet` is g, `outlet` is c (both shape (n,)), `feedthrough` is d;
    `stiffness` and `damping` are those of a play when it is closed. `read` is r, what the output
    takes of p; `smooth` (n,) what a sampled law would see without a clock and without counts;
    `hears`: numbers of earlier laws whose forces are part of y, with their coefficients;
    `loaded_by`: number of the play that loads a friction.
    """

    name: str
    law: Law
    inlet: NDArray[np.float64]
    outlet: NDArray[np.float64]
    feedthrough: float
    stiffness: float
    damping: float
    parameters: tuple[float, float, float]
    read: float = 0.0
    smooth: NDArray[np.float64] | None = None
    hears: tuple[tuple[int, float], ...] = ()
    loaded_by: int = -1


@dataclass(frozen=True, slots=True)
class Reading:
    """What becomes of the output on its way to the bench's records.

    `delay_s`: it comes so late. `sample_s`: above 0 the bench records samples of this period,
    and not what is held between them.
    """

    delay_s: float = 0.0
    sample_s: float = 0.0

    def factor(self, s: NDArray[Any]) -> NDArray[np.complex128]:
        """On a Fourier coefficient at complex angular frequencies s, rad/s."""
        return np.asarray(np.exp(-s * self.delay_s) / held(s * self.sample_s))


def held(turn: NDArray[Any]) -> NDArray[np.complex128]:
    """Gain of holding samples of period T, at s T: (1 - exp(-s T)) / (s T), and 1 at 0."""
    turn = np.asarray(turn, dtype=complex)
    still = turn == 0.0
    return np.where(still, 1.0, -np.expm1(-turn) / np.where(still, 1.0, turn))
