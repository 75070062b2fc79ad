"""Others are tried beside a second cause where the first is a resonance that nobody has seen."""

from types import SimpleNamespace

import pytest

from analysis import second_cause

FIRST, SECOND, PAIR = ("payload",), ("play",), ("payload", "play")
SHAFT, LOAD, BRAKE = ("play", "shaft"), ("load", "play"), ("brake", "play")


class Looked:
    """A hunt in which sets stand so far ahead of nothing."""

    def __init__(self, standing, spent=False):
        self.found = {
            key: SimpleNamespace(
                hypothesis=SimpleNamespace(effects=key),
                best=SimpleNamespace(log_likelihood=value, place=f"where {key} is"),
            )
            for key, value in standing.items()
        }
        self.purse = SimpleNamespace(is_spent=spent)
        self.started, self.taken = {}, []

    @property
    def best(self):
        return max(self.found.values(), key=lambda one: one.best.log_likelihood)

    def start(self, places, groups):
        assert groups == 6
        self.started |= places

    def among(self, keys):
        return sorted(keys, key=lambda key: -self.found[key].best.log_likelihood)

    def take_over(self, candidates, groups):
        assert groups == 8
        self.taken += [one.hypothesis.effects for one in candidates]


def replaced(monkeypatch, fine, rough, outside=True):
    """Who is looked at on all rows, and beside what others were looked at on few."""
    beside, caught_up = [], []

    def look(hunt, additions, kept):
        assert (hunt, additions) == (rough, "sums")
        # The pair and its causes are known there by then.
        assert rough.started == {PAIR: "where ('payload', 'play') is"}
        beside.append(kept)
        return {SHAFT, LOAD, BRAKE} & set(rough.found)

    def catch_up(hunt, newcomers, leader):
        assert (hunt, leader) == (fine, PAIR)
        caught_up.extend(newcomers)

    monkeypatch.setattr(
        second_cause,
        "is_out_of_band",
        lambda one: outside and one.hypothesis.effects == FIRST,
    )
    monkeypatch.setattr(second_cause, "look_at_parts", lambda hunt, pair: None)
    monkeypatch.setattr(second_cause, "look_beside_all", look)
    monkeypatch.setattr(second_cause, "catch_up", catch_up)
    second_cause._replace_first(rough, fine, "sums", FIRST)
    assert caught_up == fine.taken
    return fine.taken, beside


FINE = {FIRST: 0.0, PAIR: 190.0}
ROUGH = {PAIR: 320.0, FIRST: 305.0, SECOND: 100.0, ("shaft",): 90.0}


@pytest.mark.parametrize(
    ("standing", "taken"),
    [
        # Some are close, and explain more than either of their causes.
        ({SHAFT: 302.0, LOAD: 291.0}, [SHAFT, LOAD]),
        ({SHAFT: 291.0, LOAD: 289.0}, [SHAFT]),
        # Two of them at most, who do best.
        ({SHAFT: 302.0, LOAD: 310.0, BRAKE: 305.0}, [LOAD, BRAKE]),
        ({SHAFT: 302.0, ("shaft",): 298.0}, []),
        ({SHAFT: 289.0}, []),
    ],
)
def test_who_does_as_well_beside_the_second_is_looked_at_on_all_rows(monkeypatch, standing, taken):
    rough = Looked(ROUGH | standing)
    found, beside = replaced(monkeypatch, Looked(FINE), rough)
    assert beside == [{SECOND: "where ('play',) is"}]
    assert found == taken


def test_who_was_looked_at_there_before_is_not_looked_at_again(monkeypatch):
    fine, rough = Looked(FINE | {SHAFT: -50.0}), Looked(ROUGH | {SHAFT: 302.0, LOAD: 300.0})
    assert replaced(monkeypatch, fine, rough)[0] == [LOAD]


@pytest.mark.parametrize(
    ("standing", "spent", "outside"),
    [
        # The resonance was seen; nothing more may be simulated; no second cause is left.
        (FINE, False, False),
        (FINE, True, True),
        ({FIRST: 0.0}, False, True),
        ({FIRST: 0.0, SHAFT: 10.0}, False, True),
    ],
)
def test_nobody_is_tried_where_there_is_no_call_for_it(monkeypatch, standing, spent, outside):
    fine, rough = Looked(standing, spent), Looked(ROUGH | {SHAFT: 302.0})
    assert replaced(monkeypatch, fine, rough, outside) == ([], [])
    assert rough.started == {}
