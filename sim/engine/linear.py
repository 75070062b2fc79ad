"""The linear response of a system: every mesh closed, no friction, clocks taken into account.

Owns transfer functions in closed form, with and without a clock. It steps nothing.

What a clock samples is folded: a command that is held from tick to tick has images about every
multiple of the rate, and a sensor that is sampled by the same clock reads them at the frequency of
the drive. So a held command and a sampled sensor together have the response of the exact
step-invariant discretisation (K. J. Astroem and B. Wittenmark, Computer-Controlled Systems, ch. 2).
The same holds of a loop that is closed at the clock; its poles are those of that discretisation.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sim.engine.nonlinearity import Law, Nonlinearity, Reading, held

__all__ = ["chain_factor", "parts_at", "poles", "sampled_response", "smooth_response"]

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

    @property
    def closed(self) -> bool:
        """Whether what is sampled may come back to its sampler."""
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


def parts_at(
    system: LinearParts, s: NDArray[Any]
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], Complex]:
    """Matrix, input and output row at s, and a factor (F,) on the response; no images.

    Shapes (n, n), (n,) and (n,). Of a closed loop with a clock they differ from frequency to
    frequency, (F, n, n), (F, n) and (F, n), as holding and differencing are part of the loop.
    """
    if not (system.closed and system.sampled):
        return (*smooth_parts(system), chain_factor(system, s))
    A, b, o = (
        np.repeat(part[None] + 0j, len(s), axis=0) for part in (system.A, system.b, system.o)
    )
    for law in system.sampled:
        sees = law.outlet if law.smooth is None else law.smooth
        turn = s / law.parameters[0]
        hold = held(turn) * (held(turn) if law.law is Law.COUNT_RATE else 1.0)
        A += hold[:, None, None] * np.outer(law.inlet, sees)
        b += hold[:, None] * law.feedthrough * law.inlet
        o += hold[:, None] * law.read * sees
    return A, b, o, system.reading.factor(s)


def chain_factor(system: LinearParts, s: NDArray[Any]) -> Complex:
    """What holding, differencing and delays do to a response at s, but for images."""
    factor = np.ones_like(s)
    for law in system.sampled:
        turn = s / law.parameters[0]
        factor = factor * held(turn) * (held(turn) if law.law is Law.COUNT_RATE else 1.0)
    return np.asarray(factor * system.reading.factor(s))


def smooth_response(system: LinearParts, s: NDArray[Any]) -> Complex:
    """Response at complex angular frequencies s, rad/s; images of a held command are left out."""
    if system.closed and system.sampled:
        A, b, o, factor = parts_at(system, s)
        return np.asarray(np.einsum("fn,fn->f", o, _solve(A, b, s)[..., 0]) * factor)
    A, b, o = smooth_parts(system)
    x = _solve(A, b, s)
    response = np.asarray(np.squeeze(o @ x, axis=-1))
    if not system.sampled and system.reading.delay_s == 0.0:
        return response
    return np.asarray(response * chain_factor(system, s))


def sampled_response(system: LinearParts, s: NDArray[Any]) -> Complex:
    """The same with images of the command, as a sensor reads them that the same clock samples."""
    if system.closed:
        return _closed_response(system, s)
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


def poles(system: LinearParts) -> Complex:
    """Poles, rad/s, without friction; of a loop at a clock log(z) / T, below half of its rate."""
    if not (system.closed and system.sampled):
        return _eigenvalues(smooth_parts(system)[0])
    period = 1.0 / system.sampled[0].parameters[0]
    step, pushes = _step(system, period)
    n, laws = len(step), system.sampled
    # What is held is a sample; what is differenced remembers the sample before.
    remembered = [law for law in laws if law.law is Law.COUNT_RATE]
    whole = np.zeros((n + len(remembered),) * 2)
    whole[:n, :n] = step
    for law, push in zip(laws, pushes.T, strict=True):
        gain = law.parameters[0] if law.law is Law.COUNT_RATE else 1.0
        whole[:n, :n] += gain * np.outer(push, law.outlet)
        if law.law is Law.COUNT_RATE:
            place = n + remembered.index(law)
            whole[:n, place] = -gain * push
            whole[place, :n] = law.outlet
    z = _eigenvalues(whole)
    return np.asarray(np.log(np.where(z == 0.0, 1e-300, z)) / period, dtype=complex)


def _closed_response(system: LinearParts, s: NDArray[Any]) -> Complex:
    """Of a loop with a clock: samples from tick to tick, then what is steady between them.

    Samples X of the state for an input exp(s t), of which the laws hold P = S X + D:
    (z - step) X = pushes P + what the input itself pushes. The mean of x(t) exp(-s t) over a
    period is then (s - A)^-1 (b + inlets P held(s T)).
    """
    period = 1.0 / system.sampled[0].parameters[0]
    step, pushes = _step(system, period)
    z, eye, laws = np.exp(s * period), np.eye(len(step)), system.sampled
    sees = np.array([law.outlet for law in laws]) * np.ones((len(s), 1, 1), dtype=complex)
    for j, law in enumerate(laws):
        if law.law is Law.COUNT_RATE:
            sees[:, j] *= ((1.0 - 1.0 / z) / period)[:, None]
    through = np.array([law.feedthrough for law in laws])
    own = (z[:, None, None] * eye - step) @ _solve(system.A, system.b, s)
    right = own + (pushes @ through)[:, None]
    X = np.linalg.solve(z[:, None, None] * eye - step - pushes @ sees, right)
    P = (sees @ X)[..., 0] + through
    hold = held(s * period)
    inlets = np.array([law.inlet for law in laws])
    pushed = system.b + hold[:, None] * (P @ inlets)
    x = _solve(system.A, pushed, s)[..., 0]
    reads = np.array([law.read for law in laws])
    return np.asarray((x @ system.o + hold * (P @ reads)) * system.reading.factor(s))


def _step(system: LinearParts, period: float) -> tuple[Real, Real]:
    """Step (n, n) of a period, and what each sampled law (n, laws) that is held over it adds."""
    n, inlets = len(system.b), np.array([law.inlet for law in system.sampled]).T
    step = _exponential(system.A, inlets, period)
    return step[:n, :n], step[:n, n:]


def _exponential(A: Real, inlets: Real, period: float) -> Real:
    """Exponential of a matrix (n, n) beside forcings (n, k) that are held, (n + k, n + k)."""
    from scipy.linalg import expm, matrix_balance

    n, k = inlets.shape
    whole = np.zeros((n + k, n + k))
    whole[:n, :n], whole[:n, n:] = A, inlets
    balanced, (scale, _) = matrix_balance(whole * period, permute=False, separate=True)
    return np.asarray(expm(balanced) * scale[:, None] / scale[None, :], dtype=float)


def _sequence(
    system: LinearParts, command: Nonlinearity, sees: Real, z: Complex, period: float
) -> Complex:
    """Samples of what a sensor sees over those of the command, by the exact discretisation."""
    n = len(system.b)
    step = _exponential(system.A, (command.inlet * command.feedthrough)[:, None], period)
    x = np.linalg.solve(z[..., None, None] * np.eye(n) - step[:n, :n], step[:n, n:].astype(complex))
    return np.asarray(np.squeeze(sees @ x, axis=-1))


def _eigenvalues(A: Real) -> Complex:
    """Of a matrix whose entries differ by many orders of magnitude."""
    from scipy.linalg import matrix_balance

    balanced, _ = matrix_balance(A, permute=False, separate=True)
    return np.asarray(np.linalg.eigvals(balanced), dtype=complex)


def _solve(A: Any, b: Any, s: NDArray[Any]) -> Complex:
    eye = np.eye(b.shape[-1])
    x = np.linalg.solve(s[..., None, None] * eye - A, b[..., None].astype(complex))
    return np.asarray(x, dtype=complex)
