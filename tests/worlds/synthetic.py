"""A little world with known answers, in which candidates can be made without simulating.

A run of a hypothesis reads channel = base + slope . place + deviations + scatter. What a hypothesis
cannot bend towards (its `blind` coordinates) is what tells it from another.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from analysis.emulation.emulator import Emulator
from analysis.emulation.fitted_model import FittedModel
from analysis.emulation.regimes import Regimes
from analysis.ensemble.datasheet_spread import spread_of
from analysis.ensemble.model import Hypothesis
from analysis.ensemble.runs import Population
from analysis.observation.observation import Observation
from daq.plan import SweepPlan
from sim.effects import drivetrain_with
from sim.unit import load_unit

ADSS = load_unit("adss")
PAYLOAD = Hypothesis(ADSS, ("payload-flexibility",))
FREQUENCIES = tuple(np.linspace(100.0, 180.0, 24))
LEVELS = (1.5, 4.0)
ROWS = len(FREQUENCIES) * len(LEVELS)
SPREAD = spread_of(load_unit("adss"))
SIGMAS = SPREAD.sigmas
SCATTER = np.array([0.02, 0.02, 0.2])[:, None]


@cache
def shape(seed: int) -> np.ndarray:
    """A smooth curve over the rows for each channel (3, rows)."""
    rng = np.random.default_rng(seed)
    x = np.tile(np.linspace(0.0, 1.0, len(FREQUENCIES)), len(LEVELS))
    level = np.repeat([0.7, 1.3], len(FREQUENCIES))
    waves = [np.sin(2 * np.pi * (k * x + rng.uniform())) * rng.normal() for k in (0.5, 1.0, 1.5)]
    curves = np.stack([sum(waves) * rng.uniform(0.5, 1.0) * level for _ in range(3)])
    curves.flags.writeable = False
    return curves


BASE, RATIO_SLOPE = shape(1), shape(2)
DEVIATION_SLOPES = np.stack([shape(10 + i) for i in range(len(SPREAD))])


def effect_slope(effects: tuple[str, ...]) -> np.ndarray:
    """How the channels follow the size of a set of effects."""
    return sum((shape(100 + sum(map(ord, e))) for e in effects), np.zeros((3, ROWS)))


def read(effects, place, rng, deviations=None, scatter=1.0):
    """One run (3, rows)."""
    deviations = np.zeros(len(SPREAD)) if deviations is None else deviations
    size = place[1] if len(place) > 1 else 0.0
    value = BASE + RATIO_SLOPE * (place[0] - 0.5) + effect_slope(effects) * size
    value = value + np.tensordot(deviations, DEVIATION_SLOPES[: len(deviations)], axes=1)
    return value + scatter * SCATTER * rng.standard_normal((3, ROWS))


def population(places, runs) -> Population:
    """Runs (m, 3, rows) at places (m, d) of units as their datasheet says."""
    mean = np.exp(runs[:, 0] + 1j * runs[:, 1])
    none = np.zeros((len(runs), len(SPREAD)))
    return Population(places, none, mean, np.exp(2.0 * runs[:, 2]), np.zeros(len(runs), int))


def payload_runs(places):
    """Gain, phase and no scatter (m, 3, rows) of payloads on a drive without play."""
    shown = []
    for place in places:
        transfer = drivetrain_with(ADSS, 0.4, PAYLOAD.settings(place)).system().transfer
        log = np.log(transfer(np.array(FREQUENCIES)))
        shown.append(np.tile([log.real, log.imag, 0.0 * log.real], len(LEVELS)))
    return np.array(shown)


def observation(values) -> Observation:
    """An observation of these channels."""
    plan = SweepPlan(FREQUENCIES, LEVELS)
    return Observation(
        values=values,
        source_vpk=np.repeat(LEVELS, len(FREQUENCIES)),
        frequency_hz=np.tile(FREQUENCIES, len(LEVELS)),
        noise_v=1e-5,
        noise=np.full(ROWS, 1e-5),
        loudest_v=1e-5,
        floor=np.zeros(ROWS),
        plans=((plan, np.arange(ROWS)),),
    )


def thinned(seen: Observation, step: int) -> Observation:
    """The same with every so manieth frequency alone."""
    kept = np.isin(seen.frequency_hz, FREQUENCIES[::step])
    plan = SweepPlan(FREQUENCIES[::step], LEVELS)
    return replace(
        seen,
        values=seen.values[:, kept],
        source_vpk=seen.source_vpk[kept],
        frequency_hz=seen.frequency_hz[kept],
        noise=seen.noise[kept],
        plans=((plan, np.arange(np.count_nonzero(kept))),),
    )


def candidate(
    seen: Observation,
    effects: tuple[str, ...] = (),
    seed: int = 0,
    groups: int = 10,
    scatter: float = 1.0,
    unit=ADSS,
):
    """A candidate with runs all over of what was seen, its deviations known."""
    rng = np.random.default_rng(seed)
    rows = np.isin(np.tile(FREQUENCIES, len(LEVELS)), seen.frequency_hz)
    spread = spread_of(unit)
    slopes = DEVIATION_SLOPES[: len(spread), :, rows]
    hypothesis = Hypothesis(unit, effects)
    places, deviations, runs = [], [], []
    for _ in range(groups):
        off = rng.normal(0.0, spread.sigmas)
        sizes = rng.uniform(0.0, 1.0, hypothesis.d - 1)
        for ratio in rng.uniform(0.0, 1.0, 10):
            place = np.array([ratio, *sizes])
            places.append(place)
            deviations.append(off)
            runs.append(read(effects, place, rng, off, scatter)[:, rows])
    places, deviations, runs = np.array(places), np.array(deviations), np.array(runs)
    difference = runs - seen.values - np.tensordot(deviations, slopes, axes=1)
    width = np.array([0.4] + [0.4] * (hypothesis.d - 1))
    motions = Regimes.unknown(*difference.shape[::2])
    surface = Emulator(
        seen, places, difference, width, slopes, spread.sigmas, motions, spread.gain, 9.0
    )
    mean, variance = np.exp(runs[:, 0] + 1j * runs[:, 1]), np.exp(2.0 * runs[:, 2])
    population = Population(places, deviations, mean, variance, np.repeat(np.arange(groups), 10))
    return FittedModel(hypothesis, population, surface, surface.climb(places.mean(axis=0)))
