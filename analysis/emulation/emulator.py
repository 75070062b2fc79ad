"""What single runs of a hypothesis would read anywhere between the places simulated.

Owns local regression over a population, relative to one observation: the
mean of every channel at a place, how single runs scatter about it, how well
the observation agrees. It runs no simulation and compares no hypotheses.

Values are differences run minus observation, so that the phase need not be
unwrapped: near the right place the difference is small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.coordinates import FeatureMap
from analysis.emulation.kernel_data import Readings, Runs
from analysis.emulation.kernels import agree, weigh
from analysis.emulation.likelihood import TEMPERATURE
from analysis.emulation.regimes import Regimes
from analysis.ensemble.runs import Population
from analysis.execution.executor import side_by_side
from analysis.observation.observation import Observation

__all__ = ["TRIES", "Fit", "Emulator", "differences"]

_FLOOR = np.array([0.003, 0.003, 0.15])
"""What the regression itself gets wrong, by channel, in log units and rad."""

_STRIDES = (0.5, 0.25, 0.12, 0.06)
"""Reach of the random steps of a climb, as shares of what was simulated."""

TRIES = 12
"""Random steps of a climb per coordinate and reach, where it is to find the best place."""

_AT_ONCE = 64
"""Places that are looked at on one core before it takes the next ones."""

_UNALIKE = 1e-4
"""Weight of runs in another state of motion: they count only where there are no others."""

_MOST = 3.0
"""How many of the nearest runs take part in a regression at one row, as multiples of `enough`."""


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """How an observation agrees with a hypothesis at one place.

    `residual`, `std` (3, rows): observed minus expected at the best
    deviations, and the standard deviation of it; NaN where nothing was
    observed. `density` (3, rows): log density point by point, 0 there.
    `deviations` (k + 1,): datasheet values, the tachometer's gain last.
    """

    place: NDArray[np.float64]
    log_likelihood: float
    residual: NDArray[np.float64]
    std: NDArray[np.float64]
    density: NDArray[np.float64]
    deviations: NDArray[np.float64]


def differences(observation: Observation, population: Population) -> NDArray[np.float64]:
    """Runs minus observation (n, 3, rows); NaN where nothing was observed."""
    difference = population.channels(observation) - observation.values
    difference[:, 1] = np.angle(np.exp(1j * difference[:, 1]))
    return difference


@dataclass(frozen=True, eq=False)
class Emulator:
    """Local regression over the runs of one hypothesis.

    Parameters
    ----------
    observation
        What the runs are compared with.
    places
        (n, d).
    difference
        (n, 3, rows), see `differences`; deviations taken out where slopes are known.
    width
        (k,): distance over which a response changes smoothly, in the coordinates of `chart`.
    slopes
        (k, 3, rows): change of the channels per unit of each deviation, or no rows.
    sigmas
        (k,): prior standard deviations of the deviations.
    motions
        States of the runs and of the observation: where they differ a run tells nothing.
    gain
        Prior standard deviation of what scales the whole response, the tachometer's gain, a share.
    enough
        How many runs a regression takes, by their weights.
    tailed
        Whether scatter is fitted as Student's t (slower) or as a mean square.
    chart
        Coordinates in which runs are compared; their places if not given.
    coordinates
        (1 or rows, n, k) of the runs, where not all are the hypothesis's own.
    """

    observation: Observation
    places: NDArray[np.float64]
    difference: NDArray[np.float64]
    width: NDArray[np.float64]
    slopes: NDArray[np.float64]
    sigmas: NDArray[np.float64]
    motions: Regimes
    gain: float
    enough: float
    tailed: bool = True
    chart: FeatureMap | None = None
    coordinates: NDArray[np.float64] | None = None

    def scan(self, grid: NDArray[np.float64], leaning: bool = False) -> NDArray[np.float64]:
        """Log-likelihood (count,) at places (count, d).

        `leaning`: whether deviations are fitted; else they are left in the scatter.
        """
        charted = np.ascontiguousarray(self.on_chart(grid).swapaxes(0, 1))
        known = self._runs, self._readings
        found = side_by_side(
            lambda part: agree(*known, part, self._every_row, leaning)[0],
            np.array_split(charted, -(-len(charted) // _AT_ONCE)),
        )
        return np.concatenate(found)

    def expected(self, place: NDArray[np.float64]) -> tuple[NDArray, NDArray]:
        """Mean difference (3, rows) of runs at a place, and the scatter of a single run there."""
        asked = self._every_row
        _, residual, std, *_ = agree(
            self._runs, self._readings, self._charted_at(place)[None], asked, False
        )
        return -residual, std

    def fit(self, place: NDArray[np.float64], rows: NDArray[np.bool_] | None = None) -> Fit:
        """Agreement at a place, deviations fitted to some rows (all where None)."""
        asked = self._every_row if rows is None else rows
        likelihoods, residual, std, density, deviations = agree(
            self._runs, self._readings, self._charted_at(place)[None], asked, True
        )
        return Fit(place, float(likelihoods[0]), residual, std, density, deviations)

    def climb(self, start: NDArray[np.float64], tries: int = TRIES) -> Fit:
        """The best fit, by ever finer random steps inside what was simulated.

        `tries` per coordinate and step size.
        """
        return max(self.walk(start, tries=tries), key=lambda fit: fit.log_likelihood)

    def walk(
        self, start: NDArray[np.float64], rows: NDArray[np.bool_] | None = None, tries: int = TRIES
    ) -> list[Fit]:
        """Every fit that a climb looks at, the start first."""
        low, high = self.places.min(axis=0), self.places.max(axis=0)
        span = np.maximum(high - low, 1e-9)
        rng = np.random.default_rng(0)
        best = self.fit(np.clip(start, low, high), rows)
        fits = [best]
        for reach in _STRIDES:
            for _ in range(tries * len(start)):
                step = span * reach * rng.uniform(-1.0, 1.0, len(start))
                found = self.fit(np.clip(best.place + step, low, high), rows)
                fits.append(found)
                if found.log_likelihood > best.log_likelihood:
                    best = found
        return fits

    def of(self, runs: NDArray[np.bool_]) -> Emulator:
        """The surface over some of the runs (n,)."""
        return replace(
            self,
            places=self.places[runs],
            difference=self.difference[runs],
            motions=self.motions.of(runs),
            coordinates=self._charted[:, runs],
        )

    def against(self, as_read: NDArray[np.float64], quiet: NDArray[np.bool_]) -> Emulator:
        """The same surface relative to something else that was read.

        `as_read` (3, rows): that minus the observation; `quiet` (rows,): its state of motion.
        """
        difference = self.difference - as_read
        difference[:, 1] = np.angle(np.exp(1j * difference[:, 1]))
        motions = self.motions.against(quiet)
        return replace(self, difference=difference, motions=motions, coordinates=self._charted)

    def shares(self, fits: Sequence[Fit]) -> NDArray[np.float64]:
        """How much each place (count,) of a walk is believed, by the rows it was fitted to.

        Weights of importance: as steps shrink, a walk looks more often near the best place than
        that place is likely, so that each fit counts less by as much.
        """
        best = max(fits, key=lambda fit: fit.log_likelihood)
        span = np.maximum(np.ptp(self.places, axis=0), 1e-9)
        far = np.array([np.max(np.abs(fit.place - best.place) / span) for fit in fits])
        reaches = np.array(_STRIDES)
        # A start, or an early step, may lie outside them all.
        inside = np.minimum(far, reaches.max())[:, None] <= reaches
        drawn = np.sum(inside / reaches ** len(span), axis=1)
        weight = (
            np.exp([(fit.log_likelihood - best.log_likelihood) / TEMPERATURE for fit in fits])
            / drawn
        )
        return np.asarray(weight / weight.sum())

    def lost(self, place: NDArray[np.float64]) -> int:
        """How many rows no run near a place shows as they were observed."""
        near = weigh(self.distance(place), self.enough)
        return int(np.count_nonzero(near @ self.motions.alike < 1.0))

    def distance(self, place: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far (n,) the runs are from a place, in widths squared, over all rows."""
        offset = (self._charted - self._charted_at(place)[:, None]) / self.width
        return np.asarray(np.einsum("rnk,rnk->n", offset, offset) / len(offset))

    def on_chart(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Coordinates (1 or rows, m, k) of places (m, d) in which runs are compared."""
        return places[None] if self.chart is None else self.chart(places)

    def _charted_at(self, place: NDArray[np.float64]) -> NDArray[np.float64]:
        """A place in the chart (1 or rows, k)."""
        return np.ascontiguousarray(self.on_chart(place[None])[:, 0])

    @cached_property
    def _charted(self) -> NDArray[np.float64]:
        """(1 or rows, n, k): the runs in the coordinates in which they are compared."""
        return self.on_chart(self.places) if self.coordinates is None else self.coordinates

    @cached_property
    def alike(self) -> NDArray[np.float64]:
        """(n, rows): 1 where a run does as was observed, else next to nothing."""
        return np.maximum(self.motions.alike, _UNALIKE)

    @cached_property
    def _every_row(self) -> NDArray[np.bool_]:
        return np.ones(len(self.observation), dtype=bool)

    @cached_property
    def _runs(self) -> Runs:
        """The runs in the form that is computed with."""
        noise, mixed = self.observation.noise, self.motions.mixed
        return Runs(
            charted=np.ascontiguousarray(self._charted.swapaxes(1, 2), dtype=float),
            width=np.asarray(self.width, dtype=float),
            enough=float(self.enough),
            most=int(_MOST * self.enough),
            tailed=self.tailed,
            plain=self._values[~mixed].reshape(-1, self._values.shape[2]),
            plain_rows=np.flatnonzero(~mixed),
            mixed=self._values[mixed],
            mixed_rows=np.flatnonzero(mixed),
            values=self._values,
            alike=np.ascontiguousarray(self.alike.T),
            neighbours=Runs.smoothed_over(list(self.observation.blocks)),
            # Of reading and regression, apart from the runs' own.
            least=np.stack([noise**2, noise**2, 0.0 * noise]) + _FLOOR[:, None] ** 2,
        )

    @cached_property
    def _readings(self) -> Readings:
        """What was observed, in the form that is computed with."""
        gain = np.zeros((1, *self.difference.shape[1:]))
        gain[0, 0] = 1.0
        # The tachometer's gain comes last.
        slopes = np.concatenate([self.slopes, gain]).reshape(len(self.sigmas) + 1, -1)
        return Readings(
            np.ascontiguousarray(np.isfinite(self.observation.values)),
            # Solved slopes lie column by column, and what is computed goes along rows.
            np.ascontiguousarray(slopes),
            np.append(self.sigmas, self.gain),
            *self.motions.course,
        )

    @cached_property
    def _values(self) -> NDArray:
        """(rows, 3, n): the differences, 0 where nothing was observed.

        In single precision: seven digits of a difference are more than it deserves.
        """
        known = np.nan_to_num(self.difference).transpose(2, 1, 0)
        return np.ascontiguousarray(known, dtype=np.float32)
