"""Which pairs of causes are worth simulating: two causes' own runs laid over each other.

Owns the list of pairs and the guess that changes of features add up. The
guess only chooses what is simulated and where; it decides nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from analysis.ensemble.model import Hypothesis
from analysis.paper_diagnosis.emulator import FREEDOM
from analysis.paper_diagnosis.evidence import RatioPrior, reading_error, weighted_box
from analysis.paper_diagnosis.features import Reading
from analysis.paper_diagnosis.simulation import Explored
from sim.catalogue import CATALOGUE

__all__ = [
    "CHAIN", "DISSIPATION", "LOADS", "VISCOUS", "GuessedPair", "guess_pairs", "possible_pairs",
]  # fmt: skip

VISCOUS = ("load-viscous-damping", "shaft-damping", "mesh1-damping", "mesh2-damping")
"""What the paper calls missing damping: its model has none in the gear train or on the load."""

DISSIPATION = (
    *VISCOUS,
    "motor-viscous-friction",
    "load-coulomb-friction",
    "motor-coulomb-friction",
    "load-stribeck-friction",
)
"""Whatever takes energy out of the motion; one of each pair is one of these."""

LOADS = ("load-inertia", "payload-flexibility")
"""What the paper may mean by uncertainty of the load."""

CHAIN = tuple(effect.id for effect in CATALOGUE.values() if effect.site == "chain")
"""What is amiss in the measurement and not in the mechanics."""

_RATIOS, _SIZES = 8, 24
_HEAT, _MARGIN = 3.0, 0.1
"""How much wider than the guess says a pair is simulated."""


@dataclass(frozen=True, slots=True)
class GuessedPair:
    """Two effects, the guessed log-evidence, and where (d, 2) they are thought to agree."""

    effects: tuple[str, ...]
    log_evidence: float
    box: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Table:
    """What single runs show over ratios and sizes (s, d - 1); the others (ratios, s, 5)."""

    sizes: NDArray[np.float64]
    mean: NDArray[np.float64]
    scatter: NDArray[np.float64]
    shown: NDArray[np.float64]


def possible_pairs(effects: Collection[str]) -> list[tuple[str, str]]:
    """Pairs of which at least one takes energy out of the motion."""
    return [pair for pair in combinations(sorted(effects), 2) if set(pair) & set(DISSIPATION)]


def guess_pairs(
    baseline: Explored,
    singles: Sequence[Explored],
    reading: Reading,
    prior: RatioPrior,
    pairs: Collection[tuple[str, str]],
) -> list[GuessedPair]:
    """Pairs by how well their causes' changes, added up, agree with a reading; best first."""
    ratios = prior.draw((np.arange(_RATIOS) + 0.5) / _RATIOS)
    plain = _tabulate(baseline, ratios)
    tables = {one.effects[0]: _tabulate(one, ratios) for one in singles}
    unit = baseline.hypothesis.unit
    guessed = [
        _lay_over(Hypothesis(unit, pair), plain, tables, ratios, reading)
        for pair in pairs
        if set(pair) <= set(tables)
    ]
    return sorted(guessed, key=lambda one: -one.log_evidence)


def _tabulate(explored: Explored, ratios: NDArray[np.float64]) -> _Table:
    dimension = explored.hypothesis.d - 1
    sizes = np.empty((1, 0))
    if dimension:
        # A power of two is what Sobol's sequence is made for; a few less do no harm here.
        sizes = qmc.Sobol(dimension, rng=np.random.default_rng(0)).random(32)[:_SIZES]
    places = np.column_stack([np.repeat(ratios, len(sizes)), np.tile(sizes, (len(ratios), 1))])
    shape = (len(ratios), len(sizes), -1)
    mean, scatter, shown = (part.reshape(shape) for part in explored.surface.predict(places))
    return _Table(sizes, mean, scatter, shown)


def _lay_over(
    pair: Hypothesis,
    plain: _Table,
    tables: Mapping[str, _Table],
    ratios: NDArray[np.float64],
    reading: Reading,
) -> GuessedPair:
    first, second = (tables[effect] for effect in pair.effects)
    mean = first.mean[:, :, None] + second.mean[:, None] - plain.mean[:, :, None]
    scatter = np.maximum(first.scatter[:, :, None], second.scatter[:, None])
    shown = np.minimum(first.shown[:, :, None], second.shown[:, None])
    # How scatters go together is left out here: a guess need not know.
    std = np.hypot(scatter, reading_error(reading, pair.unit))
    z = np.where(np.isfinite(reading.values), (reading.values - mean) / std, 0.0)
    term = -0.5 * (FREEDOM + 1.0) * np.log1p(z**2 / FREEDOM) - np.log(std) + np.log(shown)
    log_likelihood = term[..., np.isfinite(reading.values)].sum(axis=-1).ravel()
    top = log_likelihood.max()
    likelihood = np.exp(log_likelihood - top)
    weight = likelihood ** (1.0 / _HEAT)
    index = np.indices(mean.shape[:3]).reshape(3, -1)
    places = np.column_stack([ratios[index[0]], first.sizes[index[1]], second.sizes[index[2]]])
    box = weighted_box(places, weight / weight.sum(), _MARGIN)
    return GuessedPair(pair.effects, float(top + np.log(likelihood.mean())), box)
