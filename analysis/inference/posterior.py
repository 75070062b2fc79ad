"""The amortised posterior of a unit, asked about one observation.

Owns the way from an observation to the probability of every set of causes, and to contribution
ratio and sizes given a set, in milliseconds and without simulation. It must not load a training
library, and refines nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble.model import Hypothesis
from analysis.execution.executor import Executor
from analysis.inference.checkpoint import Checkpoint, find_checkpoint, shipped_checkpoints
from analysis.inference.examples import Scales, conditions
from analysis.inference.exclusion import ExclusionLimit
from analysis.inference.inputs import SweptLevels
from analysis.inference.network import Densities, densities, set_logits, summarise
from analysis.inference.nominal import Nominal, nominal_of, relative, remembering
from analysis.inference.prior import Prior
from analysis.observation.observation import Observation
from sim.catalogue import CATALOGUE, not_of_unit
from sim.unit import Unit

__all__ = ["Posterior", "SetPosterior", "lent_checkpoint", "limits", "swept_levels"]

_WIDE = 1.96
"""Standard deviations of a 95 % interval."""


@dataclass(frozen=True, slots=True, eq=False)
class SetPosterior:
    """What is believed given one set of causes.

    `effects` by identifier, `probability` of the set. `ratio` (bins,): probability of each of
    equal parts of 0 to 1. `sizes`: mean and standard deviation of the natural logarithm of each
    size by (effect, parameter).
    """

    effects: tuple[str, ...]
    probability: float
    ratio: NDArray[np.float64]
    sizes: Mapping[tuple[str, str], tuple[float, float]]

    @property
    def ratio_mean(self) -> float:
        """Mean of the contribution ratio."""
        return float(self.ratio @ _centres(len(self.ratio)))

    @property
    def ratio_std(self) -> float:
        """Standard deviation of the contribution ratio."""
        variance = self.ratio @ (_centres(len(self.ratio)) - self.ratio_mean) ** 2
        return float(np.sqrt(variance + 1.0 / (12.0 * len(self.ratio) ** 2)))


@dataclass(frozen=True, eq=False)
class Posterior:
    """The trained posterior of one unit.

    `nominal`: the datasheet's machine in the sweep of an observation. `lent_by`: the unit that it
    was trained for, where that is another one, else empty.
    """

    scales: Scales
    checkpoint: Checkpoint
    nominal: Callable[[Observation], Nominal]
    lent_by: str = ""

    @classmethod
    def find(
        cls, unit: Unit, cache: Path | None = None, executor: Executor | None = None
    ) -> Posterior | None:
        """The posterior of a unit, from the cache or as it comes with lashbench.

        Where there is none, that of another unit: it reads an observation relative to the
        datasheet, so that much of what it learned holds.
        """
        nominal = remembering(partial(nominal_of, unit, cache=cache, executor=executor))
        found = find_checkpoint(unit, cache)
        if found is not None:
            return cls(Scales.from_facts(unit, found), found, nominal)
        lent = lent_checkpoint(unit)
        return (
            None if lent is None else cls(Scales.of(unit, borrowed=True), lent, nominal, lent.unit)
        )

    def summary(
        self,
        observation: Observation,
        tolerance: Mapping[str, float],
        total_known: bool = True,
        readings: NDArray[np.float64] | None = None,
    ) -> NDArray[np.float32]:
        """What the network keeps of an observation (1, hidden), or of others in its sweep.

        Parameters
        ----------
        tolerance
            Believed standard deviation of datasheet values by symbol, as shares; 0 where a symbol
            is not named.
        total_known
            Whether the total backlash of the datasheet may be relied on.
        readings
            Channels (n, 3, rows) of n readings in the same sweep; those of the observation if not
            given.
        """
        values = observation.values[None] if readings is None else readings
        sweeps = swept_levels(observation, values)
        nominal = [self.nominal(part) for part, _ in observation.by_plan()]
        departures, believed = relative(list(zip(sweeps, nominal, strict=True)))
        parts = [self.scales.inputs(*one) for one in zip(sweeps, departures, strict=True)]
        points = np.concatenate([p for p, _ in parts], axis=1)
        facts = np.concatenate([f for _, f in parts], axis=1)
        rows = np.concatenate([facts, np.ones((*facts.shape[:2], 1), dtype=np.float32)], axis=2)
        shares = [tolerance.get(symbol, 0.0) for symbol in self.scales.prior.symbols]
        known = [np.isfinite(observation.values[channel]).any() for channel in (2, 1)]
        condition = conditions(
            np.tile(np.array(shares, dtype=np.float32), (len(values), 1)),
            *(np.full(len(values), one) for one in (total_known, *known)),
        )
        condition = np.concatenate([condition, believed], axis=1)
        return np.asarray(
            summarise(self.checkpoint.weights, self.checkpoint.shape, points, rows, condition)
        )

    def set_probabilities(
        self, summary: NDArray[np.float32], without: Sequence[str] = ()
    ) -> NDArray[np.float64]:
        """Posterior probability (sets,) of every set of causes; 0 with an effect left out.

        Or with one that the unit cannot have.
        """
        logits = set_logits(self.checkpoint.weights, self.scales.sets, summary)[0].astype(float)
        foreign = not_of_unit(self.scales.prior.unit)
        places = [i for i, e in enumerate(self.scales.prior.effects) if e in {*without, *foreign}]
        logits[np.isin(self.scales.sets.members, places).any(axis=1)] = -np.inf
        weight = np.exp(logits - logits.max())
        return np.asarray(weight / weight.sum())

    def given(
        self, summary: NDArray[np.float32], number: int, probability: float = 1.0
    ) -> SetPosterior:
        """Contribution ratio and sizes given the set of a number."""
        sets, shape = self.scales.sets, self.checkpoint.shape
        chosen = np.zeros((1, shape.effects), dtype=np.float32)
        chosen[0, list(sets.places[number])] = 1.0
        found: Densities = densities(self.checkpoint.weights, shape, summary, chosen)
        logits = np.asarray(found.ratio[0], dtype=float)
        ratio = np.exp(logits - logits.max())
        names, (low, high) = sets.names(number), self.scales.size_ends.T
        sizes = {}
        for place, (effect, parameter) in enumerate(self.scales.prior.parameters):
            if effect in names:
                stretch = high[place] - low[place]
                mean = low[place] + stretch * float(found.size_mean[0, place])
                std = stretch * float(np.exp(found.size_log_std[0, place]))
                sizes[effect, parameter.name] = (mean, std)
        return SetPosterior(names, probability, ratio / ratio.sum(), sizes)


def lent_checkpoint(unit: Unit) -> Checkpoint | None:
    """A posterior of another unit, trained for the causes and values of the paper's units."""
    prior = Prior(unit, borrowed=True)
    counts = len(prior.effects), len(prior.parameters), len(prior.symbols)
    for one in shipped_checkpoints():
        shape = one.shape
        if (shape.effects, shape.parameters, shape.symbols) == counts:
            return one
    return None


def limits(
    posterior: Posterior,
    summary: NDArray[np.float32],
    named: Sequence[str] = (),
    without: Collection[str] = (),
) -> tuple[ExclusionLimit, ...]:
    """How large each other cause may be and not show, beside what is named.

    The 95 % interval of its size given that it is there too; open where it reaches the end of the
    range. What the datasheet says lies inside: it may be so.
    """
    unit, sets = posterior.scales.prior.unit, posterior.scales.sets
    without = {*without, *not_of_unit(unit)}
    place = {effect: number for number, effect in enumerate(sets.effects)}
    found = []
    for effect in sets.effects:
        members = tuple(sorted(place[e] for e in {*named, effect}))
        if effect in {*named, *without} or members not in sets.index:
            continue
        parameter = CATALOGUE[effect].parameters[0]
        one = posterior.given(summary, sets.index[members])
        mean, std = one.sizes[effect, parameter.name]
        ends = posterior.scales.size_ends[posterior.scales.place(effect, parameter.name)]
        low, high = (float(np.exp(mean + sign * _WIDE * std)) for sign in (-1.0, 1.0))
        least, most = np.exp(ends)
        known = parameter.nominal(unit)
        if known is not None:
            low, high = min(low, known), max(high, known)
        hypothesis = Hypothesis(unit, (effect,))
        amid = hypothesis.amid[0]
        from_zero = parameter.allowed[0] <= 0.0
        shown = (
            low if low > least and (amid or not from_zero) else None,
            high if high < most and (amid or from_zero) else None,
        )
        found.append(
            ExclusionLimit(effect, parameter.name, parameter.symbol_of(unit), *shown, known)
        )
    return tuple(found)


def swept_levels(observation: Observation, values: NDArray[np.float64]) -> list[SweptLevels]:
    """Readings (n, 3, rows) in the sweeps of an observation as the network reads them."""
    found = []
    for plan, rows in observation.plans:
        cycles, count = plan.integrate_cycles, len(values)
        levels = np.unique(observation.source_vpk[rows])
        frequency_hz = np.asarray(plan.frequencies_hz)
        shape = (count, len(levels), len(frequency_hz))
        place = (
            slice(None),
            np.searchsorted(levels, observation.source_vpk[rows]),
            np.searchsorted(frequency_hz, observation.frequency_hz[rows]),
        )
        log_gain, phase, log_scatter = values[:, :, rows].swapaxes(0, 1)
        gain = np.full(shape, np.nan, dtype=np.complex64)
        scatter, known = np.full(shape, np.nan, dtype=np.float32), np.zeros(shape, dtype=bool)
        gain[place] = np.exp(log_gain + 1j * np.nan_to_num(phase))
        scatter[place] = np.exp(log_scatter) * np.sqrt(cycles)
        known[place] = np.isfinite(phase)
        found.append(
            SweptLevels(
                frequency_hz,
                levels,
                gain,
                scatter,
                # The noise that it has learned with is that of the quietest points.
                np.full(count, observation.noise_v * observation.quietest, dtype=np.float32),
                known,
                plan.direction == "down",
                plan.settle_cycles,
                cycles,
                plan.dc_offset_v,
            )
        )
    return found


def _centres(bins: int) -> NDArray[np.float64]:
    return (np.arange(bins) + 0.5) / bins
