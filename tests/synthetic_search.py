"""A search in a world whose answers are known: everything but the simulations is real."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
import synthetic

from analysis import atlas, hunt, population, search
from analysis.causes import Hypothesis
from analysis.population import Population
from analysis.spread import spread_of
from analysis.verdict import judge_candidates

ADSS = synthetic.ADSS
MORE_SEEDS = [1, pytest.param(2, marks=pytest.mark.study), pytest.param(3, marks=pytest.mark.study)]
"""Where half a minute a seed is too long for every test run; all hold."""


def read(effects, place, rng, deviations=None, scatter=1.0):
    """One run (3, rows) of a set of effects, each with its own slope; only first sizes act."""
    sizes, at = {}, 1
    for effect in effects:
        sizes[effect] = place[at]
        at += Hypothesis(ADSS, (effect,)).d - 1
    plain = synthetic.read((), place[:1], rng, deviations, scatter)
    return plain + sum(synthetic.effect_slope((e,)) * size for e, size in sizes.items())


class Asked(Counter):
    """How many runs of each hypothesis were asked for, atlas apart; and where, atlas included."""

    def __init__(self):
        super().__init__()
        self.executors = set()


def simulate_in(monkeypatch) -> Asked:
    """Read this world wherever a search would simulate; what is asked for from now on."""
    count = Asked()

    def simulate(unit, groups, observation, rng, executor=None, progress=None):
        found = {}
        count.executors.add(executor)
        spread = spread_of(unit)
        for group, signs in zip(groups, population._signs(groups, spread, rng), strict=True):
            key, off = group.hypothesis.effects, signs * synthetic.SIGMAS
            rows = np.isin(
                np.tile(synthetic.FREQUENCIES, len(synthetic.LEVELS)), observation.frequency_hz
            )
            channels = np.array([read(key, place, rng, off)[:, rows] for place in group.places])
            mean = np.exp(channels[:, 0] + 1j * channels[:, 1])
            made = Population(
                group.places,
                np.tile(off, (len(mean), 1)),
                mean,
                np.exp(2.0 * channels[:, 2]),
            )
            found[key] = found[key].joined(made) if key in found else made
            count[key] += len(mean)
        return found

    def quietly(*given):
        before = Counter(count)
        made = simulate(*given)
        count.clear()
        count.update(before)
        return made

    monkeypatch.setattr(hunt, "simulate_groups", simulate)
    monkeypatch.setattr(atlas, "simulate_groups", quietly)
    return count


def observed(effects, sizes, rng):
    """An observation of a machine with these effects at a ratio of 0.4."""
    # It would pass for a search, and simulate a servo that has nothing to do with this world.
    assert hunt.simulate_groups is not population.simulate_groups, "ask for the fixture `runs`"
    return synthetic.observation(read(effects, np.array([0.4, *sizes]), rng))


FELT = ("cable-stiffness", "load-viscous-damping", "payload-flexibility")


def diagnosed(effects, sizes, seed, without=FELT, **given):
    """Candidates of a search for hidden effects, and the verdict on them.

    Without what is felt with another inertia at the load, in regressions that have each row to
    themselves: they take as long as all others together, and this world does not know of it.
    """
    rng = np.random.default_rng(seed)
    seen = observed(effects, sizes, rng)
    found = search.search_causes(ADSS, seen, without=without, seed=seed, **given).candidates
    return found, judge_candidates(found, found[0].surface.observation, rng)


def searched(effects, sizes, seed):
    """What a search for hidden effects came to, whatever it says of them."""
    seen = observed(effects, sizes, np.random.default_rng(seed))
    return search.search_causes(ADSS, seen, without=FELT, seed=seed)


def hunted(sizes, seed, effects=("load-inertia",)):
    """A hunt for causes of known sizes, with nothing simulated yet."""
    rng = np.random.default_rng(seed)
    return hunt.Hunt(ADSS, observed(effects, sizes, rng), rng, None, None)
