"""Posterior of coordinates by linear regression on what simulated drives show.

Owns the regression of coordinates on summaries of a sweep, and the correction from the draw to the
prior. It simulates nothing.

Method: semi-automatic summary statistics (Fearnhead and Prangle 2012), linear regression
adjustment (Beaumont, Zhang and Balding 2002), and the correction for a Gaussian proposal of
Papamakarios and Murray 2016.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, cholesky, eigh

from analysis.commissioning.response_model import ResponseModel

Vector = NDArray[np.float64]

__all__ = ["Gaussian", "Regressed", "Round", "expected_std", "regress"]

_WIDER, _NARROWEST = 1.5, 0.35
"""Drives are drawn so much wider than the last round's posterior, as a regression says nothing
beyond the drives that it has seen; and in no direction narrower than this share of the last draw,
as a response bends far from where it was linearised."""

_FOLDS = 5


@dataclass(frozen=True, slots=True, eq=False)
class Gaussian:
    """A normal distribution of coordinates: `mean` (d,), `covariance` (d, d)."""

    mean: Vector
    covariance: Vector

    @property
    def std(self) -> Vector:
        """Standard deviations (d,)."""
        return np.sqrt(np.diag(self.covariance))

    def draw(self, rng: np.random.Generator, count: int) -> Vector:
        """Coordinates (count, d) by chance."""
        values, vectors = eigh(self.covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        return self.mean + rng.standard_normal((count, len(self.mean))) @ root.T

    def proposal(self, last: Gaussian) -> Gaussian:
        """Where to draw next: wider than this posterior, not far narrower than the last draw."""
        root = cholesky(last.covariance, lower=True)
        inverse = np.linalg.inv(root)
        values, vectors = eigh(_WIDER**2 * inverse @ self.covariance @ inverse.T)
        turned = root @ vectors
        kept = np.clip(values, _NARROWEST**2, 1.0)
        return Gaussian(self.mean, (turned * kept) @ turned.T)


@dataclass(frozen=True, slots=True, eq=False)
class Round:
    """Simulated drives: coordinates `z` (n, d), `families` (n,) and channels `y` (n, rows).

    `angles` (rows,): which channels are angles, rad, known but for whole turns; None is none.
    `series` (rows,): see `ResponseModel.fit`.
    """

    z: Vector
    families: NDArray[np.int64]
    y: Vector
    angles: NDArray[np.bool_] | None = None
    series: NDArray[np.int64] | None = None

    def series_of(self, columns: NDArray[np.bool_]) -> NDArray[np.int64] | None:
        """The series of some of the rows."""
        return None if self.series is None else self.series[columns]

    def near(self, values: Vector) -> Vector:
        """Channels (..., rows) with angles within half a turn of the mean of the drives."""
        if self.angles is None:
            return values
        middle = np.angle(np.mean(np.exp(1j * self.y[:, self.angles]), axis=0))
        found = values.copy()
        found[..., self.angles] = middle + np.angle(
            np.exp(1j * (values[..., self.angles] - middle))
        )
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Regressed:
    """A posterior, and how the measurement stands among the simulated drives.

    `misfit`: what is left of it over what is left of them, both as root mean square in standard
    deviations; `misfit_rank`: share of them of which less is left.
    """

    posterior: Gaussian
    misfit: float
    misfit_rank: float


def regress(
    drawn: Round,
    measured: Vector,
    proposal: Gaussian,
    prior: Gaussian,
    *,
    earlier: Sequence[Round] = (),
    last: bool = True,
) -> Regressed:
    """The posterior given the measurement, by what the drives of one round show.

    Those of `earlier` rounds add to what is known of the slopes. Only the posterior of the `last`
    round is widened where the measurement fits worse than the drives do: before, the drives are not
    where it is.
    """
    seen = np.isfinite(measured) & np.all(np.isfinite(drawn.y), axis=0)
    y, x = drawn.near(drawn.y)[:, seen], (drawn.z - proposal.mean) / proposal.std
    others = [
        ((one.z - proposal.mean) / proposal.std, drawn.near(one.y)[:, seen]) for one in earlier
    ]
    others = [(a, b) for a, b in others if np.all(np.isfinite(b))]
    series = drawn.series_of(seen)
    target = drawn.near(measured)[seen]
    folds = drawn.families % _FOLDS
    summaries, left = np.empty_like(x), np.empty_like(y)
    for fold in range(_FOLDS):
        out = folds == fold
        model = ResponseModel.fit(x[~out], y[~out], series, others)
        summaries[out] = model.estimate(y[out])
        left[out] = model.remainder(y[out])
    model = ResponseModel.fit(x, y, series, others)
    summary, remainder = model.estimate(target[None])[0], model.remainder(target[None])[0]
    # Parameters are regressed on the estimates of drives that the model has not seen.
    basis = np.column_stack([np.ones(len(x)), summaries])
    coefficients = np.linalg.lstsq(basis, x, rcond=None)[0]
    basis_at = np.concatenate([[1.0], summary])
    at = np.asarray(basis_at @ coefficients, dtype=float)
    errors = x - basis @ coefficients
    families = len(np.unique(drawn.families))
    # Drives of a family differ little: as many say something of their own as there are families.
    share = families / len(x)
    spare = max(families - basis.shape[1], 1)
    leverage = basis_at @ np.linalg.solve(share * basis.T @ basis, basis_at)
    scatter = share * errors.T @ errors / spare * (1.0 + leverage)
    size = np.sqrt(np.mean(left**2, axis=1))
    own = float(np.sqrt(np.mean(remainder**2)))
    misfit = own / float(np.median(size))
    posterior = _corrected(
        Gaussian(at, scatter), _standardised(proposal), _standardised(prior, proposal),
        max(misfit, 1.0) if last else 1.0,
    )  # fmt: skip
    std = proposal.std
    found = Gaussian(
        proposal.mean + posterior.mean * std, posterior.covariance * np.outer(std, std)
    )
    return Regressed(found, misfit, float(np.mean(size < own)))


def expected_std(
    drawn: Round, proposal: Gaussian, columns: NDArray[np.bool_], quantity: Vector
) -> float:
    """Error that a linear estimate of a quantity (n,) has by some columns (rows,) of a sweep.

    Root mean square over drives that the estimate has not seen.
    """
    known = columns & np.all(np.isfinite(drawn.y), axis=0)
    y, x = drawn.near(drawn.y)[:, known], (drawn.z - proposal.mean) / proposal.std
    folds, left = drawn.families % _FOLDS, np.empty(len(x))
    for fold in range(_FOLDS):
        out = folds == fold
        model = ResponseModel.fit(x[~out], y[~out], drawn.series_of(known))
        basis = [np.column_stack([np.ones(k.sum()), model.estimate(y[k])]) for k in (~out, out)]
        coefficients = np.linalg.lstsq(basis[0], quantity[~out], rcond=None)[0]
        left[out] = quantity[out] - basis[1] @ coefficients
    return float(np.sqrt(np.mean(left**2)))


def _standardised(one: Gaussian, by: Gaussian | None = None) -> Gaussian:
    by = by or one
    return Gaussian((one.mean - by.mean) / by.std, one.covariance / np.outer(by.std, by.std))


def _corrected(found: Gaussian, proposal: Gaussian, prior: Gaussian, birge: float) -> Gaussian:
    """The posterior under a prior, of one under a proposal: what the data say is their ratio.

    Where they fit worse than simulated drives do, their errors are larger by as much: the Birge
    ratio (Birge 1932).

    What the data say is no negative information; directions in which chance makes it so are left
    to the prior.
    """
    under, drawn = np.linalg.inv(found.covariance), np.linalg.inv(proposal.covariance)
    # In the eigenvectors of the data's information relative to the proposal.
    values, vectors = eigh(under - drawn, drawn)
    told = np.maximum(values, 0.0) / birge**2
    # eigh: V^T drawn V = 1, so drawn V is the inverse of V^T.
    back = drawn @ vectors
    information = (back * told) @ back.T
    # The mean that the data alone say, by the same directions.
    shift = vectors.T @ (under @ found.mean - drawn @ proposal.mean)
    pull = back @ np.where(values > 0.0, shift, 0.0) / birge**2
    own = np.linalg.inv(prior.covariance)
    factor = cho_factor(information + own)
    covariance = cho_solve(factor, np.eye(len(own)))
    return Gaussian(cho_solve(factor, pull + own @ prior.mean), covariance)
