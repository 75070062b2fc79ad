import numpy as np
import pytest

from analysis.ensemble.model import Hypothesis
from analysis.ensemble.runs import DatasheetRange, Group, simulate_groups
from analysis.observation.observation import unread
from daq.errors import AnalysisError
from daq.plan import SweepPlan
from sim.unit import load_unit

ADSS = load_unit("adss")
SHORT = SweepPlan((120.0, 140.0), (2.0,), settle_cycles=1, integrate_cycles=2)
RATIOS = np.linspace(0.2, 0.8, 3)


LOAD = ("load-inertia",)


def runs(groups, seed=0, about=None):
    rng = np.random.default_rng(seed)
    return simulate_groups(ADSS, groups, unread(SHORT, 1e-4), rng, about=about)


def test_runs_are_stored_by_hypothesis_and_place():
    inertia = Hypothesis(ADSS, ("load-inertia",))
    groups = [Group(Hypothesis(ADSS), RATIOS, np.empty(0)), Group(inertia, RATIOS, np.array([0.6]))]
    found = runs(groups)
    assert found[()].places.shape == (3, 1)
    np.testing.assert_array_equal(found[("load-inertia",)].places[:, 1], 0.6)
    assert found[()].mean.shape == found[()].variance.shape == (3, 2)
    # Another load must show.
    assert np.abs(found[()].mean - found[("load-inertia",)].mean).min() > 1e-5


def test_no_groups_are_no_runs():
    assert runs([]) == {}


def test_neighbouring_groups_deviate_oppositely_by_one_tolerance():
    found = runs([Group(Hypothesis(ADSS), RATIOS, np.empty(0))] * 14)
    off = found[()].deviations[:: len(RATIOS)]
    np.testing.assert_allclose(off[::2], -off[1::2])
    np.testing.assert_allclose(np.abs(off), np.full((14, 5), 0.005))
    # Seven pairs tell five slopes apart.
    assert np.linalg.cond(off) < 3.0


def test_groups_deviate_about_known_datasheet_values():
    known = DatasheetRange(np.array([0.01, -0.01, 0.0, 0.0, 0.02]), np.full(5, 0.001))
    groups = [Group(Hypothesis(ADSS, key), RATIOS, np.full(len(key), 0.5)) for key in ((), LOAD)]
    found = runs(groups * 4, about={(): known})
    off = found[()].deviations - known.centre
    np.testing.assert_allclose(np.abs(off), np.full((12, 5), 0.001))
    np.testing.assert_array_equal(found[()].fold, off[:, 0] > 0.0)
    np.testing.assert_allclose(np.abs(found[LOAD].deviations), np.full((12, 5), 0.005))
    assert np.count_nonzero(found[LOAD].fold) == 6


def test_seed_reproduces_the_runs():
    groups = [Group(Hypothesis(ADSS), RATIOS, np.empty(0))]
    np.testing.assert_array_equal(runs(groups)[()].mean, runs(groups)[()].mean)


def test_too_long_step_is_halved_before_error(monkeypatch):
    import sim.response as module

    steps = []

    def fussy(servos, plan, steps_s, *told):
        steps.append(steps_s)
        raise AnalysisError("grew without bound")

    monkeypatch.setattr(module, "_sweep", fussy)
    with pytest.raises(AnalysisError):
        runs([Group(Hypothesis(ADSS), RATIOS, np.empty(0))])
    # Lots of one group may be stepped side by side.
    assert steps[0] == (1e-5, 5e-6, 2.5e-6)
    assert sorted(set(steps)) == [(2.5e-6,), (5e-6, 2.5e-6), (1e-5, 5e-6, 2.5e-6)]
