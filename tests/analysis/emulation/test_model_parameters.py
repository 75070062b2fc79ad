"""Sizes of a candidate: what more caution leaves open is told where that is much more."""

from types import SimpleNamespace

import numpy as np
import pytest
from worlds.synthetic import candidate, observation, read

import analysis.emulation.model_parameters as module
from analysis.emulation.model_parameters import estimate_parameters, widen_if_open
from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.model import Hypothesis
from sim.unit import load_unit

TRUE = ("load-inertia",)


@pytest.mark.parametrize(("wider", "told"), [(1.4, 0.3), (1.6, 0.5), (6.0, 0.5)])
def test_caution_applies_to_poorly_known_parameters(monkeypatch, wider, told):
    asked = []

    def calibrate(*_, **caution):
        asked.append(caution)
        return ParameterPosterior(np.array([0.5]), np.array([[(0.05 * wider) ** 2]]))

    monkeypatch.setattr(module, "calibrate", calibrate)
    one = SimpleNamespace(
        population=None,
        surface=SimpleNamespace(chart=None, width=None),
        hypothesis=Hypothesis(load_unit("adss")),
    )
    found = ParameterPosterior(np.array([0.3]), np.array([[0.05**2]]))
    assert widen_if_open(found, one, None, None, 400).mean[0] == told
    assert asked == [{"nearest": 400, "cautious": True}]


@pytest.mark.parametrize("seed", range(3))
def test_well_determined_parameters_are_not_widened(seed):
    rng = np.random.default_rng(seed)
    seen = observation(read(TRUE, np.array([0.5, 0.5]), rng))
    one = candidate(seen, TRUE, seed)
    found = estimate_parameters(one, seen, rng)
    # Chance makes the bars of the two differ by a tenth: half as much more is five of those.
    assert widen_if_open(found, one, seen, rng) is found
