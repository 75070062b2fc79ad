"""The SR785's driver by its dialogue on the wire, against readings of the manual that differ."""

import math
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise

import bench_server
import numpy as np
import pytest
from fake_analyser import known_gain

from daq.analyser import PointSettings, SourceState
from daq.errors import (
    BenchTimeout,
    InstrumentError,
    LashbenchError,
    MeasurementError,
    ProtocolError,
)
from daq.frf import PointFlag
from daq.plan import spaced_frequencies
from daq.sr785 import SR785
from daq.sr785.levels import is_zero, scale_of
from daq.sr785.setup import Timing
from daq.transports.base import Deadline
from daq.transports.transcript import Recorder, Replay
from sim.faults import FaultBoard
from sim.instrument.plant import LinearPlant
from sim.loopback import Loopback
from sim.sr785 import Choices, instrument
from sim.sr785.model import MODEL

QUIET = Choices(noise_v=0.0, converter_noise=0.0)
SETTINGS = PointSettings(source_vpk=1.5, settle_cycles=3, integrate_cycles=4, slew_vpk_per_s=0.0)
GRID = spaced_frequencies(120.0, 160.0, 17)
SHORT = Timing(reply_s=0.3, block_s=0.3, overhead_s=0.5, point_s=0.02)


class Tap:
    """A wire that remembers what crossed it."""

    def __init__(self, wire, swaps=False):
        self._wire, self._swaps = wire, swaps
        self.address = wire.address
        self.acts = []

    @property
    def lines(self):
        return [act for act in self.acts if act not in ("poll", "clear", "read")]

    def write(self, line, deadline):
        self.acts.append(line)
        self._wire.write(line, deadline)

    def read(self, deadline):
        self.acts.append("read")
        return self._wire.read(deadline)

    def read_block(self, deadline):
        return self._wire.read_block(deadline)

    def read_bytes(self, count, deadline):
        self.acts.append("read")
        data = self._wire.read_bytes(count, deadline)
        return np.frombuffer(data, "<f4").byteswap().tobytes() if self._swaps else data

    def serial_poll(self, deadline):
        self.acts.append("poll")
        return self._wire.serial_poll(deadline)

    def device_clear(self, deadline):
        self.acts.append("clear")
        return self._wire.device_clear(deadline)

    def pause(self, seconds):
        self._wire.pause(seconds)

    def close(self):
        self._wire.close()


class Line(Tap):
    """An RS-232 line: no poll, no clear, other interface."""

    def __init__(self, instrument):
        super().__init__(Loopback(instrument))
        self.address = "serial:/dev/nowhere"
        self._instrument = instrument
        self._heard = b""

    def write(self, line, deadline):
        self.acts.append(line)
        self._instrument.serial_in(line.encode() + b"\n")

    def read(self, deadline):
        while b"\r" not in self._heard:
            self._heard += self._instrument.serial_out()
            self._wire.pause(0.01)
            if deadline.expired:
                raise BenchTimeout(f"nothing came within {deadline.span_s:g} s")
        line, _, self._heard = self._heard.partition(b"\r")
        return line.decode()

    def serial_poll(self, deadline):
        return None

    def device_clear(self, deadline):
        self._heard = b""
        self._instrument.serial_out()
        return False


def bench(choices=QUIET, faults=(), timing=None, wire=Tap, gain=known_gain, **options):
    board = FaultBoard([MODEL.parse_fault(fault) for fault in faults])
    simulated = instrument.SR785(LinearPlant(gain), choices, board)
    tap = Line(simulated) if wire is Line else wire(Loopback(simulated), **options)
    return simulated, SR785(tap, timing=timing), tap


def prepared(*words, settings=SETTINGS, **options):
    instrument, analyser, tap = bench(*words, **options)
    analyser.identify()
    analyser.prepare(100.0, 200.0, settings)
    return instrument, analyser, tap


def assert_right(points, frequencies):
    assert len(points) == len(frequencies)
    for point in points:
        true = known_gain(point.frequency_hz)
        assert abs(point.gain - true) <= 1e-4 * abs(true)


# ------------------------------------------------------------ command sequences


def test_identifying_asks_nothing_before_replies_come_here():
    _, analyser, tap = bench()
    analyser.identify()
    assert tap.acts == ["clear", "OUTX 0", "*ESR?", "read", "*IDN?", "read"]


def test_identifying_on_rs232_finds_the_step_by_a_number():
    _, analyser, tap = bench(wire=Line)
    assert analyser.identify().model == "SR785"
    assert tap.lines == ["OUTX 1", "INPE 17", "INPE?", "INPE 0", "*ESR?", "*IDN?"]


def test_no_group_is_chosen_while_the_switch_may_be_on():
    _, analyser, tap = prepared()
    list(analyser.sweep(GRID))
    analyser.make_safe()
    lines = tap.lines
    for place, line in enumerate(lines):
        if line.startswith("MGRP 2"):
            switched = [each for each in lines[:place] if each.startswith("SRCO")]
            assert switched[-2:] == ["SRCO 0", "SRCO?"] or switched[-1] == "SRCO?"
            assert "SRCO 1" not in switched[-2:]


def test_a_sweep_begins_with_the_level_and_ends_with_the_switch():
    _, analyser, tap = prepared()
    begun = len(tap.lines)
    list(analyser.sweep(GRID))
    commands = [line for line in tap.lines[begun:] if "?" not in line]
    start = commands.index("STRT")
    assert commands[start - 4 : start + 1] == [
        "*CLS",
        "SOFF 0 mV",
        "SSAM 1500 mV",
        "SRCO 1",
        "STRT",
    ]
    assert commands[-4:] == ["SRCO 0", "PAUS", "SSAM 0 mV", "SOFF 0 mV"]
    assert commands[:6] == [
        "SSCY 2,3", "SICY 2,4", "SSTR 2,120 Hz", "SSTP 2,160 Hz", "SSTY 2,0", "SNPS 2,17",
    ]  # fmt: skip


def test_the_safe_off_recipe_step_by_step():
    _, analyser, tap = prepared(settings=replace(SETTINGS, slew_vpk_per_s=100.0))
    begun = len(tap.lines)
    assert analyser.make_safe() is SourceState.CONFIRMED_OFF
    assert tap.lines[begun:] == [
        "OUTX 0", "*ESR?",
        "OUTX 0", "SRCO 0", "PAUS", "MGRP? 0", "SRMP?", "SRAT?",
        "SSAL 0", "SSAM 0 mV", "S1AM 0 mV", "S2AM 0 mV", "SOFF 0 mV", "SRCO?",
        "MGRP 2,0", "STYP 0", "S1AM 0 mV", "S2AM 0 mV", "SOFF 0 mV", "SRCO?", "SRCO 0",
        "SRCO?", "MGRP? 0", "SOFF?", "S1AM?", "S2AM?", "*ESR?",
    ]  # fmt: skip


def test_every_command_is_waited_for_before_the_next():
    _, analyser, tap = prepared()
    begun = len(tap.acts)
    list(analyser.sweep(GRID))
    acts = tap.acts[begun:]
    quiet = len(acts) - acts[::-1].index("SRCO 0") - 1  # what follows is sent without waiting
    for act, following in zip(acts[:quiet], acts[1:], strict=False):
        if act in ("poll", "read"):
            continue
        assert following == ("read" if "?" in act else "poll"), act


def test_a_trace_comes_in_binary_on_gpib_and_as_text_on_rs232():
    _, analyser, tap = prepared()
    list(analyser.sweep(GRID))
    assert {"DSPB? 0", "DSPB? 1"} <= set(tap.lines)
    assert "DSPY? 0" not in tap.lines
    _, analyser, tap = prepared(wire=Line)
    points = list(analyser.sweep(GRID))
    assert_right(points, GRID)
    assert {"DSPY? 0", "DSPY? 1"} <= set(tap.lines)
    assert not any(line.startswith("DSPB") for line in tap.lines)


def test_swapped_bytes_are_noticed():
    _, analyser, _ = prepared(swaps=True)
    with pytest.raises(ProtocolError, match="with swapped bytes they agree"):
        list(analyser.sweep(GRID))


def test_frequencies_in_steps_are_one_sweep_and_others_one_each():
    for frequencies, starts in (
        (GRID, 1),
        (GRID[3:9], 1),
        (GRID[:1], 1),
        ((130.0, 150.0, 131.0), 3),
    ):
        _, analyser, tap = prepared()
        points = list(analyser.sweep(frequencies))
        assert_right(points, frequencies)
        assert tap.lines.count("STRT") == starts
        assert [round(point.frequency_hz) for point in points] == [round(hz) for hz in frequencies]


def test_points_come_while_the_sweep_runs_once_the_instrument_is_known():
    instrument, analyser, tap = prepared()
    list(analyser.sweep(GRID[:1]))
    begun = len(tap.lines)
    points = analyser.sweep(spaced_frequencies(110.0, 190.0, 100))
    first = next(points)
    assert first.variances is not None
    assert not any(line.startswith("DSPB") for line in tap.lines[begun:])
    points.close()
    assert instrument.driven_v == 0.0


def test_whoever_wants_an_end_is_heard_between_any_two_exchanges():
    """A look at a sweep is some forty of them, a second on a slow adapter."""
    _, analyser, tap = prepared()
    looked_at = [len(tap.lines)]
    analyser.on_wait = lambda: looked_at.append(len(tap.lines))
    analyser.prepare(100.0, 200.0, SETTINGS)
    list(analyser.sweep(GRID[:1]))
    analyser.prepare(100.0, 200.0, SETTINGS)
    points = analyser.sweep(GRID)
    for _ in points:
        pass
    gaps = [after - before for before, after in pairwise(looked_at)]
    # `quiet` at the end of each sweep is the longest.
    assert max(gaps) <= 5


def test_errors_refer_to_the_cycles_that_were_integrated():
    """At 1 kHz the shortest integration is 16 cycles, whatever was asked for."""
    noisy = replace(QUIET, noise_v=1e-3)
    errors = []
    for cycles in (2, 16):
        wanted = replace(SETTINGS, integrate_cycles=cycles)
        _, analyser, _ = bench(noisy)
        analyser.prepare(900.0, 1100.0, wanted)
        points = list(analyser.sweep(spaced_frequencies(900.0, 1100.0, 30)))
        assert {point.detail["integrated_cycles"] for point in points} <= {15.0, 16.0, 17.0, 18.0}
        errors.append(np.mean([point.gain_std_db for point in points]))
    assert errors[0] == pytest.approx(errors[1], rel=0.25)


@pytest.mark.parametrize("wire", [Tap, Line])
def test_a_recorded_dialogue_measures_again_without_an_instrument(tmp_path, wire):
    def measured(over):
        analyser = SR785(over)
        analyser.identify()
        analyser.prepare(100.0, 200.0, SETTINGS)
        points = [*analyser.sweep(GRID[:1]), *analyser.sweep(GRID)]
        return points, analyser.make_safe()

    _, _, tap = bench(replace(QUIET, noise_v=1e-3), wire=wire)
    recorder = Recorder(tap, tmp_path / "dialogue.jsonl")
    first = measured(recorder)
    recorder.close()
    replay = Replay(tmp_path / "dialogue.jsonl")
    assert measured(replay) == first
    assert replay.unused == 0


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
def test_whatever_the_manual_means_points_are_right_and_the_source_is_off(changes):
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


def test_a_unit_that_explains_nothing_is_refused_before_anything_drives():
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
def test_a_scale_that_does_not_fit_is_none(replies):
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
def test_whatever_a_program_left_on_is_off_and_can_be_measured_with(left, obeys):
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
def test_what_the_source_is_said_to_do_changes_nothing(left, state):
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
def test_no_wrong_number_comes_without_a_word(fault, fixed):
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


def test_a_pause_at_the_panel_ends_the_sweep():
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


def test_a_display_that_was_left_off_line_is_live_again():
    _, analyser, tap = bench()
    for line in ("DISP 2,0", "ACTD 1"):
        tap.write(line, Deadline.after(1.0))
        tap.serial_poll(Deadline.after(1.0))
    analyser.prepare(100.0, 200.0, SETTINGS)
    assert_right(list(analyser.sweep(GRID)), GRID)


def test_an_overload_is_flagged_with_the_points_it_may_concern():
    _, analyser, _ = prepared(settings=replace(SETTINGS, input_range_vpk=(1.0, None)))
    points = list(analyser.sweep(GRID))
    assert all(point.flags & PointFlag.OVERLOAD for point in points)


def test_an_input_that_stays_below_half_of_its_range_is_flagged():
    _, analyser, _ = prepared(settings=replace(SETTINGS, input_range_vpk=(2.0, 20.0)))
    points = list(analyser.sweep(GRID))
    assert all(point.flags & PointFlag.HALF_RANGE_MISSED for point in points)


def test_phase_is_that_of_output_over_input():
    _, analyser, _ = prepared(gain=lambda hz: 0.5 * np.exp(-0.7j))
    for point in analyser.sweep(GRID[:1] + GRID):
        assert math.isclose(math.atan2(point.gain.imag, point.gain.real), -0.7, abs_tol=1e-5)


def test_another_instrument_is_refused():
    analyser = SR785(Loopback(bench_server.simulated("", LinearPlant(known_gain))), timing=SHORT)
    with pytest.raises(LashbenchError):
        analyser.identify()
    assert analyser.make_safe() is not SourceState.CONFIRMED_OFF
