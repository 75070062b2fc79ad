"""The linear response of a system: every mesh closed, no friction, clocks taken into account.

Owns transfer functions in closed form, with and without a clock. It steps nothing.

What a clock samples is folded: a command that is held from tick to tick has images about every
multiple of the rate, and a sensor that is sampled by the same clock reads them at the frequency of
the drive. So a held command and a sampled sensor together have the response of the exact
step-invariant discretisation (K. J. Astroem and B. Wittenmark, Computer-Controlled Systems, ch. 2).
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sim.engine.nonlinearity import Law, Nonlinearity, Reading, held

__all__ = ["chain_factor", "sampled_response", "smooth_parts", "smooth_response"]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


class LinearParts(Protocol):
    """What a linear response takes of a system (`sim.engine.system.PiecewiseLinearSystem`)."""

    @property
    def A(self) -> Real:  # noqa: N802
        """Matrix, shape (n, n)."""
        ...

    @property
    def b(self) -> Real:
        """Input, shape (n,)."""
        ...

    @property
    def o(self) -> Real:
        """Output row, shape (n,)."""
        ...

    @property
    def sampled(self) -> tuple[Nonlinearity, ...]:
        """The laws that a clock samples."""
        ...

    @property
    def reading(self) -> Reading:
        """How the output is read."""
        ...


def smooth_parts(system: LinearParts) -> tuple[Real, Real, Real]:
    """Matrix (n, n), input (n,) and output (n,) as if nothing were sampled or counted."""
    A, b, o = system.A, system.b, system.o
    for law in system.sampled:
        sees = law.outlet if law.smooth is None else law.smooth
        A = A + np.outer(law.inlet, sees)
        b = b + law.feedthrough * law.inlet
        o = o + law.read * sees
    return A, b, o


def chain_factor(system: LinearParts, s: NDArray[Any]) -> Complex:
    """What holding, differencing and delays do to a response at s, but for images."""
    factor = np.ones_like(s)
    for law in system.sampled:
        turn = s / law.parameters[0]
        factor = factor * held(turn) * (held(turn) if law.law is Law.COUNT_RATE else 1.0)
    return np.asarray(factor * system.reading.factor(s))


def smooth_response(system: LinearParts, s: NDArray[Any]) -> Complex:
    """Response at complex angular frequencies s, rad/s; images of a held command are left out."""
    A, b, o = smooth_parts(system)
    x = _solve(A, b, s)
    response = np.asarray(np.squeeze(o @ x, axis=-1))
    if not system.sampled and system.reading.delay_s == 0.0:
        return response
    return np.asarray(response * chain_factor(system, s))


def sampled_response(system: LinearParts, s: NDArray[Any]) -> Complex:
    """The same with images of the command, as a sensor reads them that the same clock samples."""
    commands = [law for law in system.sampled if law.feedthrough != 0.0]
    sensors = [law for law in system.sampled if law.feedthrough == 0.0]
    if not commands or not sensors:
        return smooth_response(system, s)
    (command,), (sensor,) = commands, sensors
    period = 1.0 / sensor.parameters[0]
    z = np.exp(s * period)
    sequence = _sequence(system, command, sensor.outlet, z, period)
    if sensor.law is Law.COUNT_RATE:
        sequence = sequence * (1.0 - 1.0 / z) / period
    after = sensor.read + np.squeeze(system.o @ _solve(system.A, sensor.inlet, s), axis=-1)
    return np.asarray(sequence * held(s * period) * after * system.reading.factor(s))


def _sequence(
    system: LinearParts, command: Nonlinearity, sees: Real, z: Complex, period: float
) -> Complex:
    """Samples of what a sensor sees over those of the command, by the exact discretisation."""
    from scipy.linalg import expm, matrix_balance

    n = len(system.b)
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n] = system.A, command.inlet * command.feedthrough
    balanced, (scale, _) = matrix_balance(whole * period, permute=False, separate=True)
    step = expm(balanced) * scale[:, None] / scale[None, :]
    x = np.linalg.solve(z[..., None, None] * np.eye(n) - step[:n, :n], step[:n, n:].astype(complex))
    return np.asarray(np.squeeze(sees @ x, axis=-1))


def _solve(A: Real, b: Real, s: NDArray[Any]) -> Complex:
    eye = np.eye(len(b))
    x = np.linalg.solve(s[..., None, None] * eye - A, b[:, None].astype(complex))
    return np.asarray(x, dtype=complex)
