"""The paper's servo as other programs are given it: matrices, dead zones, smoothed friction.

Owns one set of equations for every general solver in `tests/benchmarks/peers.py`:

    x' = A x + b V_i + G phi(C x)

with every mesh closed in A, phi the bounded forces that open it again, and
friction as a steep tanh, because step control cannot get past a true sign().
It is written from the oracle's side of the tests and imports no engine.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from worlds.side_by_side import half_plays, state_space

STATES = 13
OUTPUT = 11

MOTOR_WIDTH = 0.02
"""Speed of the motor over which friction turns, rad/s: a thousandth of what it reaches."""

SAMPLES = 256
"""Points per cycle at which an adaptive solver is asked for its answer."""


@dataclass(frozen=True, slots=True, eq=False)
class Matrices:
    """A (13, 13), b (13,), G (13, 4), C (4, 13) and the laws' numbers.

    Rows of C are the deflections of both meshes, then the speeds of motor and load. `stiffness`
    and `play` (2,) are the meshes', `torque` and `width` (2,) the frictions'.
    """

    A: np.ndarray
    b: np.ndarray
    G: np.ndarray
    C: np.ndarray
    stiffness: np.ndarray
    play: np.ndarray
    torque: np.ndarray
    width: np.ndarray

    def rate(self, V_i, x, xp=np):
        """dx/dt; `xp` is the library whose arrays x are."""
        y = self.C @ x
        bounded = self.stiffness * xp.clip(y[:2], -self.play, self.play)
        friction = self.torque * xp.tanh(y[2:] / self.width)
        return self.A @ x + self.b * V_i + self.G @ xp.concatenate([bounded, friction])


def matrices(unit, ratio: float, c_s1: float = 0.0) -> Matrices:
    """The servo of a unit, with a damper beside each spring of shaft 1."""
    p = unit.parameters
    linear = state_space(unit, c_s1=c_s1)
    G, C = np.zeros((STATES, 4)), np.zeros((4, STATES))
    C[0, [1, 3]] = 1.0 / p["N_1"], -1.0
    C[1, [7, 9]] = 1.0 / p["N"], -1.0
    C[2, 2] = C[3, 10] = 1.0
    G[2, 0], G[4, 0] = 1.0 / (p["N_1"] * p["J_m"]), -1.0 / p["J_g1"]
    G[8, 1], G[10, 1] = 1.0 / (p["N"] * p["J_p2"]), -1.0 / p["J_L"]
    G[2, 2], G[10, 3] = -1.0 / p["J_m"], -1.0 / p["J_L"]
    return Matrices(
        A=np.asarray(linear.A),
        b=np.asarray(linear.B)[:, 0],
        G=G,
        C=C,
        stiffness=np.array([p["k_g1"], p["k_2"]]),
        play=np.array(half_plays(unit, ratio)),
        torque=np.array([p["T_f_m"], p["T_f_L"]]),
        width=MOTOR_WIDTH * np.array([1.0, 1.0 / (p["N_1"] * p["N"])]),
    )


def gains(samples: np.ndarray, source_vpk: float) -> np.ndarray:
    """V_o/V_i of each whole cycle of samples (cycles * SAMPLES,), drive sin from phase zero."""
    cycles = samples.reshape(-1, SAMPLES)
    turn = np.exp(-2j * np.pi * np.arange(SAMPLES) / SAMPLES)
    return 2j * (cycles @ turn) / SAMPLES / source_vpk
