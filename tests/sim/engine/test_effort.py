"""The count of simulated seconds."""

from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from dataclasses import replace

import numpy as np
import pytest

from daq.plan import SweepPlan
from sim.effects import parse_effect
from sim.engine import engine
from sim.engine.effort import counting, spend
from sim.response import Servo, simulate_cycles
from sim.unit import load_unit


def test_every_machine_level_point_and_cycle_counts_its_duration():
    plan = SweepPlan((100.0, 200.0), (1.5, 2.5), settle_cycles=2, integrate_cycles=3)
    servos = [Servo.of(load_unit("adss"), ratio) for ratio in (0.2, 0.5, 0.8)]
    with counting() as effort:
        simulate_cycles(servos, plan)
    # Three machines at two levels, five cycles at 100 and at 200 Hz.
    assert effort.simulated_s == pytest.approx(3 * 2 * 5 * (1 / 100.0 + 1 / 200.0))


def test_motion_of_a_hardening_shaft_is_worth_more_of_a_plain_units():
    plan = SweepPlan((200.0,), (1.5,), settle_cycles=2, integrate_cycles=3)
    unit = load_unit("adss")
    effects = [parse_effect(text) for text in ("shaft-hardening:h=1e4", "shaft-stiffness:k_s1=30")]
    servos = [Servo.of(unit, 0.5, settings) for settings in ([], effects[:1], effects[1:])]
    with counting() as effort:
        simulate_cycles(servos, plan)
    assert effort.simulated_s == pytest.approx(3 * plan.duration_s)
    # One in three, that takes a bit more than twice as long a step.
    assert 4 * plan.duration_s < effort.worth_s < 5 * plan.duration_s


def test_motion_that_needs_shorter_steps_is_worth_more(monkeypatch):
    """At 125 Hz the first step will not do: that and the one before take twice as long."""
    plan = SweepPlan((100.0, 110.0, 125.0), (1.5,), settle_cycles=2, integrate_cycles=3)
    plain = engine._dwell

    def growing(moving, parameters, state, stretch, step_s):
        motion = yield from plain(moving, parameters, state, stretch, step_s)
        grows = stretch.frequency_hz == 125.0 and step_s > 5e-6
        return replace(motion, coefficients=motion.coefficients * (np.nan if grows else 1.0))

    monkeypatch.setattr(engine, "_dwell", growing)
    servos = [Servo.of(load_unit("adss"), 0.5)] * 2
    with counting() as effort:
        simulate_cycles(servos, plan, longest_step_s=1e-5, shorter_steps_s=(5e-6,))
    assert effort.simulated_s == pytest.approx(2 * plan.duration_s)
    worth_s = 5 / 100.0 + 2 * (5 / 110.0 + 5 / 125.0)
    assert effort.worth_s == pytest.approx(2 * worth_s, rel=2e-3)


def test_what_is_not_said_to_be_dear_is_worth_itself():
    with counting() as outer, counting() as inner:
        spend(1.0)
        spend(2.0, 5.0)
    for effort in (outer, inner):
        assert (effort.simulated_s, effort.worth_s) == (3.0, 6.0)


def test_blocks_count_for_themselves_and_for_those_around_them():
    with counting() as outer:
        spend(1.0)
        with counting() as inner:
            spend(2.0)
        spend(4.0)
    spend(8.0)
    assert (outer.simulated_s, inner.simulated_s) == (7.0, 2.0)


def test_threads_count_where_they_run_in_a_copy_of_the_context():
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


def test_a_block_that_fails_counts_no_further():
    with pytest.raises(ValueError, match=r"stop at 1\.0"), counting() as effort:
        fail(effort)
    spend(2.0)
    assert effort.simulated_s == 1.0
