"""An atlas of a world in which what two causes do adds up exactly."""

from __future__ import annotations

import numpy as np
import synthetic

from analysis.atlas import Atlas

SINGLE = ("amplifier-lag", "load-inertia", "mesh1-damping", "shaft-stiffness", "tachometer-gain")


def channels(sizes, ratio, rng):
    """One run (3, rows) of effects with a size each; a size counts from the middle of its range."""
    plain = synthetic.read((), np.array([ratio]), rng)
    return plain + sum(synthetic.effect_slope((e,)) * (x - 0.5) for e, x in sizes.items())


def population(effects, rng):
    runs, places = [], []
    for size in rng.permutation((np.arange(12) + rng.uniform(size=12)) / 12):
        for ratio in (np.arange(10) + rng.uniform()) / 10:
            places.append([ratio, size][: 1 + len(effects)])
            runs.append(channels(dict.fromkeys(effects, size), ratio, rng))
    return synthetic.population(np.array(places), np.array(runs))


def drawn() -> Atlas:
    """The plain model and every one of these causes, over their whole range."""
    rng = np.random.default_rng(7)
    return {effects: population(effects, rng) for effects in [(), *((e,) for e in SINGLE)]}
