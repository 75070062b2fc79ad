"""The driver's dialogue, to the letter: what goes out, in which order, and nothing else."""

import math

import pytest
from instruments.dialogues_35670a import (
    AXIS,
    BEGIN,
    DRIVE,
    EMPTY,
    END,
    IDENTIFY,
    PICTURE,
    POINT,
    PREPARE,
    QUIET,
    READ_BACK,
    SET,
    SETTINGS,
    STATUS,
    TRACES,
    driver,
    prepared,
)
from instruments.wire import Script

from daq.analyser import PointSettings, SourceState
from daq.errors import InputError, InstrumentError, LimitError, MeasurementError, ProtocolError
from daq.frf import PointFlag
from daq.hp35670a.identity import parse_identity


def test_identification_reads_identity_and_options():
    analyser, script = driver(IDENTIFY)
    identity = analyser.identify()
    script.finish()
    assert (identity.maker, identity.model) == ("HEWLETT-PACKARD", "35670A")
    assert (identity.serial, identity.revision) == ("MY42509215", "A.01.11")
    assert identity.options == ("1D2", "1D3", "UFF")
    assert not identity.simulated


@pytest.mark.parametrize(
    ("text", "serial"),
    [
        ("Agilent Technologies,35670A,MY425A.01.20", "MY425A.01.20"),
        ("HP, 35670A, 3340A00123, A.01.00", "3340A00123"),
        ("KEYSIGHT TECHNOLOGIES,HP35670A,1,2", "1"),
    ],
)
def test_makers_and_punctuation_vary(text, serial):
    assert parse_identity(text, '""').serial == serial


@pytest.mark.parametrize(
    "text",
    ["Stanford_Research_Systems,SR785,1,2", "ACME,35670A,1,2", "35670A", "", "HP,35665A,1,2",
     "HP,35670A,1,2,3"],
)  # fmt: skip
def test_the_wrong_instrument_is_refused(text):
    with pytest.raises(InstrumentError, match="check the address"):
        parse_identity(text, '""')


def test_missing_option_is_reported_at_once():
    analyser, script = driver(IDENTIFY.replace("1D2,1D3,UFF", "1D3"))
    with pytest.raises(InstrumentError, match="has options 1D3; swept sine needs 1D2"):
        analyser.identify()
    script.finish()


def test_prepare_leaves_only_level_and_offset():
    analyser, script = driver(PREPARE)
    read_back = analyser.prepare(50.01, 200.01, SETTINGS)
    script.finish()
    assert read_back["start (Hz)"] == "50 HZ"
    assert read_back["stop (Hz)"] == "200.015625 HZ"
    assert read_back["channel 2 range (V peak)"].startswith("2.5148668")
    assert read_back["automatic resolution"] == "off"
    assert not any("level (V peak)" in name or "offset" in name for name in read_back)


def test_no_message_fills_the_input_queue():
    messages = [act[2:] for act in Script(IDENTIFY + PREPARE + DRIVE + POINT).acts if act[0] == ">"]
    assert max(len(message) for message in messages) < 120


def test_second_level_needs_no_reset_or_calibration():
    again = (
        "> INST:SEL?\n< SINE\n> *CLS\n> STAT:PRES\n> *ESE 61\n> *SRE 32\n" + EMPTY
        + SET + READ_BACK + TRACES + AXIS + EMPTY
    )  # fmt: skip
    analyser, script = prepared(again)
    analyser.prepare(50.01, 200.01, SETTINGS)
    script.finish()


def test_point_dialogue_gives_gain_and_variances():
    analyser, script = prepared(DRIVE + POINT + END)
    (point,) = analyser.sweep([100.3])
    script.finish()
    assert point.frequency_hz == 100.296875
    assert point.gain == 0.3 - 0.4j
    assert point.variances == (0.0, 0.06)
    assert point.gain_std_db == pytest.approx(8.6858896 * math.sqrt(0.06 / 60))
    assert point.phase_std_deg == pytest.approx(math.degrees(math.sqrt(0.06 / 60)))
    assert point.flags == PointFlag(0)


@pytest.mark.parametrize(
    ("event", "condition", "flags"),
    [
        (0, 768, PointFlag(0)),
        (768, 0, PointFlag(0)),
        # Over already: only the event register has it.
        (1, 768, PointFlag.OVERLOAD),
        # Still there since the point before: the event register latches no more.
        (0, 770, PointFlag.OVERLOAD),
        (256, 0, PointFlag.HALF_RANGE_MISSED),
        (0, 512, PointFlag.HALF_RANGE_MISSED),
        (2, 256, PointFlag.OVERLOAD | PointFlag.HALF_RANGE_MISSED),
        # Channels 3 and 4 are not ours.
        (12, 768, PointFlag(0)),
    ],
)
def test_overload_and_half_range_use_both_registers(event, condition, flags):
    status = f"> STAT:QUES:VOLT?\n< +{event}\n> STAT:QUES:VOLT:COND?\n< +{condition}\n"
    analyser, script = prepared(DRIVE + POINT.replace(STATUS, status) + END)
    (point,) = analyser.sweep([100.3])
    script.finish()
    assert point.flags == flags


@pytest.mark.parametrize("pair", ["0 0", "9.91e37 1", "1 -3.40282346639e38", "9.9e37 9.9e37"])
def test_displayed_filler_marks_point_spoilt(pair):
    analyser, script = prepared(DRIVE + POINT.replace("0.3 -0.4", pair) + END)
    (point,) = analyser.sweep([100.3])
    script.finish()
    assert point.flags == PointFlag.SPOILT
    assert math.isnan(point.gain.real)
    assert point.frequency_hz == 100.296875


@pytest.mark.parametrize("variance", ["9.91e37", "-0.1", "-3.40282346639e38"])
def test_invalid_variance_gives_no_error_bar(variance):
    analyser, script = prepared(DRIVE + POINT.replace("0 0.06 0 0", f"0 {variance} 0 0") + END)
    (point,) = analyser.sweep([100.3])
    script.finish()
    assert point.gain == 0.3 - 0.4j
    assert (point.variances, point.gain_std_db, point.phase_std_deg) == (None, None, None)


def test_unequal_lengths_are_reread_then_refused():
    other_axis = PICTURE.replace(
        "# 0 0 0.3 -0.4 0 0 9.91e37 0\n", "# 0 0 0.3 -0.4\n> TRAC:X? D1\n# 50 100\n"
    )
    shorter = other_axis.replace("# 0 0.0 0 0", "# 0 0").replace("# 0 0.06 0 0", "# 0 0.06")
    analyser, script = prepared(DRIVE + POINT.replace(PICTURE, shorter) + END)
    assert [point.gain for point in analyser.sweep([100.3])] == [0.3 - 0.4j]
    analyser, script = prepared(DRIVE + BEGIN + STATUS + other_axis + QUIET)
    with pytest.raises(ProtocolError, match="belong to different pictures"):
        list(analyser.sweep([100.3]))
    script.finish()


def test_sweep_closed_early_aborts_and_goes_quiet():
    analyser, script = prepared(DRIVE + POINT + "! clear\n" + QUIET)
    points = analyser.sweep([100.3, 150.0])
    next(points)
    points.close()
    script.finish()
    with pytest.raises(MeasurementError, match="prepare it before"):
        analyser.sweep([100.3])


def test_externally_ended_wait_goes_quiet():
    class Enough(Exception):
        pass

    begun = BEGIN[: BEGIN.index("= 96")]
    analyser, script = prepared(DRIVE + begun + "! clear\n" + QUIET)

    def look():
        if script.acts[script.at - 1] == "= 0" and script.at > len(Script(PREPARE + DRIVE).acts):
            raise Enough

    analyser.on_wait = look
    with pytest.raises(Enough):
        list(analyser.sweep([100.3]))
    script.finish()


# What is refused before anything is sent


@pytest.mark.parametrize("frequency_hz", [50.0, 200.02, 0.0, math.nan, 1e6])
def test_a_frequency_outside_the_band_is_refused(frequency_hz):
    analyser, script = prepared("")
    with pytest.raises(LimitError, match="nothing was sent"):
        analyser.sweep([100.3, frequency_hz])
    script.finish()


def test_a_sweep_before_prepare_is_refused():
    analyser, script = driver("")
    with pytest.raises(MeasurementError, match="not set up"):
        analyser.sweep([100.0])
    script.finish()


def test_settings_out_of_range_are_refused():
    analyser, script = driver("")
    with pytest.raises(LimitError, match="nothing was sent"):
        analyser.prepare(50.0, 200.0, PointSettings(6.0, 5, 30))
    script.finish()


@pytest.mark.parametrize("count", [2, 101, 400, 402])
def test_on_box_points_equal_display_lines(count):
    analyser, script = prepared("", method="on-box")
    step = 100.0 / count
    with pytest.raises(InputError, match="401 or 801 points"):
        analyser.sweep([60.0 + step * k for k in range(count)])
    script.finish()


def test_on_box_sweep_is_evenly_spaced():
    analyser, script = prepared("", method="on-box")
    with pytest.raises(InputError, match="spaced evenly"):
        analyser.sweep([60.0 + 100.0 * (k / 400) ** 2 for k in range(401)])
    script.finish()


# The source


@pytest.mark.parametrize(
    ("text", "state"),
    [
        ("> INST:SEL?\n< FFT\n> SOUR:VOLT?\n< 0\n> SOUR:VOLT? UNIT\n< VPK\n> SOUR:VOLT:OFFS?\n"
         "< 0\n> OUTP?\n< +0", SourceState.CONFIRMED_OFF),
        ("> INST:SEL?\n< FFT\n> SOUR:VOLT?\n< 0\n> SOUR:VOLT? UNIT\n< VPK\n> SOUR:VOLT:OFFS?\n"
         "< 0\n> OUTP?\n< +1", SourceState.ON),
        ("> INST:SEL?\n< FFT\n> SOUR:VOLT?\n< 0\n> SOUR:VOLT? UNIT\n< DBVRMS\n> OUTP?\n< +0",
         SourceState.ON),
        ("> INST:SEL?\n< SINE\n> SOUR:VOLT?\n< 0\n> SOUR:VOLT? UNIT\n< VPK\n> SOUR:VOLT:OFFS?\n< 0",
         SourceState.UNCONFIRMED),
        ("> INST:SEL?\n< SINE\n> SOUR:VOLT?\n< 2.5\n> SOUR:VOLT? UNIT\n< VPK", SourceState.ON),
    ],
)  # fmt: skip
def test_read_back_gives_source_state(text, state):
    analyser, script = driver(text)
    assert analyser.source_state() is state
    script.finish()


def test_closing_sends_nothing():
    analyser, script = driver("")
    analyser.close()
    assert script.closed
