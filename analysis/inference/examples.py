"""Training examples: what a bench would have read of the runs of a batch.

Owns the bench's part of the prior: reading noise, missing points, levels, phase and scatter. Each
call draws it anew, so that one run serves many sweeps. It simulates nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.inference.checkpoint import Checkpoint
from analysis.inference.inputs import SweptLevels, network_inputs
from analysis.inference.network import Architecture
from analysis.inference.nominal import expected, relative
from analysis.inference.plans import Landmarks, landmarks, reference_response
from analysis.inference.prior import COUNTS, Prior
from analysis.inference.runs import Batch
from analysis.inference.sets import CauseSets
from analysis.observation.reading_noise import QUIET_SHARE, USUAL_NOISE_V, scatter_sampling
from sim.catalogue import not_of_unit
from sim.unit import Unit

__all__ = ["ROWS", "Examples", "Scales", "conditions", "estimated_noise", "read_batch"]

ROWS = (3, 5)
"""Levels that examples are padded to in training; answers may have more."""

_BAND = 0.25
"""Largest share of the band that may be missing from an example."""

_NOISE_V = (1e-4, 3e-3)


@dataclass(frozen=True, slots=True, eq=False)
class Examples:
    """n examples: inputs of the network and what is true.

    `points`, `rows`, `conditions`: see `analysis.inference.network.summarise`. `set` (n,): number
    of the true set; `chosen` (n, E): its members. `ratio` (n,); `size` (n, P) and `error` (n, T)
    as the densities have them, NaN where there is none; `total` (n,), NaN where it is known.
    """

    points: NDArray[np.float32]
    rows: NDArray[np.float32]
    conditions: NDArray[np.float32]
    set: NDArray[np.int32]
    chosen: NDArray[np.float32]
    ratio: NDArray[np.float32]
    size: NDArray[np.float32]
    error: NDArray[np.float32]
    total: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.set)

    def taken(self, which: NDArray[np.int64] | slice) -> Examples:
        """Some of them."""
        return Examples(*(getattr(self, f.name)[which] for f in fields(self)))

    @staticmethod
    def joined(parts: list[Examples]) -> Examples:
        """All of several."""
        return Examples(
            *(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(Examples))
        )


@dataclass(frozen=True)
class Scales:
    """What turns physical values of one unit into numbers of order one."""

    prior: Prior
    marks: Landmarks
    most_v: float

    @classmethod
    def of(cls, unit: Unit, borrowed: bool = False) -> Scales:
        """Scales of a unit of which none are known yet: a few machines are simulated."""
        return cls(Prior(unit, borrowed), landmarks(unit), unit.limits.source_vpk)

    @classmethod
    def from_facts(cls, unit: Unit, known: Checkpoint) -> Scales:
        """Scales that a posterior was trained with."""
        return cls(Prior(unit), Landmarks(known.arf_hz, known.rf_hz), known.most_v)

    @cached_property
    def sets(self) -> CauseSets:
        """Sets of causes that the posterior of the unit tells apart."""
        return CauseSets(self.prior.effects, tuple(map(float, self.prior.weights)), COUNTS)

    @cached_property
    def size_ends(self) -> NDArray[np.float64]:
        """(P, 2): logarithms of the ends of each size's range."""
        foreign = not_of_unit(self.prior.unit)
        ends = [
            (1.0, 2.0) if effect in foreign else p.range(self.prior.unit)
            for effect, p in self.prior.parameters
        ]
        return np.log(np.array([(max(low, 0.01 * high), high) for low, high in ends]))

    def place(self, effect: str, parameter: str) -> int:
        """Where a size stands among all of them."""
        names = [(e, p.name) for e, p in self.prior.parameters]
        return names.index((effect, parameter))

    def architecture(self, **shape: Any) -> Architecture:
        """A network for the unit; see `Architecture` for its shape."""
        prior = self.prior
        counts = len(prior.effects), len(prior.parameters), len(prior.symbols)
        return Architecture(*counts, **shape)

    def inputs(
        self, swept: SweptLevels, departures: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Arrays of points and rows of a sweep of the unit."""
        marks = self.marks.arf_hz, self.marks.rf_hz
        reference = reference_response(self.prior.unit, swept.frequency_hz)
        return network_inputs(swept, reference, marks, self.most_v, departures)


def conditions(
    tolerance: NDArray[np.float32],
    total_known: NDArray[np.bool_],
    scatter_known: NDArray[np.bool_],
    phase_known: NDArray[np.bool_],
) -> NDArray[np.float32]:
    """What is known beforehand, as the network reads it (n, T + 3)."""
    share = np.log(np.maximum(tolerance, 5e-4) / 0.01) / 2.0
    flags = np.stack([total_known, scatter_known, phase_known], axis=1)
    return np.concatenate([share, flags], axis=1).astype(np.float32)


def estimated_noise(
    scatter: NDArray[np.float32], gain: NDArray[np.complex64], levels_vpk: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Reading noise (n,) per component, V: what the quietest points show.

    `scatter` (n, L, F): relative scatter of the mean over both components, NaN where not known.
    """
    volts = (scatter * np.abs(gain) * levels_vpk[:, None]).reshape(len(scatter), -1)
    found = np.full(len(volts), USUAL_NOISE_V, dtype=np.float32)
    known = np.isfinite(volts).any(axis=1)
    if np.any(known):
        quiet = np.nanquantile(volts[known], QUIET_SHARE, axis=1)
        found[known] = np.maximum(quiet, 1e-9) / np.sqrt(2.0)
    return found


def read_batch(
    scales: Scales, batch: Batch, rng: np.random.Generator, degrade: bool = True
) -> Examples:
    """Read the runs of a batch as a bench would.

    Parameters
    ----------
    degrade
        Whether levels, points, phase and scatter may be missing.
    """
    levels, columns = _kept(batch, rng) if degrade else _all_of(batch)
    frequency_hz = np.asarray(batch.plan.frequencies_hz)[columns]
    levels_vpk = np.asarray(batch.plan.levels_vpk)[levels]
    mean = batch.mean[:, levels][:, :, columns]
    variance = batch.variance[:, levels][:, :, columns]
    count = len(mean)
    usual = rng.random(count) < 0.5
    low, high = np.log(_NOISE_V)
    drawn = np.exp(rng.uniform(low, high, count))
    noise_v = np.where(usual, USUAL_NOISE_V, drawn)
    noise = (noise_v[:, None, None] / levels_vpk[:, None]).astype(np.float32)
    if degrade:
        # Another realisation of the cycles that were averaged, so that no run is learned by heart.
        share = np.sqrt(0.5 * variance) * rng.random((count, 1, 1), dtype=np.float32)
        again = rng.standard_normal((2, *mean.shape), dtype=np.float32) * share
        mean = mean * (1.0 + again[0] + 1j * again[1])
    added = rng.standard_normal((2, *mean.shape), dtype=np.float32) * noise
    gain = mean + added[0] + 1j * added[1]
    size = np.maximum(np.abs(gain), 1e-9)
    # The noise of so many cycles scatters, too; that of the motion was simulated.
    sampling = np.float32(scatter_sampling(batch.plan.integrate_cycles))
    shown = np.exp(sampling * rng.standard_normal(mean.shape, dtype=np.float32)) * noise / size
    scatter = np.sqrt(variance * (np.abs(mean) / size) ** 2 + 2.0 * shown**2)
    scatter_known = rng.random(count) < (0.85 if degrade else 1.0)
    phase_known = rng.random(count) < (0.92 if degrade else 1.0)
    scatter = np.where(scatter_known[:, None, None], scatter, np.nan).astype(np.float32)
    if degrade:
        lost = _unread_band(count, len(columns), rng)
        if rng.random() < 0.15:
            lost = lost | (rng.random(gain.shape) < 0.1)
        gain, scatter = np.where(lost, np.nan, gain), np.where(lost, np.nan, scatter)
    plan = batch.plan
    swept = SweptLevels(
        frequency_hz,
        levels_vpk,
        gain.astype(np.complex64),
        scatter * np.sqrt(np.float32(plan.integrate_cycles)),
        estimated_noise(scatter, gain, levels_vpk),
        phase_known[:, None, None],
        plan.direction == "down",
        plan.settle_cycles,
        plan.integrate_cycles,
        plan.dc_offset_v,
    )
    plain = (
        batch.plain_mean[:, levels][:, :, columns],
        batch.plain_variance[:, levels][..., columns],
    )
    (departures,), believed = relative([(swept, expected(*plain))])
    points, facts = scales.inputs(swept, departures)
    padded, rows = _padded(points, facts)
    index, (low, high) = scales.sets.index, scales.size_ends.T
    with np.errstate(divide="ignore", invalid="ignore"):
        errors = np.where(batch.tolerance > 0.0, batch.errors / batch.tolerance, np.nan)
    return Examples(
        points=padded,
        rows=rows,
        conditions=np.concatenate(
            [conditions(batch.tolerance, batch.total_known, scatter_known, phase_known), believed],
            axis=1,
        ),
        set=np.array(
            [index[tuple(np.flatnonzero(e).tolist())] for e in batch.effects], dtype=np.int32
        ),
        chosen=batch.effects.astype(np.float32),
        ratio=batch.ratio,
        size=((np.log(np.abs(batch.sizes)) - low) / (high - low)).astype(np.float32),
        error=errors.astype(np.float32),
        total=np.where(batch.total_known, np.nan, np.log(batch.total_backlash)).astype(np.float32),
    )


def _all_of(batch: Batch) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    return np.arange(len(batch.plan.levels_vpk)), np.arange(len(batch.plan.frequencies_hz))


def _kept(batch: Batch, rng: np.random.Generator) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Levels and points that the bench read: sometimes some of them alone."""
    levels, columns = _all_of(batch)
    if len(levels) > 1 and rng.random() < 0.3:
        levels = np.sort(rng.choice(levels, rng.integers(1, len(levels)), replace=False))
    if len(columns) >= 30 and rng.random() < 0.15:
        columns = columns[rng.integers(2) :: 2]
    return levels, columns


def _unread_band(count: int, columns: int, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Points (n, 1, F) of a band that half of the examples lack at every level."""
    width = rng.uniform(0.0, _BAND, count) * columns * (rng.random(count) < 0.5)
    start = rng.random(count) * (columns - width)
    place = np.arange(columns)
    found = (place >= start[:, None]) & (place < (start + width)[:, None])
    return np.asarray(found[:, None, :])


def _padded(
    points: NDArray[np.float32], facts: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Bring examples to one of the numbers of rows, and say which are there."""
    count, levels = facts.shape[:2]
    most = next(rows for rows in ROWS if rows >= levels)
    padded = np.zeros((count, most, *points.shape[2:]), dtype=np.float32)
    rows = np.zeros((count, most, facts.shape[2] + 1), dtype=np.float32)
    padded[:, :levels], rows[:, :levels, :-1], rows[:, :levels, -1] = points, facts, 1.0
    return padded, rows
