"""Adaptive sweeps: the next points go where a judge is unsure, and never beyond the budget."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.adaptive import AdaptiveSweep, Cost, Refinement
from daq.analyser import SweepPoint
from daq.errors import InputError
from daq.frf import PointFlag
from daq.plan import SweepPlan, spaced_frequencies

ARF, RF, WIDTH = 131.0, 137.0, 3.0


def plan(points: int = 17, **changes) -> SweepPlan:
    return SweepPlan(spaced_frequencies(100.0, 180.0, points), (2.5,), **changes)


def measured(frequencies) -> list[SweepPoint]:
    return [SweepPoint(hz, 1.0 + 0j) for hz in frequencies]


def judge(points, places=(ARF, RF)):
    """Sure of a place as the points near it are many: std = width over their number."""
    found = []
    for place in places:
        near = sum(abs(point.frequency_hz - place) < WIDTH for point in points)
        found.append((place, WIDTH / near if near else math.nan, WIDTH))
    return found


def run(sweep: AdaptiveSweep) -> list[tuple[float, ...]]:
    rounds = []
    while frequencies := sweep.ask():
        rounds.append(frequencies)
        sweep.tell(measured(frequencies))
    return rounds


def test_sweep_is_coarse_then_refines_features():
    sweep = AdaptiveSweep(plan(), Refinement(0.4, 200), judge)
    rounds = run(sweep)
    assert rounds[0] == plan().frequencies_hz
    assert sweep.reason == "target reached"
    assert all(std <= 0.4 for _, std, _ in sweep.features)
    later = [hz for frequencies in rounds[1:] for hz in frequencies]
    # Never farther from a feature than its width or the coarse gap beside it.
    assert all(min(abs(hz - ARF), abs(hz - RF)) <= 5.0 for hz in later)
    assert len(sweep.points) < 60


def test_even_grid_needs_more_points():
    sweep = AdaptiveSweep(plan(), Refinement(0.25, 400), judge)
    run(sweep)

    def enough(points: int) -> bool:
        found = judge(measured(plan(points).frequencies_hz))
        return all(std <= 0.25 for _, std, _ in found)

    assert len(sweep.points) < 0.5 * next(filter(enough, range(17, 1000)))


def test_point_budget_is_used_exactly():
    sweep = AdaptiveSweep(plan(), Refinement(1e-6, 30), judge)
    run(sweep)
    assert len(sweep.points) == 30
    assert sweep.reason == "budget spent"
    assert sweep.ask() == ()


def test_budget_of_coarse_sweep_refines_nothing():
    sweep = AdaptiveSweep(plan(), Refinement(1e-6, 17), judge)
    assert [len(frequencies) for frequencies in run(sweep)] == [17]
    assert sweep.reason == "budget spent"


def test_known_features_need_no_refinement():
    sweep = AdaptiveSweep(plan(), Refinement(10.0, 100), judge)
    assert len(run(sweep)) == 1
    assert sweep.reason == "target reached"


def test_missing_feature_refines_the_whole_band():
    def blind(points):
        return judge(points, (ARF,)) if len(points) < 40 else judge(points)

    sweep = AdaptiveSweep(plan(), Refinement(0.5, 150), blind)
    rounds = run(sweep)
    assert sweep.reason == "target reached"
    early = [hz for frequencies in rounds[1:4] for hz in frequencies]
    assert min(early) < 115.0
    assert max(early) > 165.0


def test_no_features_gives_an_even_grid():
    sweep = AdaptiveSweep(plan(), Refinement(0.1, 33), lambda points: [])
    run(sweep)
    places = sorted(point.frequency_hz for point in sweep.points)
    assert places == pytest.approx(spaced_frequencies(100.0, 180.0, 33))
    assert not sweep.settled


def test_non_finite_features_do_no_harm():
    odd = [(math.nan, math.nan, math.nan), (140.0, math.nan, math.nan), (1e9, math.inf, -1.0)]
    sweep = AdaptiveSweep(plan(), Refinement(0.1, 60), lambda points: odd)
    run(sweep)
    assert len(sweep.points) == 60
    assert all(100.0 <= point.frequency_hz <= 180.0 for point in sweep.points)


def test_closed_grid_repeats_least_visited_point():
    narrow = SweepPlan((100.0, 100.0 + 1 / 64), (1.0,))
    sweep = AdaptiveSweep(narrow, Refinement(1e-9, 10), lambda points: [(100.0, 1.0, 0.001)] * 2)
    run(sweep)
    visits = [point.frequency_hz for point in sweep.points]
    assert sorted(visits.count(hz) for hz in set(visits)) == [5, 5]


def test_new_points_follow_sweep_direction():
    for direction in ("up", "down"):
        sweep = AdaptiveSweep(plan(direction=direction), Refinement(0.3, 100), judge)
        for frequencies in run(sweep):
            assert list(frequencies) == sorted(frequencies, reverse=direction == "down")


def test_spoilt_points_are_spent_but_not_judged():
    seen = []

    def look(points):
        seen.append(len(points))
        return judge(points)

    sweep = AdaptiveSweep(plan(), Refinement(1e-6, 20), look)
    frequencies = sweep.ask()
    told = measured(frequencies)
    told[3] = SweepPoint(told[3].frequency_hz, complex("nan"), flags=PointFlag.SPOILT)
    sweep.tell(told)
    assert seen == [16]
    assert len(sweep.ask()) == 3


def test_asking_again_before_telling_is_refused():
    sweep = AdaptiveSweep(plan(), Refinement(0.3, 100), judge)
    frequencies = sweep.ask()
    sweep.tell(measured(frequencies[:10]))
    assert sweep.reason is None
    with pytest.raises(InputError, match="7 points asked for were not told"):
        sweep.ask()
    sweep.tell(measured(frequencies[10:]))
    assert sweep.ask()


def test_the_cost_is_known_before_the_start():
    coarse = SweepPlan((10.0, 20.0), (1.0,), settle_cycles=5, integrate_cycles=5)
    cost = AdaptiveSweep(coarse, Refinement(0.1, 4), judge).cost(overhead_s=0.5)
    assert cost == Cost(2, 4, 10 / 10 + 10 / 20 + 1.0, 2.5 + 2 * (1.0 + 0.5))
    assert str(cost) == "2 points in 2 s, at most 4 points in 6 s"


@pytest.mark.parametrize(
    "refinement",
    [
        lambda: Refinement(0.0, 10),
        lambda: Refinement(math.nan, 10),
        lambda: Refinement(math.inf, 10),
        lambda: Refinement(0.1, 0),
        lambda: Refinement(0.1, 10, features=0),
        lambda: Refinement(0.1, 10, round_points=0),
        lambda: Refinement(0.1, 10, grid_hz=0.0),
        lambda: AdaptiveSweep(plan(17), Refinement(0.1, 16), judge),
    ],
)
def test_invalid_refinement_is_refused(refinement):
    with pytest.raises(InputError):
        refinement()


@settings(max_examples=20, deadline=None)
@given(
    st.lists(st.floats(100.0, 180.0), max_size=4),
    st.integers(17, 80),
    st.floats(0.0, 50.0),
    st.integers(1, 7),
)
def test_any_judge_stays_within_band_and_budget(places, budget, width, round_points):
    refinement = Refinement(1e-9, budget, round_points=round_points)
    sweep = AdaptiveSweep(plan(), refinement, lambda points: [(hz, 1.0, width) for hz in places])
    rounds = run(sweep)
    assert len(sweep.points) == budget
    assert len(rounds) <= budget
    assert all(100.0 <= hz <= 180.0 for frequencies in rounds for hz in frequencies)
