"""The SR785's driver by its dialogue on the wire: which commands it sends, in which order."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from instruments.driven_sr785 import GRID, QUIET, SETTINGS, Line, Tap, assert_right, bench, prepared

from daq.analyser import SourceState
from daq.errors import ProtocolError
from daq.plan import spaced_frequencies
from daq.sr785 import SR785
from daq.transports.transcript import Recorder, Replay


def test_identification_directs_replies_first():
    _, analyser, tap = bench()
    analyser.identify()
    assert tap.acts == ["clear", "OUTX 0", "*ESR?", "read", "*IDN?", "read"]


def test_rs232_identification_synchronises_by_a_number():
    _, analyser, tap = bench(wire=Line)
    assert analyser.identify().model == "SR785"
    assert tap.lines == ["OUTX 1", "INPE 17", "INPE?", "INPE 0", "*ESR?", "*IDN?"]


def test_group_is_chosen_only_with_switch_off():
    _, analyser, tap = prepared()
    list(analyser.sweep(GRID))
    analyser.make_safe()
    lines = tap.lines
    for place, line in enumerate(lines):
        if line.startswith("MGRP 2"):
            switched = [each for each in lines[:place] if each.startswith("SRCO")]
            assert switched[-2:] == ["SRCO 0", "SRCO?"] or switched[-1] == "SRCO?"
            assert "SRCO 1" not in switched[-2:]


def test_sweep_starts_with_level_ends_with_switch():
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


def test_each_command_completes_before_the_next():
    _, analyser, tap = prepared()
    begun = len(tap.acts)
    list(analyser.sweep(GRID))
    acts = tap.acts[begun:]
    quiet = len(acts) - acts[::-1].index("SRCO 0") - 1  # what follows is sent without waiting
    for act, following in zip(acts[:quiet], acts[1:], strict=False):
        if act in ("poll", "read"):
            continue
        assert following == ("read" if "?" in act else "poll"), act


def test_trace_is_binary_or_text_by_wire():
    """Binary on GPIB, text on RS-232."""
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


def test_stepped_frequencies_make_one_sweep():
    """Other frequencies make one each."""
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


def test_points_come_during_sweeps_after_first():
    """The first sweep makes the instrument known."""
    instrument, analyser, tap = prepared()
    list(analyser.sweep(GRID[:1]))
    begun = len(tap.lines)
    points = analyser.sweep(spaced_frequencies(110.0, 190.0, 100))
    first = next(points)
    assert first.variances is not None
    assert not any(line.startswith("DSPB") for line in tap.lines[begun:])
    points.close()
    assert instrument.driven_v == 0.0


def test_stop_is_checked_between_all_exchanges():
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


def test_errors_refer_to_integrated_cycles():
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
def test_recorded_dialogue_replays_without_instrument(tmp_path, wire):
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
