"""The staircase of the blind study: thresholds that are known are found again."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent / "campaigns"))

from smallest import UNIT, next_strength, sized, thresholds
from worlds.hidden import EVERY_EFFECT

from sim.catalogue import CATALOGUE
from sim.effects import drivetrain_with

FOUR_IN_FIVE = np.log(4.0)


@pytest.mark.parametrize("seed", range(5))
def test_staircases_find_thresholds_within_errors(seed):
    rng = np.random.default_rng(seed)
    centres, width = rng.uniform(0.05, 0.8, 40), 0.05
    trials = [[] for _ in centres]
    for _ in range(4):
        for centre, tried in zip(centres, trials, strict=True):
            strength = next_strength(tried)
            named = rng.uniform() < 1.0 / (1.0 + np.exp((centre - strength) / width))
            tried.append((strength, bool(named)))
    at, std = np.array(thresholds(trials)).T
    z = (at - centres - FOUR_IN_FIVE * width) / std
    # The rms of forty standard normals lies within 0.6 to 1.4 but once in ten thousand times.
    assert 0.6 < np.sqrt(np.mean(z**2)) < 1.4
    assert np.all(std < 0.2)


def test_staircase_descends_after_named_cause():
    assert next_strength([]) == 0.5
    assert next_strength([(0.5, True)]) == 0.25
    assert next_strength([(0.5, True), (0.25, False)]) == pytest.approx(0.4)
    assert next_strength([(0.5, False)] * 4) == 1.0


@pytest.mark.parametrize("effect", EVERY_EFFECT)
def test_every_cause_grows_with_its_strength(effect):
    plain = drivetrain_with(UNIT, 0.4, ()).system()
    sizes = []
    for strength in (0.0, 0.5, 1.0):
        setting = sized(UNIT, effect, strength, np.random.default_rng(1))
        system = drivetrain_with(UNIT, 0.4, [setting]).system()
        assert system.A.shape[0] >= plain.A.shape[0]
        value = next(iter(setting.values.values()))
        known = CATALOGUE[effect].parameters[0].nominal(UNIT)
        size = abs(np.log(value / known)) if known else np.log(value)
        sizes.append(-size if effect == "amplifier-saturation" else size)
    assert sizes[0] < sizes[1] < sizes[2]
