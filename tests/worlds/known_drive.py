"""A commissioned drive of one stage, and later sweeps of it.

Owns a record of commissioning that needs no sweeps: every value is known by itself. It judges
nothing.
"""

import numpy as np
from worlds.hidden import reading

from daq.plan import SweepPlan
from sim.commissioning import Commissioning
from sim.effects import EffectSetting
from sim.response import simulate
from sim.unit import load_unit


def commissioned(name):
    """A unit whose values are all known to half a percent, independently."""
    unit = load_unit(name)
    symbols = tuple(s for s, share in unit.tolerances.items() if share and unit.parameters[s])
    known = Commissioning(
        date="2026-11-30",
        of=unit.name,
        datasheet={symbol: unit.parameters[symbol] for symbol in symbols},
        std=dict.fromkeys(symbols, 0.005),
        order=symbols,
        covariance=tuple(tuple(row) for row in (0.005**2 * np.eye(len(symbols))).tolist()),
        sweeps=(),
    )
    tight = unit.with_tolerance({"default": 0.005})
    return tight.model_copy(update={"commissioning": known})


def seen_again(unit, seed, effect=None, **factors):
    """A sweep of a drive of which some values are multiples of what its unit says.

    `effect`: what it has besides, an identifier and its values.
    """
    changed = {symbol: factor * unit.parameters[symbol] for symbol, factor in factors.items()}
    plan = SweepPlan(
        tuple(np.geomspace(30.0, 65.0, 9).tolist()),
        (1.5, 4.0), settle_cycles=5, integrate_cycles=6,
    )  # fmt: skip
    effects = [EffectSetting(*effect)] if effect else []
    swept = simulate(unit.with_parameters(**changed), 1.0, plan, effects=effects, seed=seed)
    return reading(swept, np.random.default_rng(seed))
