"""Runs of a known cause, lent to pairs with it, in a world whose answers are known."""

from types import SimpleNamespace

import numpy as np
import pytest
import synthetic
import synthetic_search

from analysis import lending
from analysis.causes import Hypothesis
from analysis.hunt import Hunt
from analysis.lending import gains_with_lent, leads_with_lent

ADSS = synthetic.ADSS
LEADER, TRUE = ("load-inertia",), ("amplifier-lag", "load-inertia")
FALSE = [("load-inertia", "mesh1-damping"), ("load-inertia", "shaft-damping")]


def doing(shift):
    """What a cause of one size adds at three sizes of it."""
    return SimpleNamespace(
        sizes=np.array([[0.0], [0.5], [1.0]]),
        shift=np.array(shift)[None, :, None],
        std=np.ones((1, 3, 1)),
    )


ADDITIONS = SimpleNamespace(
    added={
        tuple(e for e in key if e not in LEADER): doing([0.0, 0.5, 1.0]) for key in (TRUE, *FALSE)
    }
)


def hunted(lag, seed, leaders=16, groups=4):
    """A hunt with many runs of a load too heavy, and few with a further cause."""
    rng = np.random.default_rng(seed)
    looking = Hunt(ADSS, synthetic_search.observed(TRUE, [lag, 0.7], rng), rng, None, None)
    looking.start({LEADER: np.array([0.4, 0.7])}, leaders)
    places = {TRUE: [0.4, 0.35, 0.7]} | {key: [0.4, 0.7, 0.3] for key in FALSE}
    looking.start({key: np.array(at) for key, at in places.items()}, groups)
    return looking


@pytest.mark.parametrize("seed", range(6))
def test_lent_runs_tell_a_true_pair_that_few_of_its_own_leave_behind(runs, seed):
    looking = hunted(0.1, seed)
    before = dict(looking.found)
    leads = leads_with_lent(looking, ADDITIONS, LEADER, [TRUE, *FALSE])
    alone = looking.found[LEADER].best.log_likelihood
    own = {key: looking.found[key].best.log_likelihood - alone for key in leads}
    # Of six draws: -202 to -99 by its own runs, 295 to 340 with lent ones; others at most 67,
    # and in one draw of thirty 83.
    assert own[TRUE] < 0.0 < 200.0 < leads[TRUE]
    assert max(leads[key] for key in FALSE) < 70.0
    assert all(leads[key] >= own[key] for key in leads)
    assert looking.found == before


@pytest.mark.parametrize("seed", range(3))
def test_nobody_leads_by_lent_runs_where_nothing_hides(runs, seed):
    leads = leads_with_lent(hunted(0.0, seed, leaders=12), ADDITIONS, LEADER, [TRUE, *FALSE])
    # Of thirty draws one leads by more.
    assert max(leads.values()) < 5.0


@pytest.mark.parametrize("seed", range(6))
def test_a_true_pair_explains_more_of_what_is_observed_than_of_the_leaders_own_runs(runs, seed):
    looking = hunted(0.1, seed)
    before = dict(looking.found)
    rng = np.random.default_rng(seed)
    gains = gains_with_lent(looking, ADDITIONS, LEADER, [TRUE, *FALSE], rng)
    # Of six draws: 153 to 256, and others that do a little of the same 18 at most.
    assert max(gains[key] for key in FALSE) < 20.0 < 50.0 < gains[TRUE]
    assert list(gains) == [TRUE, *FALSE]
    assert looking.found == before


@pytest.mark.parametrize("seed", range(6))
def test_where_nothing_hides_what_is_observed_is_explained_as_own_runs_are(runs, seed):
    looking, rng = hunted(0.0, seed, leaders=12), np.random.default_rng(seed)
    gains = gains_with_lent(looking, ADDITIONS, LEADER, [TRUE, *FALSE], rng)
    # Of sixty draws: -1.3 to 1.0; with eighty runs of the leader three lie beyond.
    assert max(map(abs, gains.values())) < 2.0


def test_nothing_is_told_of_a_gain_where_no_own_runs_can_be_compared(runs, monkeypatch):
    monkeypatch.setattr(lending, "own_runs", lambda *_: iter(()))
    looking, rng = hunted(0.0, 1), np.random.default_rng(1)
    assert gains_with_lent(looking, ADDITIONS, LEADER, [TRUE], rng) == {TRUE: np.inf}


@pytest.mark.parametrize(
    ("cause", "size"),
    [("shaft-stiffness", 0.5), ("motor-coulomb-friction", 0.611), ("total-backlash", 0.537)],
)
def test_what_the_datasheet_knows_does_nothing_at_its_value(cause, size):
    """Whatever the atlas, whose sizes are few, has there."""
    further = Hypothesis(ADSS, (cause,))
    assert lending._least_of(further, None) == pytest.approx([size], abs=1e-3)


@pytest.mark.parametrize(("does", "size"), [([4.0, -2.0, 0.5], 1.0), ([-0.1, 2.0, 0.5], 0.0)])
def test_what_it_does_not_know_does_nothing_where_it_does_least(does, size):
    """A clipping amplifier does least where it clips at most; the sign is no matter."""
    further = Hypothesis(ADSS, ("amplifier-saturation",))
    added = SimpleNamespace(added={further.effects: doing(does)})
    assert list(lending._least_of(further, added)) == [size]


def test_the_other_side_of_a_datasheet_value_is_as_far_from_it():
    known = Hypothesis(ADSS, LEADER)
    pair = {e: tuple(sorted((*LEADER, e))) for e in ("shaft-stiffness", "motor-resistance")}
    damped, backlash = ("load-inertia", "mesh1-damping"), ("load-inertia", "total-backlash")
    found = lending.on_the_other_side(
        known,
        {
            pair["shaft-stiffness"]: np.array([0.4, 0.7, 0.35]),
            # A datasheet value itself has no other side, nor has what is not on it.
            pair["motor-resistance"]: np.array([0.4, 0.7, 0.52]),
            damped: np.array([0.4, 0.7, 0.3]),
            # Nor does anything lie beyond the ends of a range.
            backlash: np.array([0.4, 0.7, 0.02]),
        },
    )
    assert set(found) == {pair["shaft-stiffness"], backlash}
    assert found[pair["shaft-stiffness"]] == pytest.approx([0.4, 0.7, 0.65])
    assert found[backlash] == pytest.approx([0.4, 0.7, 1.0])
