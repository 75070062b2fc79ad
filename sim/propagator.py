"""Exact propagation of a driven linear system over one time step.

Owns matrix exponentials and what follows from them for a step h: how the state
is carried, how a force that is constant or rises linearly over the step acts,
and the closed system's steady response to the drive. It steps nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, matrix_balance

from sim.assembly import Law, PiecewiseLinearSystem

__all__ = ["FEWEST_STEPS", "Propagator", "build_propagator"]

FEWEST_STEPS = 256
"""Steps per drive cycle at least, so that harmonics 0 to 3 and the laws' kinks are resolved."""


@dataclass(frozen=True, slots=True)
class Propagator:
    """One step of one system at one drive frequency; n states, m laws.

    The state is stepped as x = x_drive(t) + z + sum_j end_j p_j, where x_drive
    is the closed system's steady response to the drive and p_j the newest
    value of law j. So

        z_next = carry z + sum_j kick_j p_j + drift + offset_drift V_offset

    `carry` is (n, n), `end` and `kick` (m, n), `drift` and `offset_drift`
    (n,); `drive` (n,) is the complex amplitude of x_drive for an input of 1 V.
    """

    frequency_hz: float
    step_s: float
    steps_per_cycle: int
    carry: NDArray[np.float64]
    end: NDArray[np.float64]
    kick: NDArray[np.float64]
    drift: NDArray[np.float64]
    offset_drift: NDArray[np.float64]
    drive: NDArray[np.complex128]


def build_propagator(
    system: PiecewiseLinearSystem, frequency_hz: float, longest_step_s: float
) -> Propagator:
    """Propagator with a whole number of steps in each drive cycle.

    A play's force is interpolated linearly over the step, friction is constant
    over it: the first makes the scheme symmetric in time, so that it neither
    damps nor feeds the mesh modes, the second lets friction stop the motion
    dead.
    """
    steps = max(int(np.ceil(1.0 / (frequency_hz * longest_step_s) - 1e-9)), FEWEST_STEPS)
    h = 1.0 / (frequency_hz * steps)
    n, m = len(system.b), len(system.nonlinearities)
    inlets = [law.inlet for law in system.nonlinearities]
    carry, constant, rising = _step_integrals(system.A, np.array([*inlets, system.f, system.b]), h)
    end, kick = np.empty((m, n)), np.empty((m, n))
    for j, law in enumerate(system.nonlinearities):
        end[j] = constant[j] if law.law is Law.FRICTION else rising[j]
        kick[j] = carry @ end[j] + constant[j] - end[j]
    jw = 2j * np.pi * frequency_hz
    response = np.linalg.solve(jw * np.eye(n) - system.A, system.b.astype(complex))
    drive = np.asarray(response, dtype=complex)
    return Propagator(
        frequency_hz=frequency_hz,
        step_s=h,
        steps_per_cycle=steps,
        carry=carry,
        end=end,
        kick=kick,
        drift=constant[m],
        offset_drift=constant[m + 1],
        drive=drive,
    )


def _step_integrals(
    A: NDArray[np.float64], forcings: NDArray[np.float64], h: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """e^(A h), and the responses after h to forcings held at 1 and rising from 0 to 1.

    One exponential of an augmented matrix gives all three (Van Loan 1978).
    `forcings` is (k, n), the two responses as well.
    """
    n, k = A.shape[0], len(forcings)
    # Stiffness over inertia makes entries of 1e9 beside entries of 1; balancing
    # keeps the squarings inside the exponential accurate.
    balanced, (scale, _) = matrix_balance(A * h, permute=False, separate=True)
    augmented = np.zeros((n + 2 * k, n + 2 * k))
    augmented[:n, :n] = balanced
    augmented[:n, n : n + k] = forcings.T * h / scale[:, None]
    augmented[n : n + k, n + k :] = np.eye(k)
    exponential = expm(augmented)
    carry = exponential[:n, :n] * scale[:, None] / scale[None, :]
    constant = (exponential[:n, n : n + k] * scale[:, None]).T
    rising = (exponential[:n, n + k :] * scale[:, None]).T
    return carry, constant, rising
