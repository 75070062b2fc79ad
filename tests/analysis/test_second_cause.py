"""What is looked for behind a single cause that nobody doubts, given how all stand."""

from types import SimpleNamespace

import numpy as np
import pytest
import synthetic

from analysis import pairs, second_cause
from analysis.causes import Hypothesis
from analysis.screening import Place

ADSS = synthetic.ADSS
RNG = np.random.default_rng(0)


class Beside:
    """A hunt that takes over what it is given, and whose leader is who is likeliest.

    Its purse is spent after so many looks; more runs fit better by so much.
    """

    def __init__(self, leader, looks=99, gains=None):
        self.found, self.settled = {leader.hypothesis.effects: leader}, []
        self.looks, self.gains = looks, gains or {}

    @property
    def purse(self):
        return SimpleNamespace(is_spent=len(self.settled) + len(self.found) - 1 >= self.looks)

    @property
    def best(self):
        return max(self.found.values(), key=lambda c: c.best.log_likelihood)

    def leading(self, most, behind):
        ranked = sorted(self.found, key=lambda key: -self.found[key].best.log_likelihood)
        likeliest = self.best.best.log_likelihood
        near = [k for k in ranked if self.found[k].best.log_likelihood > likeliest - behind]
        return near[:most]

    def settle(self, chosen, groups):
        self.settled.append(chosen)
        for key in chosen:
            self.found[key].population = range(len(self.found[key].population) + 10 * groups)
            self.found[key].best.log_likelihood += self.gains.get(key, 0.0)

    def hear(self):
        pass

    def take_over(self, candidates, groups):
        self.found |= {c.hypothesis.effects: c for c in candidates}

    def leave_out(self, keys):
        for key in keys:
            del self.found[key]


@pytest.mark.parametrize(
    ("behind", "gain", "closer_at", "kept"),
    [
        ((-9.0, 5.0, 19.0, 21.0), 0.0, 4, 3), ((21.0, 44.0, 19.0, 46.0), 0.0, 3, 1),
        ((9.0, 5.0, 19.0, 8.0, 7.0, 6.0), 0.0, 5, 4), ((46.0,), 55.0, 0, 0),
        # Few runs had it far behind, and more of them show that it leads.
        ((31.0,), 55.0, 1, 1), ((31.0,), 10.0, 1, 0),
    ],
)  # fmt: skip
def test_those_placed_best_beside_a_leader_are_kept_where_runs_bear_them_out(
    monkeypatch, behind, gain, closer_at, kept
):
    """Eight are simulated about their places, and the leader as often about its own.

    Five at most are looked at closer, four on all rows.
    """
    leader, place, started, closer = ("load-inertia",), np.array([0.3, 0.6]), {}, {}
    placed = {
        (*leader, f"partner-{i}"): Place(np.array([0.3, 0.6, 0.1 * i]), 95.0 - 4.0 * i)
        for i in range(12)
    }

    class Rough:
        unit, observation = ADSS, SimpleNamespace(blocks=(slice(0, 21),))
        found = {}

        def thinned(self, stride):
            return ("few", stride)

        def start(self, places, groups, reach=None):
            started.update(places)
            assert (groups, reach) == (2, (0.12, 0.03))
            # Who was placed best is not who does best.
            ranked = [-i for i in behind] + [-300.0] * len(placed)
            order = [key for key in places if key != leader][::-1]
            likelihood = {leader: 100.0}
            likelihood |= {k: 100.0 + off for k, off in zip(order, ranked, strict=False)}
            for key, one in likelihood.items():
                best = SimpleNamespace(log_likelihood=one, place=one)
                self.found[key] = SimpleNamespace(best=best)

        def settle(self, keys, groups):
            assert groups == 3
            for key in keys:
                closer[key] = self.found[key].best
                closer[key].log_likelihood += gain

        def among(self, keys):
            return sorted(keys, key=lambda key: -self.found[key].best.log_likelihood)

    def beside(few, additions, known, at):
        assert (few, additions, known.effects, at is place) == (("few", 2), "sums", leader, True)
        return placed

    monkeypatch.setattr(second_cause, "place_beside", beside)
    monkeypatch.setattr(pairs, "_is_at_an_end", lambda _: False)
    alone = SimpleNamespace(hypothesis=Hypothesis(ADSS, leader), best=SimpleNamespace(place=place))
    found = second_cause._worth(Rough(), "sums", alone)
    best_placed = list(placed)[:8]
    assert set(started) == {leader, *best_placed}
    assert all(started[key] is placed[key].place for key in best_placed)
    ranked = [best_placed[::-1][i] for i in np.argsort(behind)]
    assert list(closer) == ranked[:closer_at]
    assert found == ranked[:kept]


@pytest.mark.parametrize(
    ("leader", "behind", "pair_is_at", "looked_at", "taken_over"),
    [
        ("payload-flexibility", 79.0, 120.0, True, True),
        ("payload-flexibility", 79.0, 95.0, True, False),
        ("payload-flexibility", -300.0, 120.0, True, True),
        ("payload-flexibility", 81.0, 120.0, False, False),
        ("motor-constant", 0.0, 120.0, False, False),
    ],
)
def test_a_payload_is_held_against_two_causes_at_the_load_that_it_may_stand_for(
    monkeypatch, leader, behind, pair_is_at, looked_at, taken_over
):
    """Where what is felt says that they may, and on all rows if they beat their own parts."""
    pair, key, part = ("cable-stiffness", "load-inertia"), (leader,), ("load-inertia",)

    def standing(effects, likelihood):
        best = SimpleNamespace(place=None, log_likelihood=likelihood)
        return SimpleNamespace(
            best=best, hypothesis=Hypothesis(ADSS, effects), population=range(40)
        )

    found = {key: standing(key, 110.0), part: standing(part, 90.0)}
    looked = []

    def look(rough, places):
        looked.extend(places)
        rough.found |= {one: standing(one, pair_is_at) for one in places}

    rough = SimpleNamespace(
        unit=ADSS, observation=SimpleNamespace(frequency_hz=None), found=found, among=list
    )
    fine = Beside(found[key])
    felt = {pair: Place(None, 100.0 - behind)}
    monkeypatch.setattr(second_cause, "screen_singles", lambda *_: {key: Place(None, 100.0)})
    monkeypatch.setattr(second_cause, "add_causes", lambda *_: SimpleNamespace(felt=felt))
    monkeypatch.setattr(second_cause, "_worth", lambda *_: [])
    monkeypatch.setattr(second_cause, "screen_felt", lambda additions: additions.felt)
    monkeypatch.setattr(second_cause, "look_at_felt", look)
    second_cause.look_for_second(rough, fine, {key: None}, RNG)
    assert looked == ([pair] if looked_at else [])
    assert list(fine.found) == ([key, pair] if taken_over else [key])
    assert fine.settled == ([[key, pair]] * 2 if taken_over else [])


LEADER, PAIR = ("load-inertia",), ("amplifier-lag", "load-inertia")
OTHER = ("load-inertia", "shaft-damping")


def looked_behind(monkeypatch, ahead, looks=99, *, earning=(PAIR, OTHER), gains=None):
    """The hunt on all rows after pairs were worth it, so far ahead of their leader."""
    found = {
        key: SimpleNamespace(
            hypothesis=Hypothesis(ADSS, key),
            population=range(40),
            best=SimpleNamespace(place=None, log_likelihood=likelihood),
        )
        for key, likelihood in ((LEADER, 100.0), *((k, 100.0 + a) for k, a in ahead.items()))
    }
    fine = Beside(found[LEADER], looks, gains or {})
    rough = SimpleNamespace(unit=ADSS, observation=SimpleNamespace(frequency_hz=None), found=found)
    monkeypatch.setattr(second_cause, "add_causes", lambda *_: None)
    monkeypatch.setattr(second_cause, "_worth", lambda *_: list(ahead))
    monkeypatch.setattr(second_cause, "_stood_for", lambda *_: [])

    def asked(whole, part, _):
        assert part.hypothesis.effects == LEADER
        assert len(whole.population) >= len(part.population)
        return whole.hypothesis.effects in earning

    monkeypatch.setattr(second_cause, "earns_its_name", asked)
    second_cause.look_for_second(rough, fine, {LEADER: None}, RNG)
    return fine


@pytest.mark.parametrize(
    ("ahead", "hopeful", "more", "stays"),
    [
        (16.0, True, 2, True),
        (14.0, True, 0, False),
        (-14.0, True, 0, False),
        (-16.0, False, 0, False),
    ],
)
def test_who_takes_the_lead_behind_a_cause_gets_more_runs_and_the_cause_as_many(
    monkeypatch, ahead, hopeful, more, stays
):
    fine = looked_behind(monkeypatch, {PAIR: ahead})
    assert fine.settled == [[PAIR]] * hopeful + [[LEADER, PAIR]] * more
    assert (PAIR in fine.found) == stays


def test_who_brings_no_more_than_chance_behind_a_cause_is_left_out(monkeypatch):
    ahead = {PAIR: 60.0, OTHER: 55.0, ("load-inertia", "x"): 52.0, ("load-inertia", "y"): 51.0}
    fine = looked_behind(monkeypatch, ahead, earning=(("load-inertia", "x"),))
    # The next is asked with as many runs; who is behind one that earns its name may be a rival.
    both = [[LEADER, PAIR]] * 2
    assert fine.settled[1:] == [*both, [OTHER], [("load-inertia", "x")], [("load-inertia", "y")]]
    assert list(fine.found) == [LEADER, ("load-inertia", "x"), ("load-inertia", "y")]
    fine = looked_behind(monkeypatch, ahead, earning=())
    assert list(fine.found) == [LEADER]


def test_a_further_cause_that_leads_by_less_is_not_asked(monkeypatch):
    """It would be left out before, but the leader gets runs meanwhile."""
    fine = looked_behind(monkeypatch, {PAIR: 60.0, OTHER: 55.0}, earning=(), gains={LEADER: 21.0})
    assert fine.settled == [[PAIR, OTHER], [LEADER, PAIR], [LEADER, PAIR]]
    assert list(fine.found) == [LEADER]


def test_who_brings_more_is_compared_with_others_that_have_as_many_runs(monkeypatch):
    """Those far behind the best get no more than the first."""
    fine = looked_behind(monkeypatch, {PAIR: 60.0, OTHER: 35.0, ("load-inertia", "x"): 29.0})
    assert fine.settled == [[PAIR, OTHER], [LEADER, PAIR], [LEADER, PAIR], [OTHER], [OTHER]]
    assert [len(one.population) for one in fine.found.values()] == [120, 160, 160, 40]


@pytest.mark.parametrize(
    ("looks", "taken_over", "settled"), [(0, False, 0), (2, True, 1), (9, True, 3)]
)
def test_what_may_be_simulated_ends_where_it_is_spent(monkeypatch, looks, taken_over, settled):
    """Before anything comes to all rows, or after that with those runs alone."""
    fine = looked_behind(monkeypatch, {PAIR: 16.0}, looks)
    assert (PAIR in fine.found) == taken_over
    assert len(fine.settled) == settled


def test_nothing_is_looked_for_behind_a_pair_or_behind_nothing():
    for effects in ((), ("amplifier-lag", "load-inertia")):
        leader = SimpleNamespace(hypothesis=Hypothesis(ADSS, effects), best=None)
        # Neither hunt would bear being asked for anything else.
        second_cause.look_for_second(None, SimpleNamespace(best=leader), {}, RNG)
