"""Runs of a world whose answers are known: everything but the simulations is real."""

from __future__ import annotations

from collections import Counter

import numpy as np
from worlds import synthetic

from analysis.ensemble.model import Hypothesis

ADSS = synthetic.ADSS


def read(effects, place, rng, deviations=None, scatter=1.0):
    """One run (3, rows) of a set of effects, each with its own slope; only first sizes act."""
    sizes, at = {}, 1
    for effect in effects:
        sizes[effect] = place[at]
        at += Hypothesis(ADSS, (effect,)).d - 1
    plain = synthetic.read((), place[:1], rng, deviations, scatter)
    return plain + sum(synthetic.effect_slope((e,)) * size for e, size in sizes.items())


class World:
    """An executor whose machines are those of this world.

    `count`: runs of each set of effects so far; `rounds`: families asked for, call by call.
    """

    def __init__(self, scatter=1.0):
        self.scatter = scatter
        self.count, self.rounds = Counter(), []

    def each(self, work, tasks, progress=None):
        self.rounds.append(len(tasks))
        return [self._readings(family) for family in tasks]

    def _readings(self, family):
        channels = np.array([self._run(family.unit, machine) for machine in family.machines])
        return np.exp(channels[:, 0] + 1j * channels[:, 1]), np.exp(2.0 * channels[:, 2])

    def _run(self, unit, machine):
        effects = tuple(effect.id for effect in machine.effects)
        self.count[effects] += 1
        values = [value for effect in machine.effects for value in effect.values.values()]
        place = Hypothesis(unit, effects).place(machine.ratio, values)
        off = synthetic.SPREAD.along(machine.deviations)
        return read(effects, place, np.random.default_rng(machine.seed), off, self.scatter)


def observed(effects, sizes, rng):
    """An observation of a machine with these effects at a ratio of 0.4."""
    return synthetic.observation(read(effects, np.array([0.4, *sizes]), rng))
