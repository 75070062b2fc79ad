"""Exact propagation of a driven linear system over one time step, mode by mode.

Owns the eigenmodes of a system and what a step h does to them: each mode turns
and decays, a force that is held over the step pushes it, and the drive gives
the closed system's steady response. It steps nothing.

In the coordinates of the modes the step matrix has nothing but blocks of two
rows on its diagonal, which makes a step several times cheaper than the full
matrix would, and one decomposition serves every drive frequency. A system
whose modes nearly coincide (two free inertias, say) has no usable
eigenvectors; it keeps its own coordinates and a full matrix.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sim.engine.layout import STEPS_SEEN
from sim.engine.system import PiecewiseLinearSystem

__all__ = [
    "FEWEST_STEPS",
    "WORST_CONDITION",
    "Modes",
    "Propagator",
    "build_propagator",
    "find_modes",
]

FEWEST_STEPS = 256
"""Steps per drive cycle at least, so that harmonics 0 to 3 and the laws' kinks are resolved."""

WORST_CONDITION = 1e7
"""Eigenvectors worse conditioned than this cost more digits than modes are worth."""


@dataclass(frozen=True, slots=True)
class Modes:
    """Coordinates q of a system, x = shapes q and q = weights x; p of them for n states.

    `rates` (p,) are the eigenvalues where q are modes: two rows belong
    together, a complex pair (in its real form, marked in `turning` (p/2,)) or
    two real modes; the last may stand alone. `rates` is empty where q are scaled
    states; `whole` (p, p) is then the system's matrix in them.
    """

    shapes: NDArray[np.float64]
    weights: NDArray[np.float64]
    rates: NDArray[np.complex128]
    turning: NDArray[np.bool_]
    whole: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Propagator:
    """One step of one system at one drive frequency; n states, p coordinates q, m laws.

    The state is x = x_drive(t) + shapes q, where x_drive is the closed
    system's steady response to the drive, of complex amplitude `drive` (n,)
    for an input of 1 V. With the forces p_j of the laws held over the step

        q_next = carry q + sum_j push_j p_j + drift + offset_drift V_offset

    `carry` is (p, 2), the two columns that row i shares with its partner, or
    (p, p) if `whole`; `push` (p, m); `drift` and `offset_drift` (p,).
    """

    frequency_hz: float
    step_s: float
    steps_per_cycle: int
    whole: bool
    carry: NDArray[np.float64]
    push: NDArray[np.float64]
    drift: NDArray[np.float64]
    offset_drift: NDArray[np.float64]
    drive: NDArray[np.complex128]

    def carried(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """What a step makes of coordinates (p, k) on which nothing acts."""
        return self.carry @ columns if self.whole else _by_blocks(self.carry, columns)


def find_modes(system: PiecewiseLinearSystem, worst_condition: float = WORST_CONDITION) -> Modes:
    """Eigenmodes of a system with every mesh closed, or its states where it has no good ones.

    Parameters
    ----------
    worst_condition
        Condition number from which on eigenvectors are no good; with 0 there are none.
    """
    return _modes_of(system.A.tobytes(), len(system.b), worst_condition)


@lru_cache(maxsize=64)
def _modes_of(matrix: bytes, n: int, worst_condition: float) -> Modes:
    # Loaded on use: it takes longer than all else that a measurement loads, which needs none of it.
    from scipy.linalg import matrix_balance

    A = np.frombuffer(matrix).reshape(n, n)
    # Stiffness over inertia makes entries of 1e9 beside entries of 1; balancing
    # keeps eigenvectors and exponentials accurate.
    balanced, (scale, _) = matrix_balance(A, permute=False, separate=True)
    rates, vectors = np.linalg.eig(balanced)
    upper, real = np.flatnonzero(np.imag(rates) > 0.0), np.flatnonzero(np.imag(rates) == 0.0)
    order = np.concatenate([np.repeat(upper, 2), real])
    basis = np.real(vectors[:, order])
    basis[:, 1 : 2 * len(upper) : 2] = np.imag(vectors[:, upper])
    if not np.linalg.cond(basis) < worst_condition:
        return _unmoded(balanced, scale)
    return Modes(
        shapes=scale[:, None] * basis,
        weights=np.linalg.inv(basis) / scale,
        rates=rates[order],
        turning=np.arange((len(order) + 1) // 2) < len(upper),
        whole=np.empty((0, 0)),
    )


def _unmoded(balanced: NDArray[np.float64], scale: NDArray[np.float64]) -> Modes:
    return Modes(
        shapes=np.diag(scale),
        weights=np.diag(1.0 / scale),
        rates=np.empty(0, dtype=complex),
        turning=np.empty(0, dtype=bool),
        whole=balanced,
    )


def build_propagator(
    system: PiecewiseLinearSystem, modes: Modes, frequency_hz: float, longest_step_s: float
) -> Propagator:
    """Propagator with a whole number of steps in each drive cycle, a multiple of `STEPS_SEEN`."""
    fewest = np.ceil(1.0 / (frequency_hz * longest_step_s) - 1e-9)
    steps = max(STEPS_SEEN * int(np.ceil(fewest / STEPS_SEEN)), FEWEST_STEPS)
    h = 1.0 / (frequency_hz * steps)
    inlets = [law.inlet for law in system.nonlinearities]
    forcings = modes.weights @ np.array([*inlets, system.f, system.b]).T
    if modes.rates.size:
        carry, pushes = _turn(modes, forcings, h)
    else:
        carry, pushes = _exponential(modes.whole, forcings, h)
    jw = 2j * np.pi * frequency_hz
    drive = np.linalg.solve(jw * np.eye(len(system.b)) - system.A, system.b.astype(complex))
    return Propagator(
        frequency_hz=frequency_hz,
        step_s=h,
        steps_per_cycle=steps,
        whole=not modes.rates.size,
        carry=carry,
        push=pushes[:, :-2],
        drift=pushes[:, -2],
        offset_drift=pushes[:, -1],
        drive=np.asarray(drive, dtype=np.complex128),
    )


def _turn(
    modes: Modes, forcings: NDArray[np.float64], h: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Carry (p, 2) of a step h, and what forcings (p, k) held over it add to the modes (p, k)."""
    angle = modes.rates * h
    still = np.where(angle == 0.0, 1.0, angle)
    carry = _in_pairs(np.exp(angle), modes.turning)
    held = _in_pairs(h * np.where(angle == 0.0, 1.0, np.expm1(angle) / still), modes.turning)
    return carry, _by_blocks(held, forcings)


def _in_pairs(values: NDArray, turning: NDArray[np.bool_]) -> NDArray[np.float64]:
    """A function of the rates (p,) as the two columns of its blocks of two rows, (p, 2)."""
    paired = np.append(values, np.zeros(len(values) % 2))
    first, second = paired[0::2], paired[1::2]
    top = np.stack([first.real, np.where(turning, first.imag, 0.0)], axis=1)
    bottom = np.stack([np.where(turning, -first.imag, 0.0), second.real], axis=1)
    return np.stack([top, bottom], axis=1).reshape(-1, 2)[: len(values)]


def _by_blocks(blocks: NDArray[np.float64], columns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Product (p, k) of a matrix that is blocks of two rows on its diagonal, its columns (p, 2)."""
    p = len(columns)
    paired = np.vstack([columns, np.zeros((p % 2, columns.shape[1]))])
    first = np.arange(p) & ~1
    return blocks[:, :1] * paired[first] + blocks[:, 1:] * paired[first + 1]


def _exponential(
    A: NDArray[np.float64], forcings: NDArray[np.float64], h: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The same as `_turn` from one exponential of an augmented matrix (Van Loan 1978)."""
    from scipy.linalg import expm

    p, k = forcings.shape
    augmented = np.zeros((p + k, p + k))
    augmented[:p, :p], augmented[:p, p:] = A * h, forcings * h
    exponential = np.asarray(expm(augmented), dtype=float)
    return np.ascontiguousarray(exponential[:p, :p]), exponential[:p, p:]
