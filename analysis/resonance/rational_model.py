"""A fixed number of zero and pole pairs over a slowly varying surrounding, fitted in the logarithm.

Owns the model, its least-squares fit and what follows from it: extrema with
covariance, damping ratios, and the tests that say whether the fit may be
believed. It chooses no window, makes up no further pole or zero and never
touches a response's own numbers.

The model of the response at the drive frequency f, with x = f/f_0, is

    ln G(f) = sum_zeros D(x) - sum_poles D(x) + sum_k a_k (ln x)^k + i sum_k b_k (x - 1)^k
    D(x)    = ln(1 - (x/w)^2 + 2 i zeta (x/w))

The surrounding (a_k, b_k) carries gain, integrator, low-pass and delay. The
logarithm turns multiplicative noise into additive noise and is unbiased: the
mean of ln(1 + n) is 0 for circular noise n below 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc

from analysis.resonance.neighbour_noise import Vector
from analysis.resonance.samples import Samples
from daq.frf import DB_PER_NEPER

__all__ = ["Extremum", "Pair", "RationalFit", "fit_rational"]

ZETA_BOUNDS = (1e-4, 2.0)
"""Damping ratios beyond these are no resonance that a sweep can resolve."""

WIDEST_BAND = 1e3
"""Over a band whose ends are further apart than this no polynomial is a slow surrounding."""


@dataclass(frozen=True, slots=True)
class Pair:
    """A complex pair of zeros or poles.

    Parameters
    ----------
    frequency_hz
        Undamped natural frequency, Hz.
    zeta
        Damping ratio; positive.
    kind
        ``+1`` for zeros, ``-1`` for poles.
    side
        ``+1`` for the left half plane, ``-1`` for the right (zeros only).
    """

    frequency_hz: float
    zeta: float
    kind: int
    side: int = 1


@dataclass(frozen=True, slots=True)
class Extremum:
    """Where the fitted gain is least or greatest.

    `gradient` holds the derivative of the frequency by each parameter, shape
    (parameters,), so that covariances between extrema can be formed.
    """

    frequency_hz: float
    gain_db: float
    gradient: Vector
    gain_gradient_db: Vector


@dataclass(frozen=True, slots=True)
class RationalFit:
    """A converged fit.

    Parameters
    ----------
    pairs
        The zeros and poles found, in the order of the start values.
    order
        Degree of the surrounding.
    theta
        Parameters: ln w and ln zeta of each pair, then a_k, then b_k.
    covariance
        Of theta, from the standard errors as given, shape (parameters, parameters).
    residual
        Weighted residuals, shape (2, points): along and across the gain, the
        second row 0 where the phase is unknown.
    dof
        Residuals less parameters.
    """

    samples: Samples
    pairs: tuple[Pair, ...]
    order: int
    f_0: float
    theta: Vector
    covariance: Vector
    residual: Vector
    dof: int

    @property
    def chi_square(self) -> float:
        """Sum of the squared weighted residuals."""
        return float(np.sum(self.residual**2))

    @property
    def scale(self) -> float:
        """Scatter of the residuals over the standard errors; 1 where the errors are right."""
        return float(np.sqrt(self.chi_square / self.dof))

    @property
    def probability(self) -> float:
        """Chance of a chi-square this large or larger, were model and errors right."""
        return float(gammaincc(self.dof / 2.0, self.chi_square / 2.0))

    @property
    def criterion(self) -> float:
        """Chi-square plus 4 per parameter: of two orders on the same samples the lower is better.

        A further term has to lower chi-square as two standard errors of it would.
        """
        return self.chi_square + 4.0 * self.theta.size

    @property
    def correlation(self) -> float:
        """Correlation of neighbouring residuals."""
        total = self.chi_square
        r = self.residual
        return float(np.sum(r[:, 1:] * r[:, :-1]) / total) if total > 0.0 else 0.0

    @property
    def whiteness(self) -> float:
        """Correlation of neighbouring residuals in units of its standard error."""
        return self.correlation * float(np.sqrt(np.count_nonzero(self.residual)))

    def log_gain(self, frequency_hz: Vector) -> Vector:
        """Fitted ln |G| in nepers at any frequencies."""
        return _model(np.asarray(frequency_hz) / self.f_0, self.theta, self.pairs, self.order)[
            0
        ].real

    def extremum(self, low_hz: float, high_hz: float, sign: int) -> Extremum | None:
        """The least (sign -1) or greatest (+1) gain inside a band.

        Returns None where the extremum lies on the edge of the band.
        """
        grid = np.linspace(low_hz, high_hz, 129)
        k = int(np.argmax(sign * self.log_gain(grid)))
        if k in (0, grid.size - 1):
            return None
        step = grid[1] - grid[0]
        at, d = float(grid[k]), step * 1e-2
        for _ in range(4):
            g = self.log_gain(np.array([at - d, at, at + d]))
            bend = g[0] - 2 * g[1] + g[2]
            if bend * sign >= 0:
                return None
            at = float(np.clip(at - d * (g[2] - g[0]) / (2 * bend), grid[k - 1], grid[k + 1]))
        x = np.array([at - d, at, at + d]) / self.f_0
        value, jacobian = _model(x, self.theta, self.pairs, self.order)
        slope_by_theta = (jacobian[2].real - jacobian[0].real) / (2 * d)
        curvature = float(value[0].real - 2 * value[1].real + value[2].real) / d**2
        return Extremum(
            frequency_hz=at,
            gain_db=float(value[1].real * DB_PER_NEPER),
            gradient=-slope_by_theta / curvature,
            gain_gradient_db=jacobian[1].real * DB_PER_NEPER,
        )


def _model(
    x: Vector, theta: Vector, pairs: tuple[Pair, ...], order: int
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Logarithm of G, shape (points,), and its derivative by theta, shape (points, parameters)."""
    jacobian = np.empty((x.size, theta.size), dtype=complex)
    value = np.zeros(x.size, dtype=complex)
    for k, pair in enumerate(pairs):
        q = x / np.exp(theta[2 * k])
        loss = 2j * pair.side * np.exp(theta[2 * k + 1]) * q
        d = 1.0 - q * q + loss
        value += pair.kind * np.log(d)
        jacobian[:, 2 * k] = pair.kind * (2.0 * q * q - loss) / d
        jacobian[:, 2 * k + 1] = pair.kind * loss / d
    first = 2 * len(pairs)
    powers = np.arange(order + 1)
    jacobian[:, first : first + order + 1] = np.log(x)[:, None] ** powers
    jacobian[:, first + order + 1 :] = 1j * (x - 1.0)[:, None] ** powers
    value += jacobian[:, first:] @ theta[first:]
    return value, jacobian


def fit_rational(
    samples: Samples, pairs: tuple[Pair, ...], order: int, *, iterations: int = 30
) -> RationalFit | None:
    """Fit pairs and surrounding to the samples by weighted least squares in ln G.

    Parameters
    ----------
    samples
        Readings in the window.
    pairs
        Start values; their number, kind and side stay as they are.
    order
        Degree of the surrounding, 0 to 2.

    Returns
    -------
    The fit, or None where the samples are too few, their band is too wide, or no fit
    is found within bounds.
    """
    x, f_0 = _relative(samples)
    if not x[-1] < WIDEST_BAND * x[0]:
        return None
    with_phase = np.isfinite(samples.phase_std)
    gain_only = not with_phase.any()
    first = 2 * len(pairs)
    theta = np.zeros(first + 2 * (order + 1))
    theta[0:first:2] = np.log([pair.frequency_hz / f_0 for pair in pairs])
    theta[1:first:2] = np.log([pair.zeta for pair in pairs])
    free = np.arange(theta.size if not gain_only else first + order + 1)
    residuals = samples.log_gain.size + int(np.count_nonzero(with_phase))
    if residuals - free.size < 4:
        return None
    problem = _Problem(samples, x, pairs, order, free)
    theta = problem.surround(theta)
    solved = problem.descend(theta, iterations)
    if solved is None:
        return None
    theta, normal, residual = solved
    inverse = _inverse(normal)
    if inverse is None:
        return None
    covariance = np.zeros((theta.size, theta.size))
    covariance[np.ix_(free, free)] = inverse
    found = tuple(
        Pair(f_0 * float(np.exp(theta[2 * k])), float(np.exp(theta[2 * k + 1])), p.kind, p.side)
        for k, p in enumerate(pairs)
    )
    return RationalFit(
        samples, found, order, f_0, theta, covariance, residual, residuals - free.size
    )


def _relative(samples: Samples) -> tuple[Vector, float]:
    ends = samples.frequency_hz[[0, -1]]
    f_0 = float(np.exp(np.mean(np.log(ends))))
    return samples.frequency_hz / f_0, f_0


def _inverse(normal: Vector) -> Vector | None:
    """Inverse of a positive definite matrix after scaling to unit diagonal, or None."""
    diagonal = np.sqrt(np.diag(normal))
    if not np.all(np.isfinite(diagonal)) or np.any(diagonal <= 0):
        return None
    scaled = normal / np.outer(diagonal, diagonal)
    try:
        inverse = np.linalg.inv(scaled)
    except np.linalg.LinAlgError:
        return None
    if not np.all(np.isfinite(inverse)) or np.any(np.diag(inverse) <= 0):
        return None
    return inverse / np.outer(diagonal, diagonal)


class _Problem:
    """The least-squares problem of one window: residuals, start of the surrounding, descent."""

    def __init__(
        self,
        samples: Samples,
        x: Vector,
        pairs: tuple[Pair, ...],
        order: int,
        free: NDArray[np.intp],
    ) -> None:
        self.samples, self.x, self.pairs, self.order, self.free = samples, x, pairs, order, free
        self.weight = np.stack([1.0 / samples.std, 1.0 / samples.phase_std])

    def evaluate(self, theta: Vector) -> tuple[Vector, Vector]:
        """Weighted residuals, shape (2, points), and Jacobian, shape (2, points, free)."""
        value, jacobian = _model(self.x, theta, self.pairs, self.order)
        turn = self.samples.phase - value.imag
        turn -= 2 * np.pi * np.round(turn / (2 * np.pi))
        residual = np.stack([self.samples.log_gain - value.real, turn]) * self.weight
        part = jacobian[:, self.free]
        return residual, np.stack([part.real, part.imag]) * self.weight[:, :, None]

    def surround(self, theta: Vector) -> Vector:
        """The surrounding that suits the start values of the pairs best."""
        first = 2 * len(self.pairs)
        value, jacobian = _model(self.x, theta, self.pairs, self.order)
        rest = self.samples.log_gain - value.real
        theta = theta.copy()
        real = slice(first, first + self.order + 1)
        w = self.weight[0][:, None]
        theta[real] = np.linalg.lstsq(jacobian[:, real].real * w, rest * w[:, 0], rcond=None)[0]
        if self.free.size == theta.size:
            turn = np.unwrap(self.samples.phase - value.imag)
            w = self.weight[1][:, None]
            imag = slice(first + self.order + 1, None)
            theta[imag] = np.linalg.lstsq(jacobian[:, imag].imag * w, turn * w[:, 0], rcond=None)[0]
        return theta

    def descend(self, theta: Vector, iterations: int) -> tuple[Vector, Vector, Vector] | None:
        """Levenberg's and Marquardt's steps; parameters, normal matrix and residuals, or None."""
        residual, jacobian = self.evaluate(theta)
        cost, damping = float(np.sum(residual**2)), 1e-3
        low, high = np.log(ZETA_BOUNDS[0]), np.log(ZETA_BOUNDS[1])
        zetas, omegas = (slice(k, 2 * len(self.pairs), 2) for k in (1, 0))
        band = np.log(self.x[[0, -1]]) + [-1.0, 1.0]
        for _ in range(iterations):
            flat = jacobian.reshape(-1, self.free.size)
            normal, slope = flat.T @ flat, flat.T @ residual.ravel()
            lifted = normal + damping * np.diag(np.diag(normal) + 1e-12)
            try:
                step = np.linalg.solve(lifted, slope)
            except np.linalg.LinAlgError:
                return None
            trial = theta.copy()
            trial[self.free] += step
            trial[zetas] = np.clip(trial[zetas], low, high)
            trial[omegas] = np.clip(trial[omegas], *band)
            new_residual, new_jacobian = self.evaluate(trial)
            new_cost = float(np.sum(new_residual**2))
            if not np.isfinite(new_cost):
                return None
            if new_cost <= cost:
                done = cost - new_cost < 1e-6 * (1.0 + new_cost * 1e-3)
                theta, residual, jacobian = trial, new_residual, new_jacobian
                cost, damping = new_cost, damping * 0.1
                if done:
                    break
            else:
                damping *= 10.0
                if damping > 1e8:
                    break
        if np.any(theta[zetas] <= low) or np.any(theta[zetas] >= high):
            return None
        flat = jacobian.reshape(-1, self.free.size)
        return theta, flat.T @ flat, residual
