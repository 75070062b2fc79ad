"""The instrument's time: as fast as it can be computed, and by a clock."""

from __future__ import annotations

import pytest

from sim.instrument.agenda import HOLD, Agenda
from sim.instrument.pace import ByTheClock, Fast


def test_the_agenda_keeps_order_and_time():
    agenda, done = Agenda(), []
    agenda.after(2.0, lambda: done.append(("b", agenda.now_s)))
    agenda.after(1.0, lambda: done.append(("a", agenda.now_s)))
    agenda.after(2.0, lambda: done.append(("c", agenda.now_s)))
    cancelled = agenda.after(1.5, lambda: done.append(("x", agenda.now_s)))
    cancelled.cancelled = True
    agenda.run_until(1.7)
    assert (done, agenda.now_s) == ([("a", 1.0)], 1.7)
    agenda.run_until(5.0)
    assert done[1:] == [("b", 2.0), ("c", 2.0)]


def test_agenda_runs_up_to_last_work():
    agenda, done = Agenda(), []
    agenda.after(100.0, lambda: done.append("late"), work=False)
    assert not agenda.run_next()
    agenda.after(200.0, lambda: done.append("work"))
    assert agenda.run_next()
    assert agenda.run_next()
    assert done == ["late", "work"]


def test_process_pauses_resumes_and_stops():
    agenda, seen = Agenda(), []

    def steps():
        try:
            seen.append("begin")
            yield 1.0
            seen.append("holding")
            yield HOLD
            seen.append("resumed")
            yield 1.0
            seen.append("end")
        finally:
            seen.append("closed")

    ended = []
    process = agenda.start(steps(), lambda: ended.append(True))
    process.resume()
    assert seen == ["begin"]
    agenda.run_until(10.0)
    assert seen == ["begin", "holding"]
    assert process.alive
    process.resume()
    agenda.run_until(10.5)
    assert seen[-1] == "resumed"
    process.stop()
    agenda.run_until(20.0)
    assert seen[-1] == "closed"
    assert ended == []


@pytest.mark.parametrize(("rate", "wall_s"), [(1.0, 1.5), (100.0, 0.015)])
def test_by_the_clock_follows_stated_rate(swept, rate, wall_s):
    now = [50.0]
    swept.write("VOLT1:RANG 5 VPK", "VOLT2:RANG 5 VPK", "ABOR;:INIT")
    pace = ByTheClock(swept.instrument, rate, lambda: now[0])
    begin = swept.instrument.agenda.now_s
    assert not pace.advance()
    now[0] += wall_s
    assert pace.advance()
    assert swept.instrument.agenda.now_s - begin == pytest.approx(1.5)
    # Five cycles and half a second a point: the third is under way.
    assert swept.instrument.measurement.points_begun == 3


def test_by_the_clock_states_its_wait(swept):
    swept.write("VOLT1:RANG 5 VPK", "VOLT2:RANG 5 VPK", "ABOR;:INIT")
    pace = ByTheClock(swept.instrument, 1.0, lambda: 50.0)
    # The first thing to end is the settling: two cycles of 100 Hz.
    assert pace.wait_s == pytest.approx(0.02)


def test_fast_completes_sweep_then_rests(swept):
    pace = Fast(swept.instrument)
    swept.write("ABOR;:INIT")
    pace.touch()
    assert pace.wait_s == 0.0
    steps = 0
    while pace.advance():
        steps += 1
        assert steps < 1000
    assert swept.instrument.measurement.points_begun == 5
    assert pace.wait_s is None


def test_fast_stops_a_sweep_without_client(swept):
    pace = Fast(swept.instrument)
    swept.write("INIT:CONT ON")
    pace.touch()
    for _ in range(10_000):
        if not pace.advance():
            break
    begun = swept.instrument.measurement.points_begun
    assert 5 <= begun <= 15
    pace.touch()
    while pace.advance():
        pass
    assert swept.instrument.measurement.points_begun > begun


def test_fast_advances_point_by_point(swept):
    pace = Fast(swept.instrument)
    swept.write("ABOR;:INIT")
    begun = [swept.instrument.measurement.points_begun]
    while pace.advance_point():
        begun.append(swept.instrument.measurement.points_begun)
    assert max(b - a for a, b in zip(begun, begun[1:], strict=False)) <= 2
    assert begun[-1] == 5
