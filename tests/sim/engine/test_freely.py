"""Lanes that come and go give what they give when their system is stepped alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds.side_by_side import ADSS, EDSS, law_parameters

from daq.errors import AnalysisError
from sim.effects import drivetrain_with, parse_effect
from sim.elements import Damper
from sim.engine.engine import Stretch, carry, carry_each
from sim.engine.freely import dealt_out, goes_freely, step_freely
from sim.engine.lanes import VECTOR_BYTES
from sim.engine.stepping import step_together

WIDE = VECTOR_BYTES // 8
KINDS = (
    (ADSS, ()),
    (EDSS, ()),
    (ADSS, ("load-inertia:J_L=0.2",)),
    (EDSS, ("shaft-hardening:h=10000",)),
)


def dwell(frequency_hz, lanes, cycles=(1, 2), offset=0.0):
    one = np.ones(lanes)
    levels = 2.5 * np.linspace(0.2, 1.0, lanes)
    return Stretch(frequency_hz, levels, 0.3 * one, offset * one, *cycles)


def asker(kind, frequencies, lanes, cycles, single=False, steps=(1e-5,), offset=0.0):
    unit, effects = KINDS[kind]
    system = drivetrain_with(unit, 0.4, [parse_effect(text) for text in effects]).system()
    some = [dwell(f, lanes, cycles, offset) for f in frequencies]
    start = np.zeros((len(system.states), lanes))
    return carry(system, law_parameters(system, lanes), start, some, steps, single)


def same(one, other):
    return all(
        np.array_equal(getattr(a, what), getattr(b, what))
        for a, b in zip(one, other, strict=True)
        for what in ("coefficients", "peak", "state", "step_s")
    )


work = st.tuples(
    st.integers(0, len(KINDS) - 1),
    st.lists(st.sampled_from([300.0, 420.0, 777.0, 2000.0]), max_size=3),
    st.integers(1, 5),
    st.tuples(st.integers(0, 2), st.integers(1, 3)),
)


@settings(max_examples=12, deadline=None)
@given(some=st.lists(work, max_size=9), single=st.booleans(), offset=st.sampled_from([0.0, 0.2]))
def test_joining_and_leaving_lanes_equal_separate_runs(some, single, offset):
    def asking(one):
        return asker(*one, single=single, offset=offset)

    found = step_freely(map(asking, some))
    assert len(found) == len(some)
    for one, motions in zip(some, found, strict=True):
        (alone,) = step_together([asking(one)])
        assert same(motions, alone)


def test_more_points_than_lanes_take_turns():
    system = drivetrain_with(ADSS, 0.4).system()
    frequencies = np.linspace(300.0, 900.0, 4 * WIDE + 3)
    start = np.zeros((len(system.states), 1))
    how = system, law_parameters(system), start, [dwell(f, 1) for f in frequencies], (1e-5,)
    found = step_freely(carry_each(*how))
    assert [motion.step_s for (motion,) in found] == pytest.approx(
        [1.0 / f / max(4 * np.ceil(1e5 / f / 4), 256) for f in frequencies]
    )
    for motions, again in zip(found, carry_each(*how), strict=True):
        (alone,) = step_together([again])
        assert same(motions, alone)


def test_requests_start_when_lanes_are_free():
    begun = []

    def askers():
        for i in range(10 * WIDE):
            begun.append(i)
            yield watched(i)

    def watched(i):
        waiting.append(len(begun) - len(ended))
        yield from asker(0, (2000.0,), 1, (0, 1))
        ended.append(i)

    waiting, ended = [], []
    step_freely(askers())
    assert len(ended) == 10 * WIDE
    assert max(waiting) <= 2 * WIDE


def test_motion_without_bound_ends_the_whole():
    growing = drivetrain_with(ADSS, 0.25).adding(drive=Damper({"th_L": 1.0}, -1e4)).system()
    start = np.zeros((len(growing.states), 1))
    bad = carry(growing, law_parameters(growing), start, [dwell(100.0, 1, (50, 1))], (1e-5,))
    with pytest.raises(AnalysisError, match="at 100 Hz grew without bound"):
        step_freely([asker(0, (300.0,), 1, (0, 1)), bad])


def test_empty_requests_return_at_once():
    def silent():
        return 7
        yield

    assert step_freely([]) == []
    assert step_freely([silent(), silent()]) == [7, 7]


@pytest.mark.parametrize("single", [False, True])
def test_free_lanes_are_used_for_partial_vectors(single):
    width = WIDE * (2 if single else 1)
    assert goes_freely(1, 3 * width, single)
    assert goes_freely(width // 2, 3, single)
    assert not goes_freely(width, 100, single)
    assert not goes_freely(4 * width - 1, 100, single)
    # What fits into one vector need not come and go.
    assert not goes_freely(1, width, single)


@given(tasks=st.integers(0, 50), cores=st.integers(1, 9))
def test_tasks_are_dealt_out_to_all_cores(tasks, cores):
    lots = dealt_out(tasks, cores)
    assert sorted(i for lot in lots for i in lot) == list(range(tasks))
    assert len(lots) == min(tasks, cores)
    assert max(map(len, lots), default=0) - min(map(len, lots), default=0) <= 1
