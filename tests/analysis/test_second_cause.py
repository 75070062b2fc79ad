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
        self.looks, self.gains, self.taken = looks, gains or {}, 0

    @property
    def purse(self):
        return SimpleNamespace(is_spent=len(self.settled) + self.taken >= self.looks)

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
            self.found[key].population = range(len(self.found[key].population) + 5 * groups)
            self.found[key].best.log_likelihood += self.gains.get(key, 0.0)

    def hear(self):
        pass

    def take_over(self, candidates, groups):
        self.found |= {c.hypothesis.effects: c for c in candidates}
        self.taken += len(candidates)

    def leave_out(self, keys):
        for key in keys:
            del self.found[key]


@pytest.fixture(autouse=True)
def resonates_outside(monkeypatch):
    """The first causes of sets that are told by a resonance outside what was measured."""
    outside = set()
    monkeypatch.setattr(
        second_cause, "is_out_of_band", lambda one: bool(outside & set(one.hypothesis.effects))
    )
    return outside


@pytest.fixture(autouse=True)
def lent(monkeypatch):
    """By how much more sets lead a leader with its runs lent to them than by their own."""
    more = {}

    def leads(hunt, additions, leader, keys):
        # Nobody is asked about where there is nothing to ask.
        assert keys
        alone = hunt.found[leader].best.log_likelihood
        return {k: hunt.found[k].best.log_likelihood - alone + more.get(k, 0.0) for k in keys}

    monkeypatch.setattr(second_cause, "leads_with_lent", leads)
    return more


@pytest.mark.parametrize(
    ("own", "lent", "gains", "closer", "kept"),
    [
        # The best six with lent runs are looked at closer, and the best three by their own.
        (
            (-44.0, -5.0, -46.0, -46.0, -46.0, -46.0, -46.0, -44.5, -8.0),
            (0.0, 6.0, 5.0, 7.0, 4.0, 3.5, 3.4, 3.3, -1.0),
            (3.0, 3.0, 1.0, 3.0, 1.0, 1.0, 1.0, 3.0, 3.0), [3, 1, 2, 4, 5, 6, 8, 0], [3, 1, 8, 0],
        ),
        # None by its own runs that is far behind, and no more than six by lent ones.
        (
            (-46.0,) * 6 + (-45.5, -45.5), (6.0, 5.0, 4.0, 3.5, 3.4, 3.3, 3.2, 3.1),
            (1.0,) * 3 + (3.0,) * 5, [0, 1, 2, 3, 4, 5], [3, 4, 5, 0],
        ),
        # Those that explain more of what was observed than of the leader's own runs go on, however
        # little they lead by,
        ((-50.0,) * 3, (-0.1, 5.0, -2.9), (1.9, 2.1, 2.1), [1, 0, 2], [1, 2]),
        # and who leads by about as much as they do,
        ((-50.0,) * 3, (8.6, 3.7, 3.5), (4.8, 1.8, 1.9), [0, 1, 2], [0, 1]),
        ((-50.0,) * 3, (8.6, 12.0, 14.0), (2.1, -1.0, -2.0), [2, 1, 0], [0, 1, 2]),
        # or by more than chance does.
        ((-50.0,) * 3, (20.1, 16.0, 15.0), (1.0, 1.5, 1.6), [0, 1, 2], [1, 0]),
        ((-50.0,) * 3, (19.9, 12.0, 7.0), (1.9, -1.0, -2.0), [0, 1, 2], []),
        ((-50.0,) * 3, (12.0, 5.0, -3.1), (1.9, -1.0, 2.1), [0, 1, 2], []),
        # Four at most, who explain most of all.
        (
            (-30.0, -29.0, -28.0, -9.0, -8.0, -7.0), (9.0, 8.0, 7.0, 6.0, 5.0, 4.0),
            (2.5, 2.4, 2.3, 2.6, 2.7, 2.8), [0, 1, 2, 3, 4, 5], [5, 4, 3, 0],
        ),
    ],
)  # fmt: skip
def test_those_placed_best_beside_a_leader_are_kept_where_runs_bear_them_out(
    monkeypatch, own, lent, gains, closer, kept
):
    """Sixteen are simulated about their places, and the leader as often about its own."""
    leader, place, started, settled, mirrored = ("load-inertia",), np.array([0.3, 0.6]), {}, [], []
    placed = {
        (*leader, f"partner-{i:02}"): Place(np.array([0.3, 0.6, 0.1 * i]), 95.0 - 4.0 * i)
        for i in range(20)
    }
    partner = list(placed)
    # Who was placed best is not who does best: the first of those given was placed last.
    given = dict(zip(partner[15::-1], zip(own, lent, strict=True), strict=False))

    class Rough:
        unit, observation = ADSS, SimpleNamespace(blocks=(slice(0, 21),))
        found = {}

        def thinned(self, stride):
            return ("few", stride)

        def start(self, places, groups, reach=None):
            assert reach == (0.12, 0.03)
            if groups == 2:
                mirrored.extend(places)
                return
            started.update(places)
            assert groups == 4
            for key in places:
                off = 0.0 if key == leader else given.get(key, (-300.0, -300.0))[0]
                best = SimpleNamespace(log_likelihood=100.0 + off, place=None)
                self.found[key] = SimpleNamespace(best=best)

        def settle(self, keys, groups):
            assert groups == 6
            settled.extend(keys)

        def among(self, keys):
            return sorted(keys, key=lambda key: -self.found[key].best.log_likelihood)

    def beside(few, additions, known, at):
        assert (few, additions, known.effects, at is place) == (("few", 2), "sums", leader, True)
        return placed

    def leads(hunt, additions, of, keys):
        assert (additions, of) == ("sums", leader)
        return {key: given.get(key, (0.0, -300.0))[1] for key in keys}

    def explain(hunt, additions, of, keys, rng):
        assert (additions, of, list(keys)) == ("sums", leader, settled)
        known = dict(zip(given, gains, strict=True))
        return {key: known.get(key, -1.0) for key in keys}

    monkeypatch.setattr(second_cause, "place_beside", beside)
    monkeypatch.setattr(second_cause, "on_the_other_side", lambda known, places: list(places)[1:3])
    monkeypatch.setattr(second_cause, "leads_with_lent", leads)
    monkeypatch.setattr(second_cause, "gains_with_lent", explain)
    monkeypatch.setattr(pairs, "_is_at_an_end", lambda _: False)
    alone = SimpleNamespace(hypothesis=Hypothesis(ADSS, leader), best=SimpleNamespace(place=place))
    found = second_cause._worth(Rough(), "sums", alone, RNG)
    assert set(started) == {leader, *partner[:16]}
    assert all(started[key] is placed[key].place for key in partner[:16])
    assert mirrored == partner[1:3]
    assert [key for key in settled if key in given] == [list(given)[i] for i in closer]
    assert list(found.items()) == [(list(given)[i], lent[i]) for i in kept]


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
    monkeypatch.setattr(second_cause, "_worth", lambda *_: {})
    monkeypatch.setattr(second_cause, "screen_felt", lambda additions: additions.felt)
    monkeypatch.setattr(second_cause, "look_at_felt", look)
    second_cause.look_for_second(rough, fine, {key: None}, key, RNG)
    assert looked == ([pair] if looked_at else [])
    assert list(fine.found) == ([key, pair] if taken_over else [key])
    assert fine.settled == ([[key, pair]] * 3 if taken_over else [])


LEADER, PAIR = ("load-inertia",), ("amplifier-lag", "load-inertia")
OTHER = ("load-inertia", "shaft-damping")


def looked_behind(
    monkeypatch, ahead, looks=99, *, earning=(PAIR, OTHER), gains=None, few=5.0, runs=None,
    asked_with=None, before=None, stands_for_it=None,
):  # fmt: skip
    """The hunt on all rows after pairs were worth it, so far ahead of their leader.

    `runs`: of some of them, where it is not 40; `asked_with`: where runs of who is asked are kept;
    `before`: what else stands on all rows, and how far ahead; `stands_for_it`: what says the same
    as the leader with more sizes.
    """
    runs = runs or {}
    found = {
        key: SimpleNamespace(
            hypothesis=Hypothesis(ADSS, key),
            population=range(runs.get(key, 40)),
            best=SimpleNamespace(place=None, log_likelihood=likelihood),
        )
        for key, likelihood in ((LEADER, 100.0), *((k, 100.0 + a) for k, a in ahead.items()))
    }
    fine = Beside(found[LEADER], looks, gains or {})
    for key, likelihood in (before or {}).items():
        best = SimpleNamespace(place=None, log_likelihood=100.0 + likelihood)
        fine.found[key] = SimpleNamespace(hypothesis=Hypothesis(ADSS, key), best=best)
    rough = SimpleNamespace(unit=ADSS, observation=SimpleNamespace(frequency_hz=None), found=found)
    monkeypatch.setattr(second_cause, "add_causes", lambda *_: None)
    monkeypatch.setattr(second_cause, "_worth", lambda *_: dict.fromkeys(ahead, few))
    monkeypatch.setattr(second_cause, "_stood_for", lambda *_: [])
    monkeypatch.setattr(second_cause, "_look_at_second_alone", lambda *_: None)
    monkeypatch.setattr(
        second_cause, "is_felt_alike", lambda one, _: one.hypothesis.effects == stands_for_it
    )

    refusals = []

    def asked(whole, part, _, refused):
        assert part.hypothesis.effects == LEADER
        assert refused == len(refusals)
        refusals.append(whole)
        enough = min(len(part.population), second_cause._ASKED)
        assert fine.purse.is_spent or len(whole.population) >= enough
        if asked_with is not None:
            asked_with.append(len(whole.population))
        return whole.hypothesis.effects in earning

    monkeypatch.setattr(second_cause, "earns_its_name", asked)
    second_cause.look_for_second(rough, fine, {LEADER: None}, LEADER, RNG)
    return fine


@pytest.mark.parametrize(
    ("ahead", "hopeful", "more", "stays"),
    [
        (24.0, True, 3, True),
        # It would be too little to be named in the end, whatever chance brings.
        (22.0, True, 3, False),
        (16.0, True, 3, False),
        (14.0, True, 0, False),
        (9.0, False, 0, False),
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
    fine = looked_behind(monkeypatch, ahead, earning=(OTHER,))
    # The next is asked with as many runs; who is behind one that earns its name may be a rival.
    both, others = [[LEADER, PAIR]] * 3, [("load-inertia", "x"), ("load-inertia", "y")]
    assert fine.settled[1:] == [*both, *[[OTHER]] * 2, *[others] * 2]
    assert list(fine.found) == [LEADER, OTHER, *others]
    # Where two bring no more, no third is asked.
    fine = looked_behind(monkeypatch, ahead, earning=others)
    assert fine.settled[1:] == [*both, *[[OTHER]] * 2]
    assert list(fine.found) == [LEADER]


@pytest.mark.parametrize("alike", [False, True])
def test_where_what_leads_says_the_same_as_the_leader_no_rival_is_kept_for_it(monkeypatch, alike):
    """Behind a heavier load that a payload leads it is that load whose second cause was chance."""
    payload = ("payload-flexibility",)
    fine = looked_behind(
        monkeypatch, {PAIR: 60.0, OTHER: 16.0}, earning=(),
        before={payload: 20.0}, stands_for_it=payload if alike else None,
    )  # fmt: skip
    assert list(fine.found) == [LEADER, payload, *([] if alike else [OTHER])]


@pytest.mark.parametrize(
    ("earning", "asked", "left"), [((), 2, []), ((PAIR,), 1, [PAIR, OTHER]), ((OTHER,), 2, [OTHER])]
)
def test_behind_a_cause_of_many_runs_who_earns_its_name_gets_as_many_afterwards(
    monkeypatch, earning, asked, left
):
    """More of them hardly change what is chance, and are for a comparison.

    Whoever is asked next is asked with as many as the first.
    """
    with_runs = []
    ahead, runs = {PAIR: 60.0, OTHER: 55.0}, {LEADER: 220}
    fine = looked_behind(monkeypatch, ahead, earning=earning, runs=runs, asked_with=with_runs)
    assert with_runs == [160] * asked
    assert {key: len(one.population) for key, one in fine.found.items()} == dict.fromkeys(
        [LEADER, *left], 220
    )


def test_a_further_cause_that_leads_by_less_is_not_asked(monkeypatch):
    """It would be left out before, but the leader gets runs meanwhile."""
    fine = looked_behind(monkeypatch, {PAIR: 60.0, OTHER: 55.0}, earning=(), gains={LEADER: 14.0})
    assert fine.settled == [[PAIR, OTHER], *[[LEADER, PAIR]] * 3]
    assert list(fine.found) == [LEADER]


@pytest.mark.parametrize(("lead", "asked"), [(35.0, False), (37.0, True)])
def test_who_leads_by_far_less_than_what_was_chance_is_not_asked(monkeypatch, lead, asked):
    fine = looked_behind(monkeypatch, {PAIR: 60.0, OTHER: lead}, earning=(OTHER,))
    assert list(fine.found) == [LEADER, OTHER][: 1 + asked]
    assert fine.settled[4:] == [[OTHER]] * 2 * asked


@pytest.mark.parametrize(("looks", "runs"), [(99, 130), (6, 70)])
def test_who_is_left_is_asked_with_the_runs_it_has_where_all_is_spent(monkeypatch, looks, runs):
    """By few runs a cause leads by less: what then brings more than chance does is no chance."""
    ahead = {PAIR: 60.0, OTHER: 55.0}
    fine = looked_behind(monkeypatch, ahead, looks, earning=(OTHER,))
    assert list(fine.found) == [LEADER, OTHER]
    assert len(fine.found[OTHER].population) == runs


def test_who_brings_more_is_compared_with_others_that_have_as_many_runs(monkeypatch):
    """Those far behind the best get no more than the first."""
    fine = looked_behind(monkeypatch, {PAIR: 60.0, OTHER: 35.0, ("load-inertia", "x"): 29.0})
    assert fine.settled == [[PAIR, OTHER], *[[LEADER, PAIR]] * 3, *[[OTHER]] * 3]
    assert [len(one.population) for one in fine.found.values()] == [130, 160, 160, 40]


def test_who_leads_with_lent_runs_gets_as_many_of_its_own_before_it_is_asked(monkeypatch, lent):
    """Few runs leave a true pair behind its own part, and beside another true one."""
    third = ("load-inertia", "x")
    lent |= {PAIR: 80.0, OTHER: 90.0, third: 90.0}
    fine = looked_behind(monkeypatch, {PAIR: -20.0, OTHER: -50.0, third: -65.0})
    assert fine.settled == [[PAIR, OTHER], *[[LEADER, PAIR]] * 3, *[[OTHER]] * 3]
    assert [len(one.population) for one in fine.found.values()] == [130, 160, 160, 40]


@pytest.mark.parametrize(("few", "once_more"), [(19.0, False), (21.0, True)])
def test_who_led_by_much_on_few_rows_gets_a_second_chance_on_all(monkeypatch, few, once_more):
    """The first runs there lie where they lie by chance."""
    fine = looked_behind(monkeypatch, {PAIR: -76.0}, few=few, gains={PAIR: 110.0})
    assert bool(fine.settled) == once_more
    assert (PAIR in fine.found) == once_more


@pytest.mark.parametrize(
    ("looks", "taken_over", "settled"), [(0, False, 0), (2, True, 1), (9, True, 4)]
)
def test_what_may_be_simulated_ends_where_it_is_spent(monkeypatch, looks, taken_over, settled):
    """Before anything comes to all rows, or after that with those runs alone."""
    fine = looked_behind(monkeypatch, {PAIR: 24.0}, looks)
    assert (PAIR in fine.found) == taken_over
    assert len(fine.settled) == settled
