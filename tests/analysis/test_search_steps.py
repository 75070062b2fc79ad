"""Each step of the search by itself: who gets runs, and how many, given how all stand."""

from types import SimpleNamespace

import numpy as np
import pytest
import synthetic

from analysis import contest, search
from analysis.causes import Hypothesis
from analysis.purse import Purse
from analysis.screening import Place
from sim.effort import Effort

ADSS = synthetic.ADSS


def test_close_single_causes_are_looked_at_on_all_rows_however_many_pairs_stand_before_them():
    def standing(effects, likelihood):
        best = SimpleNamespace(
            place=np.zeros(Hypothesis(ADSS, effects).d), log_likelihood=likelihood
        )
        seen = SimpleNamespace(observation=SimpleNamespace(frequency_hz=np.array([100.0, 140.0])))
        return SimpleNamespace(best=best, hypothesis=Hypothesis(ADSS, effects), surface=seen)

    pairs = [("motor-constant", partner) for partner in ("motor-resistance", "total-backlash",
             "motor-viscous-friction", "shaft-hardening", "tachometer-gain")]  # fmt: skip
    singles = {"motor-resistance": 85.0, "amplifier-gain": 78.0, "shaft-stiffness": 56.0,
               "amplifier-lag": 54.0, "motor-constant": 60.0, "filter-corner": 57.0}  # fmt: skip
    found = {pair: standing(pair, 130.0 - i) for i, pair in enumerate(pairs)}
    found |= {(one,): standing((one,), likelihood) for one, likelihood in singles.items()}
    found[()] = standing((), 0.0)
    ranking = sorted(found, key=lambda key: -found[key].best.log_likelihood)
    rough = SimpleNamespace(found=found, leading=lambda *_: ranking)
    looked_at = search._third(rough)
    assert looked_at[:4] == pairs[:4]
    # Three at most; the parts of the leading pair and the baseline are there in any case.
    assert set(looked_at[4:]) == {
        ("motor-resistance",), ("motor-constant",), ("amplifier-gain",), (),
    }  # fmt: skip
    assert search._close_singles(rough) == [
        ("motor-resistance",), ("amplifier-gain",), ("motor-constant",),
    ]  # fmt: skip
    found[("amplifier-gain",)].best.log_likelihood = 54.0
    assert ("amplifier-gain",) not in search._close_singles(rough)


@pytest.mark.parametrize(
    ("f_p", "behind", "taken"), [(5.0, 299.0, True), (5.0, 301.0, False), (0.9, 299.0, False)]
)
def test_who_says_the_same_as_a_leader_with_fewer_sizes_is_looked_at_with_it(f_p, behind, taken):
    """A payload far above all that was measured is a heavier load; one amid it is a payload."""
    payload, load = ("payload-flexibility",), ("load-inertia",)
    behind_by = {payload: 0.0, ("motor-constant",): 5.0, load: behind, (): 100.0}
    hypothesis = Hypothesis(ADSS, payload)
    place = hypothesis.place(0.4, [0.2 * ADSS.load.J_L, f_p * synthetic.FREQUENCIES[-1], 0.02])
    seen = SimpleNamespace(frequency_hz=synthetic.FREQUENCIES)

    def standing(effects):
        one = Hypothesis(ADSS, effects)
        best = SimpleNamespace(
            place=place if effects == payload else np.full(one.d, 0.5),
            log_likelihood=-behind_by[effects],
        )
        return SimpleNamespace(hypothesis=one, best=best, surface=SimpleNamespace(observation=seen))

    def leading(most, within):
        ranked = sorted(behind_by, key=behind_by.get)
        return [key for key in ranked if behind_by[key] <= within][:most]

    found = {key: standing(key) for key in behind_by}
    rough = SimpleNamespace(found=found, leading=leading)
    expected = [payload, ("motor-constant",), (), *([load] if taken else [])]
    assert sorted(search._third(rough)) == sorted(expected)


@pytest.mark.parametrize(
    ("runs_of_part", "at", "hopeful", "weighed", "closer"),
    [
        (0, None, True, True, False), (79, 0.1, True, True, False), (80, 0.1, True, True, False),
        (81, 0.1, True, False, False), (81, 0.19, True, False, False),
        # However many it has: friction of a motor had 240 at another ratio.
        (240, 0.21, True, False, True), (40, 0.21, True, False, True),
        (240, 0.21, False, False, False), (40, 0.21, False, True, False),
        # Who is hopeless where the pair has it is known well enough.
        (40, 0.19, False, False, False),
    ],
)  # fmt: skip
def test_a_part_with_no_more_runs_than_a_pair_or_at_another_ratio_is_weighed_where_the_pair_has_it(
    runs_of_part, at, hopeful, weighed, closer
):
    pair, part = ("amplifier-gain", "payload-flexibility"), ("payload-flexibility",)
    own = np.array([0.1, 0.2, 0.3, 0.4])
    other = SimpleNamespace(population=range(200), best=SimpleNamespace(place=np.array([0.1, 0.5])))
    known, started = {("amplifier-gain",): other}, []
    if runs_of_part:
        best = SimpleNamespace(place=np.array([at, *own[1:]]))
        known[part] = SimpleNamespace(population=range(runs_of_part), best=best)
    leader = SimpleNamespace(
        hypothesis=Hypothesis(ADSS, pair),
        best=SimpleNamespace(place=np.array([0.1, 0.5, 0.2, 0.3, 0.4])),
        population=range(80),
    )

    def start(places, groups, of_many=0, reach=None):
        more = max(groups, of_many)
        started.extend((key, place.tolist(), more, reach) for key, place in places.items())
        fine.found |= dict.fromkeys(places, other)

    def leading(most, behind):
        # Who lies between gets runs where the pair has it, and no more of them.
        assert behind == (contest.TOO_FAR if started else contest.HOPELESS)
        return [pair, *([part] if hopeful and part in fine.found else [])]

    fine = SimpleNamespace(
        best=leader,
        found={pair: leader, **known},
        start=start,
        leading=leading,
        settle=lambda chosen, groups: started.append(chosen),
        hear=lambda: None,
    )
    contest.weigh_parts(fine)
    wide, close = (part, own.tolist(), 6, None), (part, own.tolist(), 12, (0.1, 0.03))
    more = [[part] if hopeful else []] if weighed or closer else []
    assert started == [wide] * weighed + [close] * closer + more


def test_two_of_three_causes_are_weighed_where_the_three_lead(monkeypatch):
    """They may not have been looked at, and explain as much."""
    pair, third = ("amplifier-lag", "load-inertia"), "mesh1-damping"
    three = Hypothesis(ADSS, (*pair, third))

    def standing(effects, likelihood):
        hypothesis = Hypothesis(ADSS, effects)
        best = SimpleNamespace(place=np.full(hypothesis.d, 0.3), log_likelihood=likelihood)
        return SimpleNamespace(hypothesis=hypothesis, best=best)

    found = {pair: standing(pair, 100.0)}
    looked = []

    def rough_start(places, groups):
        found[three.effects] = standing(three.effects, 200.0)

    rough = SimpleNamespace(
        unit=ADSS,
        observation=None,
        found=found,
        among=list,
        start=rough_start,
        look_closer=lambda keys, groups: None,
    )
    fine = SimpleNamespace(
        best=found[pair],
        take_over=lambda candidates, groups: setattr(fine, "best", candidates[0]),
        start=lambda places, groups: looked.append(set(places)),
    )
    monkeypatch.setattr(search, "add_causes", lambda *_: None)
    monkeypatch.setattr(
        search, "screen_further", lambda *_: {three.effects: standing(three.effects, 1.0).best}
    )
    monkeypatch.setattr(search, "compare", lambda *_: True)
    search._search_triples(rough, fine, {}, None)
    assert looked == [{pair, ("amplifier-lag", third), ("load-inertia", third)}]


def test_single_causes_are_started_at_both_ratios_that_their_atlas_favours(monkeypatch):
    """An EDSS with little play at a ratio of 0.9 was looked at about 0.4 alone, and unexplained."""
    here, there = np.array([0.4, 0.46]), np.array([0.85, 0.4])
    places = {
        ("total-backlash",): Place(here, 162.0, there),
        ("load-inertia",): Place(here, 181.0),
        (): Place(here[:1], 100.0),
    }
    started = []
    rough = SimpleNamespace(
        unit=ADSS,
        observation=None,
        start=lambda starts, groups, of_many=0: started.append(starts),
        hear=lambda: None,
        leading=lambda *_: [],
        look_closer=lambda keys, groups: None,
    )
    monkeypatch.setattr(search, "screen_singles", lambda *_: places)
    monkeypatch.setattr(search, "is_doubtful_at_once", lambda *_: False)
    assert not search._look_at_few(rough, {}, None)
    first, second = started
    assert set(first) == set(places)
    assert all(first[key] is places[key].place for key in places)
    assert list(second) == [("total-backlash",)]
    assert second["total-backlash",] is there


@pytest.mark.parametrize(
    ("refused", "steps"),
    [(False, []), (True, ["pairs", "taken over", "unearned", "chances", "compare", "predict"])],
)
def test_pairs_are_searched_late_where_a_single_cause_would_be_refused_after_all(
    monkeypatch, refused, steps
):
    """A motor's friction with a torque on the load: friction alone left a shape with 240 runs."""
    pair, single, done = ("load-torque-bias", "motor-coulomb-friction"), ("load-inertia",), []
    fine = SimpleNamespace(
        found={single: None},
        take_over=lambda candidates, groups: done.append("taken over") or given.extend(candidates),
        hear=lambda: None,
    )
    found = {
        key: SimpleNamespace(hypothesis=Hypothesis(synthetic.ADSS, key)) for key in (pair, single)
    }
    rough, given = SimpleNamespace(found=found, leading=lambda *_: [pair, single]), []
    monkeypatch.setattr(search, "_third", lambda _: [pair, single])
    monkeypatch.setattr(search, "is_refused_now", lambda *_: refused)
    for name, step in {
        "search_pairs": "pairs", "_look_at_unearned": "unearned", "give_chances": "chances",
        "compare": "compare", "see_it_predict": "predict",
    }.items():  # fmt: skip
        monkeypatch.setattr(search, name, lambda *_, step=step: done.append(step))
    search._search_late(rough, fine, {}, None)
    assert done == steps
    # Who is looked at on all rows already is not taken over once more.
    assert given == ([found[pair]] if refused else [])


@pytest.mark.parametrize(("plain", "fewer"), [(199.0, False), (201.0, True)])
def test_a_cause_of_one_size_that_few_rows_leave_far_behind_gets_fewer_runs(plain, fewer):
    """The baseline is what all is held against, and who has many sizes needs runs to fit."""
    behind = {
        ("load-coulomb-friction",): 0.0,
        ("load-inertia",): 59.0,
        ("total-backlash",): 61.0,
        ("payload-flexibility",): 90.0,
        ("cable-stiffness", "load-inertia"): 90.0,
        (): plain,
    }
    found = {key: SimpleNamespace(hypothesis=Hypothesis(synthetic.ADSS, key)) for key in behind}
    rough = SimpleNamespace(
        found=found, leading=lambda most, far: [key for key in behind if behind[key] <= far]
    )
    groups, heard = {}, []
    fine = SimpleNamespace(
        take_over=lambda candidates, count: groups.update(
            {one.hypothesis.effects: count for one in candidates}
        ),
        hear=lambda: heard.append(len(groups)),
    )
    search._look_on_all(rough, fine, list(behind))
    few = [("total-backlash",), *([()] if fewer else [])]
    assert groups == {key: 4 if key in few else 6 for key in behind}
    assert heard == [len(behind)]


PAIR, SINGLE = ("load-inertia", "shaft-damping"), ("load-inertia",)
PAYLOAD = ("payload-flexibility",)


@pytest.mark.parametrize(
    ("doubted", "spent", "hardly", "leader", "alike", "behind"),
    [
        (False, False, False, SINGLE, None, SINGLE),
        (True, False, False, SINGLE, None, None),
        (False, True, False, SINGLE, None, None),
        (False, False, True, SINGLE, None, None),
        (False, False, False, PAIR, None, None),
        (False, False, False, (), None, None),
        # Where one that is close says the same with fewer sizes it is that one that is named.
        (False, False, False, PAYLOAD, SINGLE, SINGLE),
        (False, False, False, PAYLOAD, None, PAYLOAD),
    ],
)
def test_whether_pairs_were_searched_is_told(
    monkeypatch, doubted, spent, hardly, leader, alike, behind
):
    """A second cause is looked for behind one that nobody doubts, where it may be paid for.

    But for one that leads a plain model that will do by too little to be named.
    """
    close = [leader, ("motor-constant",), SINGLE]
    found = {key: SimpleNamespace(hypothesis=Hypothesis(ADSS, key)) for key in close}
    fine = SimpleNamespace(
        found=found, best=found[leader], take_over=lambda *_: None, hear=lambda: None,
        purse=SimpleNamespace(is_spent=spent), leading=lambda *_: close,
    )  # fmt: skip
    beside = []
    monkeypatch.setattr(search, "is_felt_alike", lambda _, one: one.hypothesis.effects == alike)
    monkeypatch.setattr(search, "_third", lambda _: [])
    monkeypatch.setattr(search, "is_doubtful_still", lambda *_: False)
    monkeypatch.setattr(search, "is_doubtful", lambda *_: False)
    monkeypatch.setattr(search, "compare", lambda *_: True)
    monkeypatch.setattr(search, "is_hardly_missing", lambda *_: hardly)
    monkeypatch.setattr(search, "look_for_second", lambda *given: beside.append(given[3]))
    rough = SimpleNamespace(found={}, leading=lambda *_: [])
    assert search._look_at_all(rough, fine, {}, None, doubted) == (True, doubted)
    assert beside == ([behind] if behind else [])


@pytest.mark.parametrize(
    ("close", "refused", "spent", "hardly", "behind", "found", "steps"),
    [
        # A payload that another cause at the load stands for is looked behind as that one.
        ([PAYLOAD, SINGLE, PAIR], False, 0.7, False, SINGLE, True, ["compare", "predict"]),
        ([PAIR, SINGLE, ("x",)], True, 0.9, False, SINGLE, True, ["compare", "predict"]),
        ([SINGLE, PAIR], True, 0.9, False, SINGLE, False, []),
        ([SINGLE, PAIR], False, 0.7, False, SINGLE, True, ["compare", "predict"]),
        ([SINGLE, PAIR], False, 0.7, True, None, True, []),
        ([SINGLE, PAIR], False, 0.8, False, None, True, []),
        ([PAIR, SINGLE], False, 0.0, False, None, True, []),
        ([PAIR, ()], True, 0.0, False, None, True, []),
        # Who was not simulated on few rows has nothing there that could be lent.
        ([PAIR, ("shaft-damping",)], True, 0.0, False, None, True, []),
    ],
)
def test_behind_the_best_single_cause_is_looked_once_more_after_pairs_were_searched(
    monkeypatch, close, refused, spent, hardly, behind, found, steps
):
    """Where whoever leads would be refused, or it leads and enough is left.

    A stiff shaft with damped teeth had been looked at as a soft one, with few runs.
    """
    effort = Effort()
    effort.add(spent * 1e6)
    done, looked = [], []

    def standing(effects):
        return SimpleNamespace(hypothesis=Hypothesis(ADSS, effects))

    known = {key: SimpleNamespace() for key in close}
    fine = SimpleNamespace(
        found=known, best=standing(close[0]), leading=lambda most, far: close,
        purse=Purse(effort, granted_s=1e6),
    )  # fmt: skip
    rough = SimpleNamespace(found=[SINGLE, ("x",), PAIR, PAYLOAD])
    payload = close[0] == PAYLOAD

    def look(rough, fine, atlas, leader, rng):
        looked.append(leader)
        if found:
            fine.best = standing(("load-inertia", "shaft-stiffness"))

    monkeypatch.setattr(search, "look_for_second", look)
    monkeypatch.setattr(search, "is_felt_alike", lambda _, one: payload and one is known[SINGLE])
    monkeypatch.setattr(search, "is_refused_now", lambda *_: refused)
    monkeypatch.setattr(search, "is_hardly_missing", lambda *_: hardly)
    monkeypatch.setattr(search, "compare", lambda *_: done.append("compare"))
    monkeypatch.setattr(search, "see_it_predict", lambda *_: done.append("predict"))
    search._look_behind_single(rough, fine, {}, np.random.default_rng(0))
    assert (looked, done) == ([behind] if behind else [], steps)
