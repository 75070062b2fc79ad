"""What is looked for behind a single cause that nobody doubts, given how all stand."""

from types import SimpleNamespace

import pytest
import synthetic

from analysis import search
from analysis.causes import Hypothesis
from analysis.screening import Place

ADSS = synthetic.ADSS


class Beside:
    """A hunt that takes over what it is given, and whose leader is who is likeliest."""

    def __init__(self, leader):
        self.found, self.observation = {leader.hypothesis.effects: leader}, None

    @property
    def best(self):
        return max(self.found.values(), key=lambda c: c.best.log_likelihood)

    def leading(self, most, behind):
        return []

    def take_over(self, candidates, groups):
        self.found |= {c.hypothesis.effects: c for c in candidates}

    def leave_out(self, keys):
        for key in keys:
            del self.found[key]


@pytest.mark.parametrize(
    ("missed", "felt", "tried", "closer"),
    [(1.0, [], 2, 2), (1.1, [], 8, 4), (1.0, [1, 11], 3, 2), (1.1, [11], 9, 4)],
)
def test_more_pairs_are_tried_behind_a_cause_that_predicts_badly(
    monkeypatch, missed, felt, tried, closer
):
    """In the coarse look two are nearly as good as their part; none earns its place.

    Those at the load, whose likelihood there is another, are tried however far behind they are.
    """
    looked, leader = [], ("load-inertia",)

    def standing(likelihood):
        return SimpleNamespace(place=None, log_likelihood=likelihood)

    pairs = {(*leader, f"partner-{i}"): standing(95.0 - 4.0 * i) for i in range(12)}
    found = {key: SimpleNamespace(best=standing(90.0)) for key in pairs}
    found[leader] = SimpleNamespace(best=standing(90.0), hypothesis=Hypothesis(ADSS, leader))
    rough = SimpleNamespace(
        unit=ADSS,
        observation=SimpleNamespace(frequency_hz=None),
        found=found,
        among=list,
        start=lambda places, groups: looked.append(list(places)),
        look_closer=lambda keys, groups: looked.append(keys),
    )
    fine = SimpleNamespace(best=found[leader], observation=None)
    monkeypatch.setattr(search, "screen_singles", lambda *_: {leader: standing(100.0)})
    ranked = list(pairs)
    additions = SimpleNamespace(felt=[ranked[i] for i in felt])
    monkeypatch.setattr(search, "add_causes", lambda *_: additions)
    monkeypatch.setattr(search, "screen_pairs", lambda *_: pairs)
    monkeypatch.setattr(search, "hold_out", lambda *_: SimpleNamespace(rms_sigma=missed))
    search._look_beside(rough, fine, {leader: None}, None)
    asked = ranked[: tried - (11 in felt)] + [ranked[i] for i in felt if i == 11]
    assert looked == [asked, asked[:closer]]


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
    looked, taken = [], []

    def look(rough, places):
        looked.extend(places)
        rough.found |= {one: standing(one, pair_is_at) for one in places}

    rough = SimpleNamespace(
        unit=ADSS, observation=SimpleNamespace(frequency_hz=None), found=found, among=list
    )
    fine = Beside(found[key])
    monkeypatch.setattr(search, "compare", lambda *_: taken.extend(fine.found))
    felt = {pair: Place(None, 100.0 - behind)}
    monkeypatch.setattr(search, "screen_singles", lambda *_: {key: Place(None, 100.0)})
    monkeypatch.setattr(search, "add_causes", lambda *_: SimpleNamespace(felt=felt))
    monkeypatch.setattr(search, "screen_pairs", lambda *_: {})
    monkeypatch.setattr(search, "screen_felt", lambda additions: additions.felt)
    monkeypatch.setattr(search, "look_at_felt", look)
    monkeypatch.setattr(search, "hold_out", lambda *_: SimpleNamespace(rms_sigma=1.0))
    search._look_beside(rough, fine, {key: None}, None)
    assert looked == ([pair] if looked_at else [])
    assert taken == ([key, pair] if taken_over else [])


@pytest.mark.parametrize(
    ("pair", "ahead", "missed", "compared_anew", "stays"),
    [
        # Beside a cause that predicts well a further one has much to bring.
        (("amplifier-lag", "load-inertia"), 38.0, 1.0, True, True),
        (("amplifier-lag", "load-inertia"), 37.0, 1.0, False, False),
        (("amplifier-lag", "load-inertia"), 37.0, 1.1, True, True),
        (("amplifier-lag", "load-inertia"), -1.0, 1.0, False, True),
        # One that it is no part of has not.
        (("amplifier-lag", "shaft-stiffness"), 1.0, 1.0, True, True),
    ],
)
def test_all_are_compared_anew_where_a_pair_takes_the_lead_behind_a_cause(
    monkeypatch, pair, ahead, missed, compared_anew, stays
):
    leader, compared = ("load-inertia",), []
    found = {
        key: SimpleNamespace(
            hypothesis=Hypothesis(ADSS, key),
            population=range(40),
            best=SimpleNamespace(place=None, log_likelihood=likelihood),
        )
        for key, likelihood in ((leader, 100.0), (pair, 100.0 + ahead))
    }
    fine = Beside(found[leader])
    rough = SimpleNamespace(
        unit=ADSS, observation=SimpleNamespace(frequency_hz=None), found=found,
        among=list,
    )  # fmt: skip
    alone = {leader: Place(None, 100.0)}
    monkeypatch.setattr(search, "screen_singles", lambda *_: alone)
    monkeypatch.setattr(search, "add_causes", lambda *_: SimpleNamespace(felt=[]))
    monkeypatch.setattr(search, "screen_pairs", lambda *_: {pair: Place(None, 100.0)})
    monkeypatch.setattr(search, "_narrow", lambda *_: [pair])
    monkeypatch.setattr(search, "hold_out", lambda *_: SimpleNamespace(rms_sigma=missed))
    monkeypatch.setattr(search, "compare", lambda *_: compared.append(fine.best))
    search._look_beside(rough, fine, {leader: None}, None)
    assert compared == ([found[pair]] if compared_anew else [])
    assert (pair in fine.found) == stays
