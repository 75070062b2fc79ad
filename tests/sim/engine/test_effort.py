"""The count of simulated seconds."""

from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context

import pytest

from daq.plan import SweepPlan
from sim.effects import parse_effect
from sim.engine.effort import counting, spend
from sim.response import Servo, simulate_cycles
from sim.unit import load_unit


def test_effort_counts_machine_level_point_and_cycle():
    plan = SweepPlan((100.0, 200.0), (1.5, 2.5), settle_cycles=2, integrate_cycles=3)
    servos = [Servo.of(load_unit("adss"), ratio) for ratio in (0.2, 0.5, 0.8)]
    with counting() as effort:
        simulate_cycles(servos, plan)
    # Three machines at two levels, five cycles at 100 and at 200 Hz.
    assert effort.simulated_s == pytest.approx(3 * 2 * 5 * (1 / 100.0 + 1 / 200.0))


def test_hardening_shaft_motion_is_worth_more():
    plan = SweepPlan((200.0,), (1.5,), settle_cycles=2, integrate_cycles=3)
    unit = load_unit("adss")
    effects = [parse_effect(text) for text in ("shaft-hardening:h=1e4", "shaft-stiffness:k_s1=30")]
    servos = [Servo.of(unit, 0.5, settings) for settings in ([], effects[:1], effects[1:])]
    with counting() as effort:
        simulate_cycles(servos, plan)
    assert effort.simulated_s == pytest.approx(3 * plan.duration_s)
    # One in three, that takes a bit more than twice as long a step.
    assert 4 * plan.duration_s < effort.worth_s < 5 * plan.duration_s


def test_motion_with_shorter_steps_is_worth_more():
    """At the first step the motion of the harder shaft grows without bound."""
    plan = SweepPlan((40.0, 60.0, 80.0), (4.0,), settle_cycles=2, integrate_cycles=3)
    steps = {"longest_step_s": 1e-5, "shorter_steps_s": (5e-6, 1.25e-6)}
    worth = []
    for hardening in (1e4, 2e7):
        effect = parse_effect(f"shaft-hardening:h={hardening}")
        with counting() as effort:
            simulate_cycles([Servo.of(load_unit("edss"), 0.6, [effect])], plan, **steps)
        assert effort.simulated_s == pytest.approx(plan.duration_s)
        worth.append(effort.worth_s)
    assert worth[1] > 1.3 * worth[0]


def test_unpriced_motion_is_worth_its_duration():
    with counting() as outer, counting() as inner:
        spend(1.0)
        spend(2.0, 5.0)
    for effort in (outer, inner):
        assert (effort.simulated_s, effort.worth_s) == (3.0, 6.0)


def test_nested_blocks_count_for_outer_ones_too():
    with counting() as outer:
        spend(1.0)
        with counting() as inner:
            spend(2.0)
        spend(4.0)
    spend(8.0)
    assert (outer.simulated_s, inner.simulated_s) == (7.0, 2.0)


def test_threads_count_in_copied_context():
    threads, times = 4, 2000

    def work():
        for _ in range(times):
            spend(0.5)

    with counting() as effort, ThreadPoolExecutor(threads) as pool:
        for done in [pool.submit(copy_context().run, work) for _ in range(threads)]:
            done.result()
        pool.submit(spend, 1.0).result()
    assert effort.simulated_s == 0.5 * threads * times


def fail(effort):
    spend(1.0)
    raise ValueError(f"stop at {effort.simulated_s}")


def test_failing_block_stops_counting():
    with pytest.raises(ValueError, match=r"stop at 1\.0"), counting() as effort:
        fail(effort)
    spend(2.0)
    assert effort.simulated_s == 1.0
