"""Pairs with a doubted single cause are looked at on all rows, however little few rows show."""

from types import SimpleNamespace

import pytest
import synthetic

from analysis import search
from analysis.causes import Hypothesis

SINGLE = ("tachometer-gain",)
PAIRS = [
    ("shaft-stiffness", "tachometer-gain"),
    ("load-inertia", "tachometer-gain"),
    ("motor-constant", "tachometer-gain"),
    ("motor-resistance", "tachometer-gain"),
]
STRANGER, TRIPLE = ("load-inertia", "motor-constant"), ("motor-constant", *PAIRS[0])


@pytest.fixture
def looked_at():
    """What is looked at on all rows, in how many groups, by who leads there and on few."""

    def look(leader, on_few, known=()):
        taken, heard = [], []
        rough = SimpleNamespace(
            found={key: key for key in on_few}, leading=lambda most: on_few[:most]
        )
        fine = SimpleNamespace(
            best=SimpleNamespace(hypothesis=Hypothesis(synthetic.ADSS, leader)),
            found=dict.fromkeys([leader, *known]),
            take_over=lambda candidates, groups: taken.append((candidates, groups)),
            hear=lambda: heard.append(len(taken)),
        )
        search._look_at_unearned(rough, fine)
        # The reading may be another with them.
        assert heard == [1] * len(taken)
        return taken

    return look


def test_the_best_three_pairs_with_it_are_looked_at_wherever_they_stand(looked_at):
    on_few = [STRANGER, TRIPLE, SINGLE, *PAIRS[:2], (), *PAIRS[2:]]
    assert looked_at(SINGLE, on_few) == [(PAIRS[:3], search._THIRD_GROUPS)]


def test_what_was_looked_at_there_is_not_looked_at_again(looked_at):
    on_few = [*PAIRS, SINGLE]
    assert looked_at(SINGLE, on_few, known=PAIRS[:1]) == [(PAIRS[1:3], search._THIRD_GROUPS)]
    assert looked_at(SINGLE, on_few, known=PAIRS[:3]) == []


@pytest.mark.parametrize("leader", [(), PAIRS[0], STRANGER])
def test_nothing_is_looked_at_behind_the_plain_model_or_a_pair(looked_at, leader):
    assert looked_at(leader, [*PAIRS, STRANGER, TRIPLE, SINGLE, ()]) == []


@pytest.mark.parametrize(("doubtful", "looked"), [(True, 1), (False, 0)])
def test_it_is_done_where_pairs_were_searched_and_the_leader_is_doubted(
    monkeypatch, doubtful, looked
):
    """Whether pairs were searched on few rows, as here, or are on all."""
    done = []
    fine = SimpleNamespace(
        best=SimpleNamespace(hypothesis=Hypothesis(synthetic.ADSS, SINGLE)), found={SINGLE: None}
    )
    monkeypatch.setattr(search, "_third", lambda _: [])
    monkeypatch.setattr(search, "_look_on_all", lambda *_: None)
    monkeypatch.setattr(search, "_plainest", lambda _: SINGLE)
    monkeypatch.setattr(search, "is_doubtful", lambda *_: doubtful)
    monkeypatch.setattr(search, "_look_at_unearned", lambda *_: done.append("unearned"))
    monkeypatch.setattr(search, "give_chances", lambda _: done.append("chances"))
    monkeypatch.setattr(search, "compare", lambda *_: True)
    assert search._look_at_all(None, fine, {}, None, True) == (True, True)
    # They get more runs with all that lead.
    assert done == ["unearned", "chances"] * looked
