"""Least squares of sections to the readings of a level, in the complex plane.

Owns the weights, the descent, and the covariance of the parameters. It chooses no number of
sections and judges no fit.

The error of a reading is circular and its size is a share of the true gain, or the same at all
frequencies, whichever the errors show. Where the phase is unknown the logarithm of the gain is
fitted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.resonance.linear_model.sections import (
    SURROUNDING,
    Complex,
    Section,
    evaluate,
    pack,
    unpack,
)
from analysis.resonance.neighbour_noise import Vector, running
from analysis.resonance.samples import Samples
from daq.frf import DB_PER_NEPER

__all__ = ["Fit", "Readings", "fit_sections"]

_PRIOR = (3.0, 3.0)
"""Standard deviation of ln w about the band's middle and of ln zeta about ln 0.1: weak, so that
what the readings do not tell has wide bars and no infinite ones."""
_PRIOR_SURROUNDING = (1e3, 10.0, 1e3, 30.0)
PRICE = 4.0
NARROW = 0.2
"""Damping ratio below which a section is narrow."""
_WEIGHINGS = 2
"""Rounds in which errors that are a share of the gain are taken from the fit before."""
_FAR = 10.0
"""A fit that misses by so many standard errors is not made better."""
_LEAST_ZETA, _MOST_ZETA = 1e-5, 50.0


@dataclass(frozen=True, slots=True)
class Readings:
    """A level as it is fitted; shapes (points,).

    Parameters
    ----------
    x
        Frequency over f_0.
    log_unit
        Logarithm of the unit of the gain.
    gain
        Complex gain; its modulus where the phase is unknown.
    along, across
        Standard errors of a reading along and across its phasor, as a share of the gain, or as a
        gain where `absolute`; across is infinite where the phase is unknown.
    """

    x: Vector
    f_0: float
    log_unit: float
    gain: Complex
    along: Vector
    across: Vector
    absolute: bool

    @classmethod
    def of(cls, samples: Samples, *, absolute: bool | None = None) -> Readings:
        """Readings of a level; errors that are not known are constant, of either kind."""
        f = samples.frequency_hz
        f_0 = float(np.sqrt(f[0] * f[-1]))
        # Gains of the order of 1, whatever the unit.
        log_unit = float(np.median(samples.log_gain))
        log_gain = samples.log_gain - log_unit
        with_phase = np.isfinite(samples.phase_std)
        along, across = samples.std, samples.phase_std
        size = np.exp(np.clip(log_gain, -300.0, 300.0))
        if absolute is None:
            median = np.maximum(size, running(size, 5, np.median))
            absolute = bool(_roughness(along * median) < _roughness(along))
            if absolute:
                along, across = along * median, across * median
        else:
            along = np.full_like(along, np.median(along * size if absolute else along))
            across = np.where(with_phase, along, np.inf)
        gain = size * np.exp(1j * np.where(with_phase, samples.phase, 0.0))
        return cls(f / f_0, f_0, log_unit, gain, along, across, absolute)

    @property
    def with_phase(self) -> NDArray[np.bool_]:
        """Where the phase is known."""
        return np.isfinite(self.across)

    @property
    def count(self) -> int:
        """Number of residuals."""
        return len(self.x) + int(np.count_nonzero(self.with_phase))

    def without(self, rows: NDArray[np.intp]) -> Readings:
        """The readings but for some."""
        keep = np.ones(len(self.x), dtype=bool)
        keep[rows] = False
        return replace(
            self,
            x=self.x[keep],
            gain=self.gain[keep],
            along=self.along[keep],
            across=self.across[keep],
        )


def _roughness(std: Vector) -> float:
    return float(np.sum(np.abs(np.diff(np.log(std)))))


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """Sections that fit best.

    Parameters
    ----------
    theta
        Parameters in the order of `analysis.resonance.linear_model.sections`.
    covariance
        Of theta, from the standard errors as given.
    residual
        Residuals over their standard errors, shape (2, points): along and across.
    leverage
        Share of each reading in its own fit, 0 to 1, shape (points,).
    log_size
        Sum of the logarithms of the standard errors, for the likelihood.
    """

    readings: Readings
    sections: tuple[Section, ...]
    theta: Vector
    covariance: Vector
    residual: Vector
    leverage: Vector
    log_size: float

    @property
    def size(self) -> int:
        """Number of free parameters."""
        return len(self.theta) - (0 if self.readings.with_phase.any() else 2)

    @property
    def chi_square(self) -> float:
        """Sum of the squared residuals over their errors."""
        return float(np.sum(self.residual**2))

    @property
    def dof(self) -> int:
        """Residuals less parameters."""
        return self.readings.count - self.size

    @property
    def scale(self) -> float:
        """Scatter of the residuals over the standard errors."""
        return float(np.sqrt(self.chi_square / max(self.dof, 1)))

    @property
    def log_gain(self) -> Vector:
        """Fitted ln |G| at the readings, nepers."""
        return np.asarray(evaluate(self.readings.x, self.theta, self.sections)[0].real)

    @property
    def gain_off(self) -> Vector:
        """Gain over fitted gain at the readings, nepers."""
        return np.asarray(np.log(np.abs(self.readings.gain)) - self.log_gain)

    @property
    def off_db(self) -> float:
        """Root mean square of gain over fitted gain, dB."""
        return float(np.sqrt(np.mean(self.gain_off**2))) * DB_PER_NEPER

    @property
    def cost(self) -> float:
        """Minus twice the logarithm of the likelihood at the best scale, plus ln n a parameter.

        For fits whose errors are of different kinds, up to a factor.
        """
        n = self.readings.count
        scatter = n * np.log(max(self.chi_square, 1e-300) / n)
        return float(scatter + 2.0 * self.log_size + self.size * np.log(n))

    def criterion(self, scale: float) -> float:
        """Chi-square in units of a scale, plus what each parameter must gain; the least is best.

        A parameter must gain as two standard errors of it would (4), and a narrow section more,
        because it is looked for everywhere in the band (ln n).
        """
        narrow = sum(1 for one in self.sections if one.zeta is not None and one.zeta < NARROW)
        price = PRICE * self.size + narrow * float(np.log(self.readings.count))
        return self.chi_square / scale**2 + price


def fit_sections(
    readings: Readings, sections: tuple[Section, ...], *, iterations: int = 20
) -> Fit | None:
    """Fit sections and a surrounding to readings.

    Parameters
    ----------
    sections
        Start values; their number, kinds and sides stay.

    Returns
    -------
    The fit, or None where it has too few readings or the arithmetic fails.
    """
    problem = _Problem(readings, sections)
    if readings.count - problem.free.size < 4:
        return None
    try:
        theta = problem.surround(pack(sections))
    except np.linalg.LinAlgError:
        return None
    rounds = 1 if readings.absolute or not readings.with_phase.any() else _WEIGHINGS
    reference = np.abs(readings.gain)
    solved = None
    for _ in range(rounds):
        solved = problem.descend(theta, reference, iterations)
        if solved is None:
            return None
        theta = solved[0]
        if float(np.sum(solved[3] ** 2)) > _FAR**2 * readings.count:
            break
        reference = np.exp(evaluate(readings.x, theta, sections)[0].real)
    if solved is None:
        return None
    theta, flat, normal, residual = solved
    inverse = _inverse(normal)
    if inverse is None:
        return None
    covariance = np.zeros((theta.size, theta.size))
    covariance[np.ix_(problem.free, problem.free)] = inverse
    leverage = np.einsum("ki,ij,kj->k", flat, inverse, flat).reshape(2, -1).max(axis=0)
    along, across = problem.errors(reference)
    log_size = float(np.sum(np.log(along)) + np.sum(np.log(across[readings.with_phase])))
    return Fit(readings, unpack(theta, sections), theta, covariance, residual, leverage, log_size)


def _inverse(normal: Vector) -> Vector | None:
    diagonal = np.sqrt(np.diag(normal))
    if not np.all(np.isfinite(diagonal)) or np.any(diagonal <= 0.0):
        return None
    try:
        inverse = np.linalg.inv(normal / np.outer(diagonal, diagonal))
    except np.linalg.LinAlgError:
        return None
    if not np.all(np.isfinite(inverse)) or np.any(np.diag(inverse) <= 0.0):
        return None
    return inverse / np.outer(diagonal, diagonal)


class _Problem:
    """Residuals and descent of one set of sections."""

    def __init__(self, readings: Readings, sections: tuple[Section, ...]) -> None:
        self.readings, self.sections = readings, sections
        template = pack(sections)
        self.with_phase = bool(readings.with_phase.any())
        self.free = np.arange(template.size - (0 if self.with_phase else 2))
        prior = np.empty_like(template)
        centre = np.zeros_like(template)
        at = 0
        for section in sections:
            prior[at] = _PRIOR[0]
            if section.zeta is not None:
                prior[at + 1], centre[at + 1] = _PRIOR[1], np.log(0.1)
            at += section.size
        prior[at:] = _PRIOR_SURROUNDING
        self.prior, self.centre = prior[self.free], centre[self.free]
        self.zetas = np.flatnonzero(centre != 0.0)

    def errors(self, reference: Vector) -> tuple[Vector, Vector]:
        """Standard errors along and across, in the unit of the gain (log gain without phase)."""
        readings = self.readings
        if not self.with_phase:
            share = readings.along / reference if readings.absolute else readings.along
            return share, readings.across
        if readings.absolute:
            return readings.along, readings.across
        return readings.along * reference, readings.across * reference

    def residual(self, theta: Vector, reference: Vector) -> tuple[Vector, Vector]:
        """Residuals over errors, shape (2, points), and derivatives of the model over errors."""
        readings = self.readings
        log_gain, jacobian = evaluate(readings.x, theta, self.sections)
        along, across = self.errors(reference)
        if not self.with_phase:
            off = (np.log(np.abs(readings.gain)) - log_gain.real) / along
            part = jacobian[:, self.free].real / along[:, None]
            return np.stack([off, np.zeros_like(off)]), np.stack([part, np.zeros_like(part)])
        model = np.exp(log_gain)
        # Across and along the model's phasor; without a phase the reading lies on it.
        turn = np.exp(-1j * log_gain.imag)
        measured = np.where(readings.with_phase, readings.gain * turn, np.abs(readings.gain))
        off = measured - np.abs(model)
        slope = jacobian[:, self.free] * np.abs(model)[:, None]
        return (
            np.stack([np.real(off) / along, np.imag(off) / across]),
            np.stack([slope.real / along[:, None], slope.imag / across[:, None]]),
        )

    def surround(self, theta: Vector) -> Vector:
        """The surrounding that suits the sections best, by logarithms."""
        readings = self.readings
        value, jacobian = evaluate(readings.x, theta, self.sections)
        first = theta.size - SURROUNDING
        theta = theta.copy()
        weight = 1.0 / (readings.along / np.abs(readings.gain) if readings.absolute
                        else readings.along)  # fmt: skip
        weight = weight[:, None]
        real = slice(first, first + 2)
        off = np.log(np.abs(readings.gain)) - value.real
        theta[real] = np.linalg.lstsq(
            jacobian[:, real].real * weight, off * weight[:, 0], rcond=None
        )[0]
        if self.with_phase:
            rows = readings.with_phase
            turn = np.unwrap(np.angle(readings.gain[rows] * np.exp(-1j * value.imag[rows])))
            imag = slice(first + 2, None)
            theta[imag] = np.linalg.lstsq(
                jacobian[rows, imag].imag * weight[rows], turn * weight[rows, 0], rcond=None
            )[0]
        return theta

    def descend(
        self, theta: Vector, reference: Vector, iterations: int
    ) -> tuple[Vector, Vector, Vector, Vector] | None:
        """Levenberg's and Marquardt's steps; parameters, Jacobian, normal matrix and residuals."""

        def pull(at: Vector) -> Vector:
            return np.asarray((at[self.free] - self.centre) / self.prior)

        residual, part = self.residual(theta, reference)
        cost = float(np.sum(residual**2) + np.sum(pull(theta) ** 2))
        damping = 1e-3
        if not np.isfinite(cost):
            return None
        for _ in range(iterations):
            flat = part.reshape(-1, self.free.size)
            normal = flat.T @ flat + np.diag(1.0 / self.prior**2)
            slope = flat.T @ residual.ravel() - pull(theta) / self.prior
            lifted = normal + damping * np.diag(np.diag(normal))
            try:
                step = np.linalg.solve(lifted, slope)
            except np.linalg.LinAlgError:
                return None
            trial = theta.copy()
            trial[self.free] += np.clip(step, -2.0, 2.0)
            trial[self.zetas] = np.clip(trial[self.zetas], np.log(_LEAST_ZETA), np.log(_MOST_ZETA))
            new_residual, new_part = self.residual(trial, reference)
            new_cost = float(np.sum(new_residual**2) + np.sum(pull(trial) ** 2))
            if np.isfinite(new_cost) and new_cost <= cost:
                done = cost - new_cost < 1e-3 + 1e-4 * max(cost - self.readings.count * 4.0, 0.0)
                theta, residual, part = trial, new_residual, new_part
                cost, damping = new_cost, max(damping * 0.1, 1e-9)
                if done:
                    break
            else:
                damping *= 8.0
                if damping > 1e9:
                    break
        flat = part.reshape(-1, self.free.size)
        return theta, flat, flat.T @ flat + np.diag(1.0 / self.prior**2), residual
