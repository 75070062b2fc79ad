"""Prior over machines: what may be hidden in a unit, how large, and how far off its datasheet is.

Owns the distribution of causes, sizes, contribution ratio, total backlash, datasheet errors and
believed tolerances. Every other question of the inference is a posterior of this one prior.
It must not know any measurement.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble.machine import Machine
from sim.catalogue import BUILT_IN, CATALOGUE, EffectParameter, effects_of
from sim.effects import EffectSetting
from sim.response import START_SPREAD, Servo
from sim.unit import Unit

__all__ = ["COUNTS", "DrawnMachine", "Prior"]

COUNTS = (0.12, 0.38, 0.38, 0.12)
"""Probability of so many causes, from none."""

_RARE_WEIGHT = 0.3
"""How often a rare effect is drawn, beside a usual one."""

_EXACT = ("N_1", "N", "filter_numerator")
"""Datasheet values without tolerance: gear ratios are counted, and the filter's gain at rest is
that of the tachometer. Total backlash has none either: it is a cause of its own."""

_TABLE_1 = (
    "L_a", "R_m", "k_b", "k_t", "J_m", "B_m", "T_f_m", "k_a", "k_ts", "k_g1", "J_g1", "k_s1",
    "J_s1", "J_p2", "k_2", "J_L", "T_f_L",
)  # fmt: skip
"""Datasheet values of the paper's units that may deviate."""

_PAPER = ("R_m", "k_t", "J_L", "k_s1", "k_a", "k_ts")
_FRICTIONS = ("T_f_m", "T_f_L", "B_m")
_FRICTION_WIDER = 3.0

_TOLERANCE = (0.001, 0.10)
_SHIPPED = 0.005

_LEAST_LOG = 0.04
"""Least departure of a datasheet value that counts as a cause, natural logarithm."""

_BEYOND = 2.5
"""A cause departs by so many standard deviations of its tolerance at least."""

_LEAST_SHARE = 0.01


@dataclass(frozen=True, slots=True)
class DrawnMachine:
    """One machine of the prior with what is known of it beforehand.

    `tolerance`: believed standard deviations, as shares, in the order of `Prior.symbols`.
    `total_known`: whether the datasheet's total backlash may be relied on.
    """

    machine: Machine
    tolerance: tuple[float, ...]
    total_known: bool


@dataclass(frozen=True)
class Prior:
    """The prior of one unit.

    Parameters
    ----------
    unit
        As its datasheet says.
    borrowed
        Whether it is asked in the words of the paper's units, for which the posteriors that come
        with lashbench were trained: all effects, and the values of their datasheets. What the
        unit cannot have is then left out of the question.
    """

    unit: Unit
    borrowed: bool = False

    @cached_property
    def symbols(self) -> tuple[str, ...]:
        """Datasheet values that may deviate."""
        if self.borrowed:
            return _TABLE_1
        known, may_deviate = self.unit.parameters, self.unit.tolerances
        return tuple(s for s in may_deviate if s not in _EXACT and known[s] != 0.0)

    @cached_property
    def effects(self) -> tuple[str, ...]:
        """Effects that this unit can have, in the order of the catalogue, its own last."""
        return tuple(BUILT_IN) if self.borrowed else effects_of(self.unit)

    @cached_property
    def weights(self) -> NDArray[np.float64]:
        """Probability of each effect to be drawn as a cause (effects,)."""
        weight = np.array([_RARE_WEIGHT if CATALOGUE[e].rare else 1.0 for e in self.effects])
        return weight / weight.sum()

    @cached_property
    def parameters(self) -> tuple[tuple[str, EffectParameter], ...]:
        """(effect, parameter) of every size."""
        return tuple((e, p) for e in self.effects for p in CATALOGUE[e].parameters)

    @cached_property
    def lane_effects(self) -> frozenset[str]:
        """Effects whose size leaves the linear part alone.

        Machines that differ in these alone are stepped side by side.
        """
        rng = np.random.default_rng(0)
        tolerance = dict.fromkeys(self.symbols, 0.0)
        found = set()
        for effect in self.effects:
            servos = [
                Servo.of(self.unit, 1.0 if self.unit.stages == 1 else 0.5, [setting])
                for setting in (self._setting(effect, tolerance, rng) for _ in range(2))
            ]
            parts = [(s.system.A, s.system.b, s.system.f, s.system.o) for s in servos]
            alike = all(np.array_equal(a, b) for a, b in zip(*parts, strict=True))
            laws = [
                [(law.law, law.stiffness, law.damping) for law in s.system.nonlinearities]
                for s in servos
            ]
            if alike and laws[0] == laws[1]:
                found.add(effect)
        return frozenset(found)

    def draw_group(self, lanes: int, rng: np.random.Generator) -> list[DrawnMachine]:
        """Machines that share their linear part: causes, tolerances and linear sizes in common.

        Contribution ratio, frictions, total backlash, start, and sizes that are parameters of
        laws differ from machine to machine.
        """
        tolerance = self._tolerance(rng)
        count = int(rng.choice(len(COUNTS), p=COUNTS))
        effects = sorted(rng.choice(self.effects, count, replace=False, p=self.weights).tolist())
        shared = {e: self._setting(e, tolerance, rng) for e in effects}
        errors = {s: float(rng.normal(0.0, t)) if t else 0.0 for s, t in tolerance.items()}
        # A total backlash that is not known is no cause of a departure from it.
        total_known = "total-backlash" in effects or bool(rng.random() < 0.85)
        ratios = (np.arange(lanes) + rng.random(lanes)) / lanes
        return [
            DrawnMachine(
                self._machine(float(ratio), effects, shared, errors, tolerance, total_known, rng),
                tuple(tolerance.values()),
                total_known,
            )
            for ratio in rng.permutation(ratios)
        ]

    def _machine(
        self,
        ratio: float,
        effects: Sequence[str],
        shared: Mapping[str, EffectSetting],
        errors: Mapping[str, float],
        tolerance: Mapping[str, float],
        total_known: bool,
        rng: np.random.Generator,
    ) -> Machine:
        own = dict(errors)
        for symbol in ("T_f_m", "T_f_L"):
            if tolerance.get(symbol):
                own[symbol] = float(rng.normal(0.0, tolerance[symbol]))
        b_t_deg = None
        if not total_known:
            b_t_deg = self.unit.backlash.b_t_deg * float(np.exp(rng.uniform(*np.log([0.5, 2.0]))))
        settings = tuple(
            self._setting(e, tolerance, rng) if e in self.lane_effects else shared[e]
            for e in effects
        )
        spread = START_SPREAD if rng.random() < 0.5 else 1.0
        return Machine(
            1.0 if self.unit.stages == 1 else ratio,
            int(rng.integers(2**30)),
            b_t_deg,
            tuple((s, max(e, -0.9)) for s, e in own.items() if e),
            settings,
            spread,
        )

    def _tolerance(self, rng: np.random.Generator) -> dict[str, float]:
        """Believed standard deviations of the datasheet, by symbol, as shares."""
        share = float(np.exp(rng.uniform(*np.log(_TOLERANCE))))
        if rng.random() < 0.5:
            share = _SHIPPED if rng.random() < 0.8 else share
            return {s: share if s in _PAPER else 0.0 for s in self.symbols}
        spread = np.exp(rng.normal(0.0, 0.5, len(self.symbols)))
        wider = [_FRICTION_WIDER if s in _FRICTIONS else 1.0 for s in self.symbols]
        shares = np.minimum(share * spread * wider, 0.5)
        return dict(zip(self.symbols, map(float, shares), strict=True))

    def _setting(
        self, effect: str, tolerance: Mapping[str, float], rng: np.random.Generator
    ) -> EffectSetting:
        wide = bool(rng.random() < 0.35)
        parameters = CATALOGUE[effect].parameters
        values = {
            p.name: self._size(p, wide, len(parameters) == 1, tolerance, rng) for p in parameters
        }
        return EffectSetting(effect, values)

    def _size(
        self,
        p: EffectParameter,
        wide: bool,
        alone: bool,
        tolerance: Mapping[str, float],
        rng: np.random.Generator,
    ) -> float:
        """Draw a size: over the whole range, or as worn and misadjusted drives have it."""
        low, high = p.range(self.unit)
        low = max(low, _LEAST_SHARE * high)
        known = p.nominal(self.unit)
        least = max(_LEAST_LOG, _BEYOND * tolerance.get(p.name, 0.0))
        if alone and known is not None and 0.5 * known**2 < low * high < 2.0 * known**2:
            most = np.log(high / known) if wide else 0.45
            off = rng.uniform(least, max(float(most), 1.2 * least)) * rng.choice([-1.0, 1.0])
            return float(known * np.exp(off))
        if p.name == "f_p":
            return float(np.exp(rng.uniform(*np.log([low, high]))))
        if known is not None and not wide:
            return float(known * np.exp(rng.uniform(max(0.3, least), 1.5)))
        ends = (0.0, 1.0) if wide else (0.35, 0.8)
        return float(np.exp(np.log(low) + np.log(high / low) * rng.uniform(*ends)))
