"""Rare causes, held against whatever leads a search of which all but the simulations is real."""

import pytest
import synthetic_search

from sim.catalogue import CATALOGUE, COMMON

RARE = [(name,) for name, effect in CATALOGUE.items() if effect.rare]


@pytest.mark.parametrize(
    ("effect", "seed"),
    [pytest.param("motor-inertia", 2, marks=pytest.mark.study), ("amplifier-dead-zone", 3)],
)
def test_a_rare_cause_is_named_where_it_is_hidden(runs, effect, seed):
    _, verdict = synthetic_search.diagnosed((effect,), [0.8], seed)
    assert (verdict.word, verdict.best.effects) == ("explained", (effect,))
    assert verdict.best.candidate.best.place == pytest.approx([0.4, 0.8], abs=0.1)


def test_a_usual_cause_stays_and_few_rare_ones_are_looked_at(runs):
    _, verdict = synthetic_search.diagnosed(("load-inertia",), [0.8], 1)
    assert (verdict.word, verdict.best.effects) == ("explained", ("load-inertia",))
    assert sum(key in runs for key in RARE) <= 2
    assert all(runs[key] <= 60 for key in RARE)


def test_none_is_looked_at_where_nothing_is_missing_or_all_are_left_out(runs):
    synthetic_search.diagnosed((), [], 1)
    assert not any(key in runs for key in RARE)
    without = [*synthetic_search.FELT, *(name for (name,) in RARE)]
    found, _ = synthetic_search.diagnosed(("load-inertia",), [0.8], 1, without=without)
    assert {effect for one in found for effect in one.hypothesis.effects} <= set(COMMON)
