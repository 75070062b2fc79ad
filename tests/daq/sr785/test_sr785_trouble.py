"""The SR785's driver against readings of the manual that differ, what others left, and trouble."""

import math
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from instruments import bench_server
from instruments.driven_sr785 import (
    GRID,
    QUIET,
    SETTINGS,
    SHORT,
    Tap,
    assert_right,
    bench,
    prepared,
)
from instruments.fake_analyser import known_gain

from daq.analyser import SourceState
from daq.errors import (
    InstrumentError,
    LashbenchError,
    MeasurementError,
    ProtocolError,
)
from daq.frf import PointFlag
from daq.sr785 import SR785
from daq.sr785.levels import is_zero, scale_of
from daq.transports.base import Deadline
from sim.instrument.plant import LinearPlant
from sim.loopback import Loopback

# ------------------------------------------------------------ readings of the manual


@pytest.mark.parametrize(
    "changes",
    [
        {"level_reply": "V"},
        {"level_reply": "dBVpk"},
        {"level_units": ("mVpk", "mVpp", "mVrms", "Vpk", "Vrms", "dBVpk", "dBVpp", "dBVrms")},
        {"sweep_obeys_switch": False},
        {"data_survive_change": False},
        {"change_resets_view": False},
        {"start_clears": False},
        {"progress_is_frequency": True},
        {"unmeasured": 0.0},
        {"digits": 12},
        {"model": "SR780"},
        {"outx": 1},
    ],
    ids=str,
)
def test_every_manual_reading_gives_correct_points(changes):
    """Whatever the manual means, the points are right and the source ends off."""
    instrument, analyser, _ = prepared(replace(QUIET, **changes))
    for frequencies in (GRID[:1], GRID, GRID[::-1], GRID):
        assert_right(list(analyser.sweep(frequencies)), frequencies)
        assert instrument.driven_v == 0.0
        analyser.prepare(100.0, 200.0, SETTINGS)
    assert analyser.make_safe() is SourceState.CONFIRMED_OFF
    assert instrument.driven_v == 0.0


@pytest.mark.parametrize("changes", [{"data_survive_change": False}, {"model": "SR780"}], ids=str)
def test_without_variances_errors_come_from_repeats(changes):
    _, analyser, tap = prepared(replace(QUIET, noise_v=2e-3, **changes))
    list(analyser.sweep(GRID[:1]))
    begun = len(tap.lines)
    points = list(analyser.sweep(GRID))
    assert tap.lines[begun:].count("STRT") == len(GRID)
    assert all(point.gain_std_db > 0 for point in points)
    assert all(point.detail["repeats"] >= 4 for point in points)


def test_unexplained_level_unit_is_refused_before_driving():
    instrument, analyser, _ = bench(replace(QUIET, level_units=("mV", "Vrms"), level_reply="Vrms"))
    with pytest.raises(ProtocolError, match="neither mV, V nor dBV peak"):
        analyser.prepare(100.0, 200.0, SETTINGS)
    assert instrument.driven_v == 0.0


@pytest.mark.parametrize(
    ("reply", "zero"),
    [("0", True), ("0,0", True), ("0,1", True), ("0.000E+00,3", True), ("0,2", False),
     ("0,7", False), ("-200,2", True), ("-200,7", True), ("-20,2", False), ("1e-3,0", False)],
)  # fmt: skip
def test_a_zero_in_decibels_is_a_volt(reply, zero):
    assert is_zero(reply) is zero


@pytest.mark.parametrize("replies", [("10,0", "40,1"), ("10,0", "10,0"), ("7.07,0", "28.3,0"),
                                     ("20,1", "80,1"), ("0,0", "0,0")])  # fmt: skip
def test_inconsistent_scale_is_refused(replies):
    with pytest.raises(ProtocolError):
        scale_of((0.01, replies[0]), (0.04, replies[1]))


# ------------------------------------------------------------ left by others, and trouble


@pytest.mark.parametrize(
    "left",
    [
        ["S1AM 3000 mV", "SRCO 1", "STRT"],
        ["S2AM 3000 mV", "SOFF 1 V", "SRCO 1"],
        ["MGRP 2,3", "SSAM 2000 mV", "SRPT 2,1", "SRCO 1", "STRT"],
        ["MGRP 2,3", "SSAM 2000 mV", "SRMP 1", "SRAT 2", "SRCO 1", "STRT"],
        ["MGRP 2,3", "SSAM 2000 mV", "SSAL 2", "SRCO 1", "STRT"],
        ["MGRP 2,3", "SSAM 2000 mV", "SRCO 1", "STRT", "PAUS"],
        ["MGRP 2,2", "S1AM 1000 mV", "SRCO 1", "OUTX 1"],
    ],
    ids=" ".join,
)
@pytest.mark.parametrize("obeys", [True, False])
def test_state_left_by_program_is_made_safe(left, obeys):
    """The instrument can then be measured with."""
    instrument, analyser, tap = bench(replace(QUIET, sweep_obeys_switch=obeys))
    for line in left:
        tap.write(line, Deadline.after(1.0))
        tap.serial_poll(Deadline.after(1.0))
    if "PAUS" not in left:
        tap.pause(0.1)
        assert instrument.driven_v > 0.0
    assert analyser.make_safe() is SourceState.CONFIRMED_OFF
    assert instrument.driven_v == 0.0
    analyser.prepare(100.0, 200.0, SETTINGS)
    assert_right(list(analyser.sweep(GRID)), GRID)


@pytest.mark.parametrize(
    ("left", "state"),
    [
        ([], SourceState.CONFIRMED_OFF),
        (["S1AM 3000 mV"], SourceState.CONFIRMED_OFF),
        (["SRCO 1"], SourceState.ON),
        (["MGRP 2,3"], SourceState.ON),
        (["MGRP 2,3", "SSAM 0 mV"], SourceState.CONFIRMED_OFF),
        (["MGRP 2,3", "SSAM 0 mV", "SOFF 1 V"], SourceState.ON),
    ],
    ids=str,
)
def test_reading_source_state_changes_nothing(left, state):
    _, analyser, tap = bench()
    for line in left:
        tap.write(line, Deadline.after(1.0))
        tap.serial_poll(Deadline.after(1.0))
    begun = len(tap.lines)
    assert analyser.source_state() is state
    assert not [line for line in tap.lines[begun:] if "?" not in line and line != "OUTX 0"]


@pytest.mark.parametrize("fault", ["psd-stuck", "psd-stuck:point=14", "display-off-line:point=14",
                                   "key-pressed:point=14", "panel-pause:point=14",
                                   "range-moved:point=14", "outx-elsewhere:point=14"])  # fmt: skip
@pytest.mark.parametrize("fixed", [None, 2.0])
def test_wrong_numbers_are_always_flagged(fault, fixed):
    wanted = replace(SETTINGS, input_range_vpk=(fixed, fixed))
    instrument, analyser, _ = bench(faults=[fault], timing=SHORT)
    points = []
    with suppress(LashbenchError):
        analyser.prepare(100.0, 200.0, wanted)
        points += analyser.sweep(GRID[:1])
        for point in analyser.sweep(GRID):
            points.append(point)
    assert any(each.struck for each in instrument.faults.faults)
    for point in points:
        true = known_gain(point.frequency_hz)
        assert abs(point.gain - true) <= 1e-4 * abs(true) or point.flags & (
            PointFlag.OVERLOAD | PointFlag.SPOILT
        )
    assert analyser.make_safe() is SourceState.CONFIRMED_OFF
    assert instrument.driven_v == 0.0


def test_pause_at_panel_ends_the_sweep():
    _, analyser, _ = prepared(faults=["panel-pause:point=14"])
    with pytest.raises(MeasurementError, match="paused at the front panel"):
        list(analyser.sweep(GRID))


def test_a_refused_command_is_named():
    class Meddling(Tap):
        def write(self, line, deadline):
            super().write("SSTM 2,0" if line.startswith("SSTM 2") else line, deadline)

    _, analyser, _ = bench(wire=Meddling)
    with pytest.raises(InstrumentError, match=r"SSTM 2.*refuses it: execution error"):
        analyser.prepare(100.0, 200.0, SETTINGS)


def test_display_left_off_line_is_restored():
    _, analyser, tap = bench()
    for line in ("DISP 2,0", "ACTD 1"):
        tap.write(line, Deadline.after(1.0))
        tap.serial_poll(Deadline.after(1.0))
    analyser.prepare(100.0, 200.0, SETTINGS)
    assert_right(list(analyser.sweep(GRID)), GRID)


def test_overload_flags_all_points_concerned():
    _, analyser, _ = prepared(settings=replace(SETTINGS, input_range_vpk=(1.0, None)))
    points = list(analyser.sweep(GRID))
    assert all(point.flags & PointFlag.OVERLOAD for point in points)


def test_input_below_half_range_is_flagged():
    _, analyser, _ = prepared(settings=replace(SETTINGS, input_range_vpk=(2.0, 20.0)))
    points = list(analyser.sweep(GRID))
    assert all(point.flags & PointFlag.HALF_RANGE_MISSED for point in points)


def test_phase_is_output_relative_to_input():
    _, analyser, _ = prepared(gain=lambda hz: 0.5 * np.exp(-0.7j))
    for point in analyser.sweep(GRID[:1] + GRID):
        assert math.isclose(math.atan2(point.gain.imag, point.gain.real), -0.7, abs_tol=1e-5)


@pytest.mark.slow
def test_another_instrument_is_refused():
    analyser = SR785(Loopback(bench_server.simulated("", LinearPlant(known_gain))), timing=SHORT)
    with pytest.raises(LashbenchError):
        analyser.identify()
    assert analyser.make_safe() is not SourceState.CONFIRMED_OFF
