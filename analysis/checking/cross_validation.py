"""How well a hypothesis predicts what it has not been fitted to.

Owns the split: each source level in turn is kept away from the fit and then
predicted; where sweeps went both ways, so is each way of it, by fits that have seen neither that
level nor that way. Neighbouring frequencies are near-duplicates and are never split;
where all sweeps are of a single level each sweep takes its turn, and where there is but
one the halves of its band. What the other levels leave open is not fixed at their best fit: every
place that they allow predicts, as much as it is believed. It draws no conclusion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.emulator import Fit
from analysis.emulation.fitted_model import FittedModel
from analysis.execution.executor import side_by_side
from analysis.observation.observation import Observation
from daq.frf import DB_PER_NEPER

__all__ = ["HeldOut", "hold_out"]

_JUMPS = 0.01
"""Share of readings that no branch of the motion makes: where it goes over from one to another the
gain and the phase of a point or two lie anywhere, by 15 standard deviations in phase once."""

_TRIES = 4

_ENOUGH_ROWS = 0.4
"""Share of the rows of other levels that went the other way from which these alone predict."""

_Fold = tuple[slice, NDArray[np.bool_]]


@dataclass(frozen=True, slots=True, eq=False)
class HeldOut:
    """Prediction of every row by fits that have not seen its level.

    `score`: sum of the log densities of all rows, gain, phase and scatter.
    `residual`, `std` (3, rows): observed minus predicted, and its standard
    deviation (reading, simulated scatter, regression, and the place that the
    other levels leave open together).
    """

    score: float
    residual: NDArray[np.float64]
    std: NDArray[np.float64]

    @property
    def rms_sigma(self) -> float:
        """Root mean square of gain and phase over their standard deviation, as it is reported."""
        return self.rms_against(self.std)

    @property
    def missed(self) -> float:
        """That of all but the worst hundredth: what an explanation is held against."""
        squares = np.sort((self.residual[:2] / self.std[:2]) ** 2, axis=None)
        squares = squares[np.isfinite(squares)]
        return float(np.sqrt(np.mean(squares[: len(squares) - round(_JUMPS * len(squares))])))

    @property
    def rms_db(self) -> float:
        """Root mean square of the gain alone, dB."""
        return self.left(slice(None))[0]

    def left(self, rows: slice) -> tuple[float, float]:
        """Root mean square of the gain, dB, and of the phase, deg, by which some rows are missed.

        NaN of a phase that was not read.
        """
        squares = self.residual[:2, rows] ** 2
        gain, phase = (np.sqrt(np.mean(one[np.isfinite(one)])) if np.isfinite(one).any() else np.nan
                       for one in squares)  # fmt: skip
        return float(DB_PER_NEPER * gain), float(np.degrees(phase))

    def rms_against(self, std: NDArray[np.float64]) -> float:
        """Root mean square of gain and phase over standard deviations given (3, rows)."""
        return float(np.sqrt(np.nanmean((self.residual[:2] / std[:2]) ** 2)))


def hold_out(candidate: FittedModel, observation: Observation) -> HeldOut:
    """Predict every fold from the others, by fits on the way up from the best place."""
    surface, start = candidate.surface, candidate.best.place
    shape = (3, len(observation))
    residual, std = np.full(shape, np.nan), np.full(shape, np.nan)
    score = 0.0
    folds = split_folds(observation)

    def others_only(fold: _Fold) -> list[Fit]:
        return surface.walk(start, fold[1], tries=_TRIES)

    for (fold, _), fits in zip(folds, side_by_side(others_only, folds), strict=True):
        share = surface.shares(fits)
        left = np.stack([fit.residual[:, fold] for fit in fits])
        spread = np.stack([fit.std[:, fold] for fit in fits])
        density = np.stack([fit.density[:, fold] for fit in fits])
        residual[:, fold] = mean = np.tensordot(share, left, axes=1)
        std[:, fold] = np.sqrt(np.tensordot(share, spread**2 + (left - mean) ** 2, axes=1))
        score += float(np.log(np.tensordot(share, np.exp(density), axes=1)).sum())
    return HeldOut(score, residual, std)


def split_folds(observation: Observation) -> list[_Fold]:
    """Rows that are predicted at a time, and which of the others (rows,) that is done by."""
    down = _downwards(observation)
    if len(observation.levels) > 1 and 0 < down.sum() < len(down):
        return [(block, _strangers(observation, down, block)) for block in observation.blocks]
    for folds in (observation.levels, observation.blocks):
        if len(folds) > 1:
            return [(fold, _all_but(observation, fold)) for fold in folds]
    middle = len(observation) // 2
    halves = slice(0, middle), slice(middle, len(observation))
    return [(half, _all_but(observation, half)) for half in halves]


def _all_but(observation: Observation, fold: slice) -> NDArray[np.bool_]:
    rows = np.ones(len(observation), dtype=bool)
    rows[fold] = False
    return rows


def _downwards(observation: Observation) -> NDArray[np.bool_]:
    """Which rows (rows,) were swept downwards."""
    down = np.zeros(len(observation), dtype=bool)
    for plan, rows in observation.plans:
        down[rows] = plan.direction == "down"
    return down


def _strangers(
    observation: Observation, down: NDArray[np.bool_], block: slice
) -> NDArray[np.bool_]:
    """Rows (rows,) of other levels that went the other way; of other levels, where these are few.

    A further sweep of one level says little by itself.
    """
    elsewhere = observation.source_vpk != observation.source_vpk[block.start]
    strangers = elsewhere & (down != down[block.start])
    return strangers if strangers.sum() >= _ENOUGH_ROWS * elsewhere.sum() else elsewhere
