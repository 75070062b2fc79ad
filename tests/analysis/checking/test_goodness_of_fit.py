"""Whether a measurement looks like a hypothesis' own runs, in a world whose answers are known."""

from types import SimpleNamespace

import numpy as np
import pytest
from worlds.synthetic import candidate, observation, read, shape

from analysis.checking import goodness_of_fit as adequacy
from analysis.checking.goodness_of_fit import judge_adequacy

TRUE = ("load-inertia",)


def seen(effects, seed):
    return observation(read(effects, np.array([0.5, 0.5]), np.random.default_rng(seed)))


@pytest.mark.parametrize("seed", range(6))
def test_observation_like_replicates_is_adequate(seed):
    fitting = seen(TRUE, seed)
    rng = np.random.default_rng(seed)
    # Twelve draws of about a standard normal: above 3.5 once in 400 of such tests.
    assert judge_adequacy(candidate(fitting, TRUE, seed), rng).sigma < 3.5
    odd = observation(fitting.values + 0.3 * shape(77))
    assert judge_adequacy(candidate(odd, TRUE, seed), rng).sigma > 4.0


@pytest.mark.parametrize("comparable", [0, 1])
def test_incomparable_replicates_do_not_reject_observation(comparable, monkeypatch):
    """Two short sweeps of a cable at one level had no run that others did as; it was no error.

    One run has no scatter, by which anything would be far off.
    """
    other = SimpleNamespace(log_likelihood=20.0, place=None)
    surface = SimpleNamespace(climb=lambda *_, tries: other)
    run = SimpleNamespace(alone=surface, place=None, seen_by=lambda surface: surface)
    monkeypatch.setattr(adequacy, "replicates_of", lambda *_: iter((run,) * comparable))
    one = SimpleNamespace(best=SimpleNamespace(log_likelihood=10.0, place=None), surface=surface)
    assert adequacy.judge_adequacy(one, None) == adequacy.Adequacy(0.0, 0.0)
    assert adequacy.judge_chance(one, one, None) == 0.0


@pytest.mark.parametrize(
    ("ahead", "mean", "share"),
    # By chance two less to two more than a mean in this world.
    [(0.0, -1.0, 0.4), (1.0, -1.0, 0.2), (6.0, -1.0, 0.0), (6.0, 4.0, 0.2), (6.0, -99.0, 0.0)],
)
def test_gain_is_compared_with_chance_of_replicates(monkeypatch, ahead, mean, share):
    def standing(likelihood):
        best = SimpleNamespace(log_likelihood=likelihood, place=None)
        climbs = SimpleNamespace(climb=lambda place, tries: best)
        return SimpleNamespace(best=best, surface=climbs, climb=climbs.climb)

    simpler, alleged = standing(100.0), standing(100.0 + ahead)

    def run(gain):
        seen = standing(50.0 + gain)
        return SimpleNamespace(seen_by=lambda _: seen, alone=standing(50.0), place=None)

    runs = [run(gain) for gain in mean + np.arange(-2.0, 3.0)]
    monkeypatch.setattr(adequacy, "replicates_of", lambda *_: iter(runs))
    assert adequacy.judge_chance(simpler, alleged, None) == pytest.approx(share)
