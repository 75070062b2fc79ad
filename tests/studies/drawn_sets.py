"""Test sets of a paired study: responses that hide causes known to the study alone.

Owns the draw of unit, contribution ratio, datasheet errors, causes, sizes and reading noise.
Every set has its own random stream, keyed by seed, kind and number: more sets change no other.
It diagnoses nothing.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from worlds.hidden import BANDS_HZ, LEVELS_VPK, reading

from daq.frf import FrequencyResponse
from daq.plan import SweepPlan, spaced_frequencies
from sim.catalogue import CATALOGUE, COMMON, EffectParameter
from sim.effects import EffectSetting
from sim.response import simulate
from sim.unit import Unit, load_unit

POINTS = 61

KINDS = {"single": 100, "pair": 100, "nothing": 60, "withheld": 60}
"""Kinds of sets, and how many of each a study holds. A withheld cause is hidden, and taken out
of the catalogue that the diagnosis may use."""

DATASHEET = 0.005, ("R_m", "k_t", "J_L", "k_s1", "k_a", "k_ts")
"""One standard deviation of a datasheet value as a share, and the values that deviate."""

_SHARE = (0.06, 0.4)
"""A datasheet value that is a cause is off by so much, up or down."""

_GROWTH = (0.4, 1.4)
"""Natural logarithm of the factor by which a friction of the datasheet has grown."""

_SPAN = (0.4, 0.75)
"""Position of other sizes between the ends of their range, by logarithm."""

_LEAST_SHARE = 0.01
"""Ranges that begin at zero begin at this share of their end instead."""


@dataclass(frozen=True)
class StudySet:
    """One set before it is simulated: `unit` by name, hidden `effects` by identifier."""

    seed: int
    kind: str
    number: int
    unit: str
    effects: tuple[str, ...]

    @property
    def name(self) -> str:
        """Name of the set, unique in the study."""
        return f"{self.kind}-{self.number:03d}"

    @property
    def withheld(self) -> tuple[str, ...]:
        """Effects that the diagnosis may not use."""
        return self.effects if self.kind == "withheld" else ()


@dataclass(frozen=True)
class DrawnSet:
    """A set with its truth and what a bench reads of it."""

    study_set: StudySet
    ratio: float
    effects: tuple[EffectSetting, ...]
    deviations: dict[str, float]
    response: FrequencyResponse

    def truth(self) -> dict:
        """What is hidden, as JSON."""
        one = self.study_set
        return {
            "seed": one.seed,
            "set": one.name,
            "kind": one.kind,
            "unit": one.unit,
            "withheld": list(one.withheld),
            "ratio": self.ratio,
            "effects": {e.id: dict(e.values) for e in self.effects},
            "deviations": self.deviations,
        }


def study_sets(seed: int, kinds: dict[str, int] | None = None) -> Iterator[StudySet]:
    """Sets of a study, kinds in turn, so that any part of them holds every kind."""
    counts = dict(KINDS if kinds is None else kinds)
    whole = max(counts.values())
    for place in range(whole):
        for kind, count in counts.items():
            # A kind with fewer sets takes its turns evenly among the others.
            number = place * count // whole
            if number != (place - 1) * count // whole or place == 0:
                yield _study_set(seed, kind, number)


def draw_set(one: StudySet, datasheet: tuple[float, tuple[str, ...]] = DATASHEET) -> DrawnSet:
    """Simulate a set.

    Parameters
    ----------
    datasheet
        Standard deviation of datasheet values as a share, and which values deviate.
    """
    rng = _stream(one, "machine")
    unit = load_unit(one.unit)
    effects = tuple(EffectSetting(e, _sizes(unit, e, rng)) for e in one.effects)
    ratio = float(rng.uniform(0.05, 0.95))
    share, symbols = datasheet
    deviations = {symbol: float(rng.normal(0.0, share)) for symbol in symbols}
    known = unit.parameters
    machine = unit.with_parameters(**{s: known[s] * (1.0 + d) for s, d in deviations.items()})
    plan = SweepPlan(spaced_frequencies(*BANDS_HZ[one.unit], POINTS), LEVELS_VPK)
    swept = simulate(machine, ratio, plan, effects=effects, seed=int(rng.integers(2**31)))
    return DrawnSet(one, ratio, effects, deviations, reading(swept, _stream(one, "reading")))


def _study_set(seed: int, kind: str, number: int) -> StudySet:
    # Single causes take turns by unit and effect, so that each occurs before any occurs again.
    if kind in ("single", "withheld"):
        every = [(u, e) for u in BANDS_HZ for e in COMMON]
        turn, place = divmod(number, len(every))
        order = np.random.default_rng([seed, zlib.crc32(kind.encode()), turn]).permutation(
            len(every)
        )
        unit, effect = every[order[place]]
        return StudySet(seed, kind, number, unit, (effect,))
    rng = np.random.default_rng([seed, zlib.crc32(kind.encode()), number, 0])
    unit = str(rng.choice(list(BANDS_HZ)))
    count = {"nothing": 0, "pair": 2, "triple": 3}[kind]
    effects = tuple(sorted(map(str, rng.choice(COMMON, count, replace=False))))
    return StudySet(seed, kind, number, unit, effects)


def _stream(one: StudySet, stage: str) -> np.random.Generator:
    words = (zlib.crc32(word.encode()) for word in (one.kind, stage))
    return np.random.default_rng([one.seed, one.number, *words])


def _sizes(unit: Unit, effect: str, rng: np.random.Generator) -> MappingProxyType[str, float]:
    parameters = CATALOGUE[effect].parameters
    alone = len(parameters) == 1
    return MappingProxyType({p.name: _size(p, unit, alone, rng) for p in parameters})


def _size(p: EffectParameter, unit: Unit, alone: bool, rng: np.random.Generator) -> float:
    """Draw a size as a bench would meet it."""
    low, high = p.range(unit)
    low = max(low, _LEAST_SHARE * high)
    known = p.nominal(unit)
    if alone and known is not None and 0.5 * known**2 < low * high < 2.0 * known**2:
        return float(known * (1.0 + rng.uniform(*_SHARE) * rng.choice([-1.0, 1.0])))
    if known is not None:
        return float(known * np.exp(rng.uniform(*_GROWTH)))
    if p.name == "f_p":
        return float(rng.uniform(0.8, 1.2) * rng.uniform(*BANDS_HZ[unit.name.lower()]))
    return float(np.exp(np.log(low) + np.log(high / low) * rng.uniform(*_SPAN)))
