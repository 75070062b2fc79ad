"""The parts of a set of causes."""

from types import SimpleNamespace

import numpy as np
import pytest
import synthetic

from analysis import parts
from analysis.causes import Hypothesis

ADSS = synthetic.ADSS


def test_the_parts_of_a_pair_stand_where_the_pair_has_them():
    pair = Hypothesis(ADSS, ("amplifier-lag", "payload-flexibility"))
    place = np.array([0.4, 0.1, 0.2, 0.3, 0.5])
    best = SimpleNamespace(hypothesis=pair, best=SimpleNamespace(place=place))
    found = parts.places_of_parts(best)
    assert found[("amplifier-lag",)].tolist() == [0.4, 0.1]
    assert found[("payload-flexibility",)].tolist() == [0.4, 0.2, 0.3, 0.5]


def test_two_of_three_stand_where_the_three_have_them():
    three = Hypothesis(ADSS, ("amplifier-lag", "load-inertia", "payload-flexibility"))
    place = np.array([0.4, 0.1, 0.2, 0.3, 0.5, 0.6])
    best = SimpleNamespace(hypothesis=three, best=SimpleNamespace(place=place))
    found = parts.places_of_parts(best)
    assert {key: at.tolist() for key, at in found.items()} == {
        ("amplifier-lag", "load-inertia"): [0.4, 0.1, 0.2],
        ("amplifier-lag", "payload-flexibility"): [0.4, 0.1, 0.3, 0.5, 0.6],
        ("load-inertia", "payload-flexibility"): [0.4, 0.2, 0.3, 0.5, 0.6],
    }


def standing(likelihood):
    return SimpleNamespace(best=SimpleNamespace(log_likelihood=likelihood))


def test_the_parts_of_a_set_are_those_that_were_looked_at():
    found = [("a",), ("b",), ("c",), ("a", "c"), ("a", "b", "c"), ("b", "d"), ()]
    assert parts.parts_of(("a", "b", "c"), found) == [("a",), ("b",), ("c",), ("a", "c")]
    assert parts.parts_of(("a", "d"), found) == [("a",)]
    assert parts.parts_of(("a",), found) == parts.parts_of((), found) == []


@pytest.mark.parametrize(("ahead", "does"), [(5.9, False), (6.1, True), (-50.0, False)])
def test_a_set_earns_its_place_by_what_it_explains_beyond_the_best_of_its_parts(ahead, does):
    found = {("a",): standing(-300.0), ("b",): standing(10.0), ("a", "b"): standing(10.0 + ahead)}
    assert parts.earns(("a", "b"), found) is does


def test_a_set_none_of_whose_parts_was_looked_at_earns_its_place():
    assert parts.earns(("a", "b"), {("a", "b"): standing(-1000.0)})
