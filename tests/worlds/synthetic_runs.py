"""Runs of a world whose answers are known: everything but the simulations is real."""

from __future__ import annotations

from collections import Counter

import numpy as np
from worlds import synthetic

from analysis.ensemble import runs as population
from analysis.ensemble.datasheet_spread import spread_of
from analysis.ensemble.model import Hypothesis
from analysis.ensemble.runs import Population
from analysis.inference import model_pool as hunt

ADSS = synthetic.ADSS


def read(effects, place, rng, deviations=None, scatter=1.0):
    """One run (3, rows) of a set of effects, each with its own slope; only first sizes act."""
    sizes, at = {}, 1
    for effect in effects:
        sizes[effect] = place[at]
        at += Hypothesis(ADSS, (effect,)).d - 1
    plain = synthetic.read((), place[:1], rng, deviations, scatter)
    return plain + sum(synthetic.effect_slope((e,)) * size for e, size in sizes.items())


def simulate_in(monkeypatch) -> Counter:
    """Read this world wherever a hunt would simulate; how many runs of each set were asked for."""
    count = Counter()

    def simulate(unit, groups, observation, rng, executor=None, progress=None):
        found = {}
        spread = spread_of(unit)
        for group, signs in zip(groups, population._signs(groups, spread, rng), strict=True):
            key, off = group.hypothesis.effects, signs * synthetic.SIGMAS
            channels = np.array([read(key, place, rng, off) for place in group.places])
            mean = np.exp(channels[:, 0] + 1j * channels[:, 1])
            deviations = np.tile(off, (len(mean), 1))
            made = Population(group.places, deviations, mean, np.exp(2.0 * channels[:, 2]))
            found[key] = found[key].joined(made) if key in found else made
            count[key] += len(mean)
        return found

    monkeypatch.setattr(hunt, "simulate_groups", simulate)
    return count


def observed(effects, sizes, rng):
    """An observation of a machine with these effects at a ratio of 0.4."""
    # Others would simulate a servo that has nothing to do with this world.
    assert hunt.simulate_groups is not population.simulate_groups, "ask for the fixture `runs`"
    return synthetic.observation(read(effects, np.array([0.4, *sizes]), rng))
