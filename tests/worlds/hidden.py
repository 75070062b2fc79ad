"""Responses that hide something, drawn at random: what a bench would read of them.

Owns the drawing of units off their datasheet, of effects and of their sizes,
and the reading noise. Truths are known to the caller alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.ensemble.model import Hypothesis
from daq.frf import DB_PER_NEPER, GAIN_STD_IS, FrequencyResponse, error_words
from daq.plan import SweepPlan, spaced_frequencies
from sim.catalogue import COMMON
from sim.effects import EffectSetting
from sim.response import simulate
from sim.unit import Unit, load_unit

BANDS_HZ = {"adss": (100.0, 180.0), "edss": (30.0, 110.0)}
LEVELS_VPK = (1.5, 2.5, 4.0)
TOLERANCES = dict.fromkeys(("R_m", "k_t", "J_L", "k_s1", "k_a", "k_ts"), 0.005)
"""What the shipped units state of their datasheets."""

NOISE_V = 5e-4

SHARES = (0.06, 0.4)
"""By how much a datasheet value is off, up or down."""

LARGE = (
    "load-inertia:J_L=0.0045",
    "cable-stiffness:K_c=900",
    "amplifier-saturation:V_sat=7",
    "motor-resistance:R_m=6",
    "load-viscous-damping:B_L=0.06",
    "filter-corner:scale=0.6",
)
"""Effects on an ADSS that no short sweep may miss."""

GROWTH = (0.4, 1.4)
"""Logarithm of the factor by which a friction of the datasheet has grown."""

SIZES = (0.4, 0.75)
"""Where other effects lie between the ends of their range, by logarithm."""


@dataclass(frozen=True)
class Hidden:
    """A unit's response and what is hidden in it; `machine` is the unit off its datasheet."""

    unit: Unit
    machine: Unit
    ratio: float
    effects: tuple[EffectSetting, ...]
    response: FrequencyResponse

    def measured(self, plan: SweepPlan, rng: np.random.Generator) -> FrequencyResponse:
        """Another sweep of the same machine, as a bench reads it."""
        seed = int(rng.integers(2**31))
        swept = simulate(self.machine, self.ratio, plan, effects=self.effects, seed=seed)
        return reading(swept, rng)


def off_datasheet(unit: Unit, rng: np.random.Generator) -> Unit:
    """A unit off its datasheet within tolerance."""
    known = unit.parameters
    changed = {s: known[s] * (1.0 + rng.normal(0.0, share)) for s, share in TOLERANCES.items()}
    return unit.with_parameters(**changed)


def drawn_effect(unit: Unit, effect: str, rng: np.random.Generator) -> EffectSetting:
    """An effect at a size that a bench would meet."""
    hypothesis = Hypothesis(unit, (effect,))
    values = {}
    for index, (_, parameter) in enumerate(hypothesis.parameters):
        low, high = hypothesis.logs[index]
        known = parameter.nominal(unit)
        if hypothesis.amid == [True]:
            off = rng.uniform(*SHARES) * rng.choice([-1.0, 1.0])
            values[parameter.name] = known * (1.0 + off)
        elif known is not None:
            # Friction of the datasheet: what wear or cold grease make of it.
            values[parameter.name] = float(known * np.exp(rng.uniform(*GROWTH)))
        elif parameter.name == "f_p":
            # A payload that resonates in or near the band that is measured.
            values[parameter.name] = float(rng.uniform(0.8, 1.2)) * rng.uniform(*_band(unit))
        else:
            values[parameter.name] = float(np.exp(low + (high - low) * rng.uniform(*SIZES)))
    return EffectSetting(effect, values)


def hide(
    name: str,
    effects: tuple[str, ...],
    rng: np.random.Generator,
    levels_vpk: tuple[float, ...] = LEVELS_VPK,
) -> Hidden:
    """A response of a unit by name that hides effects by identifier."""
    unit = load_unit(name)
    settings = tuple(drawn_effect(unit, effect, rng) for effect in effects)
    ratio = float(rng.uniform(0.05, 0.95))
    plan = SweepPlan(spaced_frequencies(*_band(unit), 61), levels_vpk)
    machine = off_datasheet(unit, rng)
    response = simulate(machine, ratio, plan, effects=settings, seed=int(rng.integers(2**31)))
    return Hidden(unit, machine, ratio, settings, reading(response, rng))


def reading(response: FrequencyResponse, rng: np.random.Generator) -> FrequencyResponse:
    """What a bench reads of a response: noise added, and counted in the stated error."""
    noise = NOISE_V / response.source_vpk
    added = rng.standard_normal((2, len(response))) * noise
    gain = response.gain + added[0] + 1j * added[1]
    along = response.gain_std_db / DB_PER_NEPER
    across = np.radians(response.phase_std_deg)
    total = np.sqrt(along**2 + across**2 + 2.0 * (noise / np.abs(gain)) ** 2)
    return FrequencyResponse.from_arrays(
        response.frequency_hz,
        response.source_vpk,
        gain,
        unit=response.unit,
        gain_std_db=DB_PER_NEPER * total,
        direction=response.direction,
        settle_cycles=response.settle_cycles,
        integrate_cycles=response.integrate_cycles,
        provenance={
            "dc_offset_v": response.dc_offset_v,
            GAIN_STD_IS: error_words(response.integrate_cycles, 2),
        },
    )


def _band(unit: Unit) -> tuple[float, float]:
    return BANDS_HZ[unit.name.lower()]


EVERY_EFFECT = COMMON
