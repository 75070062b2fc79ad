"""A second cause that is all there is: it is held against the first by itself."""

from types import SimpleNamespace

import numpy as np
import pytest
import synthetic_search

from analysis import second_cause
from analysis.second_cause import _CALLED_FOR, _look_at_second_alone, _Standing

# What only stands for it does a part of what it does, and both together no more than it does.
FIRST, SECOND = ("load-inertia",), ("motor-resistance",)
BOTH = (*FIRST, *SECOND)
PLACE = np.array([0.4, 0.5, 0.8])


@pytest.fixture
def hunt(monkeypatch):
    synthetic_search.simulate_in(monkeypatch)
    hunt = synthetic_search.hunted([0.8], 1, SECOND)
    hunt.start({FIRST: PLACE[:2], BOTH: PLACE, (): PLACE[:1]}, 8)
    hunt.settle([FIRST], 8)
    return hunt


def look(hunt, lead):
    standing = _Standing(hunt, None, FIRST, {BOTH: lead})
    before = {key: len(one.population) for key, one in hunt.found.items()}
    _look_at_second_alone(standing)
    return before


def test_one_that_leads_the_first_is_found_and_gets_as_many_runs(hunt):
    before = look(hunt, _CALLED_FOR + 5.0)
    assert hunt.found[SECOND].best.log_likelihood > hunt.found[FIRST].best.log_likelihood + 30.0
    assert len(hunt.found[SECOND].population) >= before[FIRST]
    assert {k: len(hunt.found[k].population) for k in before} == before


def test_one_that_is_known_is_not_looked_at_again(hunt):
    hunt.start({SECOND: PLACE[[0, 2]]}, 4)
    before = look(hunt, _CALLED_FOR + 5.0)
    assert {key: len(one.population) for key, one in hunt.found.items()} == before


def test_beside_what_may_be_chance_none_is(hunt):
    look(hunt, _CALLED_FOR - 1.0)
    assert SECOND not in hunt.found


def test_where_all_is_spent_none_is(hunt):
    hunt.purse = SimpleNamespace(is_spent=True)
    look(hunt, _CALLED_FOR + 5.0)
    assert SECOND not in hunt.found


def test_what_is_far_behind_gets_no_more_runs(hunt, monkeypatch):
    monkeypatch.setattr(second_cause, "_BEHIND", -1e9)
    look(hunt, _CALLED_FOR + 5.0)
    assert len(hunt.found[SECOND].population) == 5 * second_cause._ALL_GROUPS
