"""What a session may rely on from every driver, against the simulated instrument of each.

A driver that is added is tested here without a line of its own.
"""

import math
import time
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from instruments.bench_server import simulated
from instruments.fake_analyser import known_gain
from instruments.session_runs import of

from daq.analyser import PointSettings, SourceState
from daq.control import SessionControl
from daq.drivers import DRIVERS, check_sweep
from daq.errors import (
    InputError,
    InstrumentError,
    LashbenchError,
    LimitError,
    MeasurementError,
)
from daq.frf import PointFlag
from daq.limits import Limits
from daq.plan import SweepPlan, spaced_frequencies
from daq.session import Session
from daq.session_events import PointStored
from daq.session_request import SessionRequest
from daq.store_records import MeasurementHeader
from sim.instrument.plant import LinearPlant
from sim.loopback import Loopback

OFF = SourceState.CONFIRMED_OFF
SETTINGS = PointSettings(source_vpk=1.5, settle_cycles=3, integrate_cycles=4, slew_vpk_per_s=0.0)
GRID = spaced_frequencies(120.0, 160.0, 17)
PLAN = SweepPlan(GRID, (1.0, 2.0), settle_cycles=3, integrate_cycles=4)

every_driver = pytest.mark.parametrize(
    "driver", DRIVERS, ids=lambda driver: driver.scheme or "preset"
)


def bench(driver, faults=(), gain=known_gain, **wanted):
    """An instrument and its driver, prepared."""
    instrument = simulated(driver.scheme, LinearPlant(gain), faults, **wanted)
    analyser = driver.drive(Loopback(instrument))
    return instrument, analyser


def prepared(driver, faults=(), **changes):
    instrument, analyser = bench(driver, faults)
    analyser.identify()
    analyser.prepare(100.0, 200.0, PointSettings(**(as_words(SETTINGS) | changes)))
    return instrument, analyser


def as_words(point_settings):
    return {name: getattr(point_settings, name) for name in PointSettings.__slots__}


def right(point, tolerance=1e-4):
    true = known_gain(point.frequency_hz)
    return abs(point.gain - true) <= tolerance * abs(true)


@every_driver
@pytest.mark.parametrize(
    "frequencies",
    [
        GRID,
        tuple(reversed(GRID)),
        spaced_frequencies(110.0, 190.0, 12, "log"),
        (150.0,),
        (130.0, 131.0, 132.0),
        (150.0, 120.5, 170.0, 121.0),
    ],
    ids=["up", "down", "log", "one", "few", "any"],
)
def test_points_are_correct_in_requested_order(driver, frequencies):
    instrument, analyser = prepared(driver)
    points = list(analyser.sweep(frequencies))
    assert len(points) == len(frequencies)
    for point, asked_hz in zip(points, frequencies, strict=True):
        assert abs(point.frequency_hz - asked_hz) <= max(1 / 64, 1e-4 * asked_hz)
        assert right(point)
        assert not point.flags & (PointFlag.OVERLOAD | PointFlag.SPOILT)
    assert instrument.driven_v == 0.0
    assert analyser.make_safe() is OFF


@every_driver
def test_stated_errors_match_scatter_of_readings(driver):
    """30 readings each of one frequency: some 68 % of parts lie within one standard error."""
    instrument, analyser = bench(driver, noise_v=3e-3, seed=5)
    analyser.identify()
    analyser.prepare(100.0, 200.0, PointSettings(1.0, 3, 30, slew_vpk_per_s=0.0))
    points = [*analyser.sweep(spaced_frequencies(120.0, 160.0, 20))]
    points += analyser.sweep((130.0, 150.0, 121.0, 133.3, 160.0, 141.0, 155.5, 128.0, 149.0, 139.0))
    pulls = []
    for point in points:
        off = point.gain / known_gain(point.frequency_hz) - 1.0
        pulls += [
            20 / math.log(10) * off.real / point.gain_std_db,
            math.degrees(off.imag) / point.phase_std_deg,
        ]
    spread = math.sqrt(sum(pull * pull for pull in pulls) / len(pulls))
    # 60 parts: by chance outside of this one time in a thousand.
    assert 0.7 < spread < 1.35


@every_driver
def test_driving_needs_previous_permission(driver):
    """Whoever is asked first may still say no, at any of the questions."""

    class NotNow(Exception):
        pass

    for allowed in (*range(0, 60, 6), *range(60, 180, 20)):
        instrument, analyser = prepared(driver)
        asked = 0

        def look(instrument=instrument, allowed=allowed):
            nonlocal asked
            asked += 1
            if asked > allowed:
                raise NotNow

        assert instrument.driven_v == 0.0
        analyser.on_wait = look
        with suppress(NotNow):
            list(analyser.sweep(GRID))
        analyser.on_wait = None
        assert analyser.make_safe() is OFF
        assert instrument.driven_v == 0.0


@every_driver
def test_refusal_precedes_the_first_volt(driver):
    instrument, analyser = prepared(driver)
    seen = []

    def look():
        seen.append(instrument.driven_v)
        raise KeyboardInterrupt

    analyser.on_wait = look
    with pytest.raises(KeyboardInterrupt):
        next(analyser.sweep(GRID))
    assert seen == [0.0]


@every_driver
def test_leaving_a_sweep_early_stops_the_source(driver):
    instrument, analyser = prepared(driver)
    points = analyser.sweep(GRID)
    next(points)
    points.close()
    assert instrument.driven_v == 0.0
    assert analyser.make_safe() is OFF
    with pytest.raises(MeasurementError, match="not set up"):
        analyser.sweep(GRID)


@every_driver
@pytest.mark.parametrize("taken", [0, 5, 17])
def test_second_client_can_make_safe_anytime(driver, taken):
    """As a watchdog does: over another wire, knowing nothing."""
    instrument, analyser = prepared(driver)
    points = analyser.sweep(GRID)
    for _ in range(taken):
        next(points)
    other = driver.drive(Loopback(instrument))
    assert other.make_safe() is OFF
    assert instrument.driven_v == 0.0
    assert other.source_state() is OFF
    assert other.make_safe() is OFF
    with suppress(LashbenchError):
        list(points)
    assert instrument.driven_v == 0.0


@every_driver
@pytest.mark.parametrize("fault", ["slow-reply", "silence"])
def test_late_instrument_is_awaited(driver, fault):
    instrument, analyser = prepared(driver, [f"{fault}:point=1,seconds=0.3"])
    points = list(analyser.sweep(GRID))
    assert len(points) == len(GRID)
    assert all(right(point) for point in points)
    assert instrument.faults.faults[0].struck
    assert analyser.make_safe() is OFF


@every_driver
@pytest.mark.parametrize(
    "skip", [pytest.param(n, marks=[pytest.mark.long] * (n % 8 != 1)) for n in range(1, 30, 4)]
)
def test_lost_command_gives_no_wrong_point(driver, skip):
    """The message that meets the silence is lost; what follows is heard."""
    instrument, analyser = prepared(
        driver, [f"silence:point=2,phase=sweep,skip={skip},seconds=0.1"]
    )
    points = []
    with suppress(LashbenchError):
        points += analyser.sweep(GRID)
    assert all(right(point) for point in points)
    assert analyser.make_safe() is OFF


@every_driver
def test_unreadable_source_is_unknown_without_raising(driver):
    instrument, analyser = prepared(driver, ["dropped-connection:point=1"])
    points = analyser.sweep(GRID)
    with pytest.raises(LashbenchError):
        next(points)
    assert analyser.make_safe() is SourceState.UNKNOWN


@pytest.mark.slow
@every_driver
def test_instrument_silent_for_ever_is_given_up(driver):
    """A session asks twice, its watchdog three times; all of it must take less than a minute."""
    _, analyser = prepared(driver, ["silence:point=1,phase=sweep,seconds=1000000"])
    with suppress(LashbenchError):
        list(analyser.sweep(GRID))
    began_s = time.monotonic()
    assert analyser.make_safe() is SourceState.UNKNOWN
    assert time.monotonic() - began_s < 10.0
    assert any("not asked" in step.result for step in analyser.safe_off.steps)


@every_driver
@settings(max_examples=20)
@given(
    level=st.floats(),
    offset=st.floats(),
    slew=st.floats(),
    span=st.tuples(st.floats(), st.floats()),
    ranges=st.tuples(st.none() | st.floats(), st.none() | st.floats()),
    cycles=st.tuples(st.integers(-5, 100000), st.integers(-5, 100000)),
)
def test_settings_are_taken_whole_or_refused(driver, level, offset, slew, span, ranges, cycles):
    instrument, analyser = bench(driver)
    analyser.identify()
    wanted = PointSettings(level, *cycles, offset, slew, ranges)
    told = "nothing was sent"
    try:
        analyser.prepare(*span, wanted)
    except LimitError as error:
        told = str(error)
    assert "nothing was sent" in told
    assert "\n" not in told
    assert instrument.driven_v == 0.0


@every_driver
def test_impossible_sweep_is_refused_before_opening(driver):
    lead = f"{driver.scheme}:" if driver.scheme else ""
    check_sweep(f"{lead}sim:", PLAN, 10.0, (None, None))
    for plan, slew, ranges in (
        (SweepPlan(GRID, (99.0,)), 10.0, (None, None)),
        (SweepPlan((10.0, 3e5), (1.0,)), 10.0, (None, None)),
        (PLAN, -1.0, (None, None)),
        (PLAN, 10.0, (99.0, None)),
        (SweepPlan(GRID, (1.0,), integrate_cycles=1_000_000), 10.0, (None, None)),
    ):
        with pytest.raises((LimitError, InputError)):
            check_sweep(f"{lead}sim:", plan, slew, ranges)


@pytest.mark.parametrize(
    ("driver", "other"),
    [(driver, other) for driver in DRIVERS for other in DRIVERS if driver is not other],
    ids=lambda driver: driver.scheme or "preset",
)
def test_address_of_other_instrument_states_the_remedy(driver, other):
    instrument = simulated(other.scheme, LinearPlant(known_gain))
    analyser = driver.drive(Loopback(instrument))
    word = f"begins with '{other.scheme}:'" if other.scheme else f"has no '{driver.scheme}:'"
    with pytest.raises(InstrumentError, match=f"answers '.IDN.', .* was due; .*{word}"):
        analyser.identify()


# ------------------------------------------------------------ sessions


def request(driver, resume=None, **changes):
    header = MeasurementHeader("ADSS", "7", PLAN, f"{driver.scheme}:", "lashbench test")
    header = header if resume is None else None
    return SessionRequest(header=header, limits=(Limits("bench"),), resume=resume, **changes)


def run(session):
    events, error = [], None
    try:
        events.extend(session.run())
    except LashbenchError as fault:
        error = fault
    return events, error


@every_driver
def test_session_measures_all_points_source_ends_off(driver, store):
    instrument, analyser = bench(driver)
    events, error = run(Session(analyser, store, request(driver)))
    assert error is None
    found = store.measurement(1)
    assert (found.state, found.source_state, found.points) == ("complete", OFF, PLAN.points)
    assert all(right(stored.point) for stored in store.points(1))
    assert instrument.driven_v == 0.0
    assert len(of(PointStored, events)) == PLAN.points


@every_driver
@pytest.mark.parametrize(
    "after", [0, 12, *(pytest.param(n, marks=pytest.mark.long) for n in (1, 20))]
)
def test_ended_session_is_resumed(driver, store, after):
    instrument, analyser = bench(driver)
    control = SessionControl()
    session = Session(analyser, store, request(driver), control)
    told = []
    for event in session.run():
        told += of(PointStored, [event])
        if len(told) >= after:
            control.stop("enough")
    assert instrument.driven_v == 0.0
    assert store.measurement(1).source_state is OFF
    kept = [stored.id for stored in store.points(1)]
    assert kept == [event.stored.id for event in told]
    _, error = run(Session(driver.drive(Loopback(instrument)), store, request(driver, resume=1)))
    assert error is None
    assert store.measurement(1).state == "complete"
    assert [stored.id for stored in store.points(1)][: len(kept)] == kept
    assert len(store.points(1)) == PLAN.points


def shared_faults():
    """Faults that instruments of all drivers know and that need no long wait."""
    return (
        "dropped-connection:point=15", "overload-burst:point=15", "lost-power:point=15,seconds=0",
        "garbage-bytes:point=15", "truncated-block:point=15,times=0",
    )  # fmt: skip


@every_driver
@pytest.mark.parametrize("fault", shared_faults())
def test_fault_loses_no_point_and_switches_off(driver, store, fault):
    instrument, analyser = bench(driver, [fault])

    def reopen():
        return driver.drive(Loopback(instrument))

    events, error = run(Session(analyser, store, request(driver), reopen=reopen))
    assert sum(fault.struck for fault in instrument.faults.faults) > 0
    told = [event.stored for event in of(PointStored, events)]
    assert store.points(1) == told
    spoilt = PointFlag.OVERLOAD | PointFlag.SPOILT
    assert all(right(stored.point) or stored.point.flags & spoilt for stored in told)
    assert instrument.driven_v == 0.0
    assert store.measurement(1).source_state is OFF
    if fault.startswith("overload"):
        assert error is None
        assert any(stored.point.flags & PointFlag.OVERLOAD for stored in told)
        return
    assert error is not None or len(told) == PLAN.points
    instrument.faults.disarm()
    _, error = run(Session(reopen(), store, request(driver, resume=1)))
    assert error is None
    assert store.measurement(1).state == "complete"
