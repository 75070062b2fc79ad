"""Effects drawn at random, each at a size that a bench would notice.

Owns what "noticeable" means for each kind of parameter. Chance comes from the
caller's generator alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from sim.catalogue import CATALOGUE, COMMON, EffectParameter, not_of_unit
from sim.effects import EffectSetting
from sim.unit import Unit

__all__ = ["draw_effect", "draw_hidden"]

_OFF = (0.15, 0.4)
"""By how much a datasheet value is off, up or down; the datasheet's tolerance is 0.005."""

_GROWTH = (2.0, 4.0)
"""By how much a friction of the datasheet has grown."""

_BETWEEN = (0.45, 0.75)
"""Where anything else lies between the ends of its range, by logarithm."""

_LEAST_SHARE = 0.01

_RATIO = (0.15, 0.85)
"""Where the contribution ratio of a bench that hides something lies."""


def draw_effect(
    unit: Unit,
    band_hz: tuple[float, float],
    rng: np.random.Generator,
    effects: Sequence[str] = COMMON,
) -> EffectSetting:
    """Draw one effect and its size.

    Parameters
    ----------
    unit
        Whose ranges count. Effects that it cannot have are left out.
    band_hz
        What will be measured; a payload swings somewhere within it.
    effects
        Identifiers to draw from.
    """
    foreign = not_of_unit(unit)
    possible = [name for name in effects if name not in foreign]
    effect = CATALOGUE[possible[int(rng.integers(len(possible)))]]
    values = {p.name: _draw_value(p, unit, band_hz, rng) for p in effect.parameters}
    return EffectSetting(effect.id, MappingProxyType(values))


def draw_hidden(unit: Unit, seed: int) -> tuple[float, EffectSetting]:
    """What a simulated bench hides: a contribution ratio and one effect, the same for a seed.

    A payload is left out: where it swings depends on the band that will be swept.
    """
    rng = np.random.default_rng(seed)
    effects = [name for name in COMMON if name != "payload-flexibility"]
    setting = draw_effect(unit, (unit.limits.start_hz, unit.limits.stop_hz), rng, effects)
    return (1.0 if unit.stages == 1 else float(rng.uniform(*_RATIO))), setting


def _draw_value(
    parameter: EffectParameter,
    unit: Unit,
    band_hz: tuple[float, float],
    rng: np.random.Generator,
) -> float:
    low, high = parameter.range(unit)
    known = parameter.nominal(unit)
    if parameter.name == "f_p":
        return float(rng.uniform(*band_hz))
    if known is not None and low > 0.0:
        return float(known * (1.0 + rng.choice([-1.0, 1.0]) * rng.uniform(*_OFF)))
    if known is not None:
        return float(known * rng.uniform(*_GROWTH))
    ends = math.log(max(low, _LEAST_SHARE * high)), math.log(high)
    return math.exp(ends[0] + (ends[1] - ends[0]) * rng.uniform(*_BETWEEN))
