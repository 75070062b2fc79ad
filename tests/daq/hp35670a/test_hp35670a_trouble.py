"""What goes wrong on the wire or in the instrument, and what the driver makes of it."""

import struct

import pytest
from instruments.dialogues_35670a import (
    AXIS,
    BEGIN,
    DRIVE,
    EMPTY,
    END,
    PICTURE,
    POINT,
    PREPARE,
    QUIET,
    READ_BACK,
    SETTINGS,
    STATUS,
    UNMOVED,
    driver,
    prepared,
)
from instruments.wire import Script

from daq.errors import BenchTimeout, InstrumentError, MeasurementError, ProtocolError
from daq.hp35670a import HP35670A
from daq.hp35670a.setup import Timing

# Waiting


def after_begin(text: str) -> str:
    return DRIVE + BEGIN[: BEGIN.index("= 0")] + text


def test_zero_level_in_instrument_ends_the_wait():
    parked = after_begin(
        '= 96\n> *ESR?\n< +16\n> SYST:ERR?\n< -221,"Settings conflict; SOURCE LEVEL is 0 Volts, '
        'measurement paused."\n' + EMPTY + QUIET
    )
    analyser, script = prepared(parked)
    with pytest.raises(InstrumentError, match=r"point at 100.3 Hz: .* -221 Settings conflict"):
        list(analyser.sweep([100.3]))
    script.finish()


def test_power_failure_without_status_is_noticed():
    polls = "= 0\n" * 11
    analyser, script = prepared(after_begin(polls + "= 0\n> *ESR?\n< +128\n" + QUIET))
    with pytest.raises(InstrumentError, match="switched off and on"):
        list(analyser.sweep([100.3]))
    script.finish()


def test_unreported_end_is_noticed_by_condition_register():
    # Every twelfth poll the events are read, and then the operation register.
    dozen = "= 0\n" * 12 + "> *ESR?\n< +0\n> STAT:OPER:COND?\n< +0\n"
    lost = after_begin(dozen * 3 + "> *ESR?\n< +0\n" + QUIET)
    analyser, script = prepared(lost)
    with pytest.raises(MeasurementError, match="nothing is running and its end was not reported"):
        list(analyser.sweep([100.3]))
    script.finish()


def test_long_measurement_is_awaited():
    dozen = "= 0\n" * 12 + "> *ESR?\n< +0\n> STAT:OPER:COND?\n< +272\n"
    rest = STATUS + PICTURE + "> STAT:DEV?\n< +32\n" + EMPTY + UNMOVED + END
    analyser, script = prepared(after_begin(dozen * 5 + "= 96\n> *ESR?\n< +1\n" + rest))
    assert len(list(analyser.sweep([100.3]))) == 1
    script.finish()


def test_wire_without_poll_reads_event_register():
    def without_poll(text: str) -> str:
        """The same dialogue where every fruitless poll is an event register of 0."""
        fruitless = text.replace("= 0\n", "= none\n> *ESR?\n< +0\n")
        return fruitless.replace("= 96\n", "= none\n").replace("= 32\n", "= none\n")

    script = Script(without_poll(PREPARE + DRIVE + POINT + END))
    analyser = HP35670A(script)
    analyser.prepare(50.01, 200.01, SETTINGS)
    assert len(list(analyser.sweep([100.3]))) == 1
    script.finish()


def test_a_wait_has_a_bound():
    class Forever(Script):
        def serial_poll(self, deadline):
            if self.at < len(self.acts) and self.acts[self.at][0] == "=":
                return super().serial_poll(deadline)
            return 0

        def write(self, line, deadline):
            if line in ("*ESR?", "STAT:OPER:COND?") and self.at >= stop:
                self.waiting = line
                return
            super().write(line, deadline)

        def read(self, deadline):
            if self.at >= stop and self.waiting:
                return {"*ESR?": "+0", "STAT:OPER:COND?": "+16"}[self.waiting]
            return super().read(deadline)

        def device_clear(self, deadline):
            self.waiting = ""
            return super().device_clear(deadline)

    head = PREPARE + after_begin("")
    stop = len(Script(head).acts)
    script = Forever(head + "! clear\n" + EMPTY + QUIET)
    script.waiting = ""
    analyser = HP35670A(script, timing=Timing(overhead_s=0.05, margin=0.0))
    analyser.prepare(50.01, 200.01, SETTINGS)
    with pytest.raises(BenchTimeout, match=r"point at 100.3 Hz: \*OPC did not report the end"):
        list(analyser.sweep([100.3]))
    script.finish()


# What the instrument may do wrong


def test_bytes_in_the_other_order_are_recognised():
    axis = struct.unpack(">4d", struct.pack("<4d", 50.0, 100.0, 150.0, 200.0))
    swapped = AXIS.replace("# 50 100 150 200", "# " + " ".join(repr(x) for x in axis))
    analyser, script = driver(PREPARE.replace(AXIS, swapped))
    with pytest.raises(ProtocolError, match="little-endian they are such a ramp"):
        analyser.prepare(50.01, 200.01, SETTINGS)


@pytest.mark.parametrize("axis", ["50 100 90 200", "1 2 3 4", "50", "50 50 50 50", "nan 1 2 3"])
def test_axis_that_is_no_ramp_is_rejected(axis):
    analyser, _ = driver(PREPARE.replace("# 50 100 150 200", f"# {axis}"))
    with pytest.raises(ProtocolError, match="no ramp"):
        analyser.prepare(50.01, 200.01, SETTINGS)


@pytest.mark.parametrize(
    ("old", "new", "then", "fault"),
    [
        ("> OUTP?\n< +0", "> OUTP?\n< +1", "", "OUTP. does not read 0; switch the source off"),
        ("< FFT", "< SINE", EMPTY, "instrument mode was set to 'FFT' and reads back SINE"),
        ("UNIT\n< VPK", "UNIT\n< DBVRMS", "", r"was set to 0 in FFT mode and reads back 1.41"),
        ("> STAT:QUES:COND?\n< +0", "> STAT:QUES:COND?\n< +256", "", "calibration failed"),
        ("AUTO?\n< +0", "AUTO?\n< +1", EMPTY, "automatic resolution was set to False and reads"),
        ("< CYCLE", "< S", "! clear\n" + EMPTY, "answers in 'S'; CYCLE was due"),
        ("< DBVRMS", "< VPK", EMPTY, "channel 2 range .* was set to 2.0 and reads back 5 VPK"),
    ],
)
def test_wrong_read_back_stops_the_setup(old, new, then, fault):
    before = PREPARE[: PREPARE.index(old)]
    analyser, script = driver(f"{before}{new}\n{then}")
    with pytest.raises((InstrumentError, ProtocolError), match=fault):
        analyser.prepare(50.01, 200.01, SETTINGS)
    script.finish()


def test_key_press_causes_complete_read_back():
    pressed = POINT.replace("> STAT:DEV?\n< +32", "> STAT:DEV?\n< +48").removesuffix(UNMOVED)
    analyser, script = prepared(DRIVE + pressed + READ_BACK + UNMOVED + END)
    assert len(list(analyser.sweep([100.3]))) == 1
    script.finish()
    changed = READ_BACK[: READ_BACK.index("< DC")] + "< AC\n" + EMPTY + QUIET
    analyser, script = prepared(DRIVE + pressed + changed)
    with pytest.raises(InstrumentError, match="coupling was set to 'DC' and reads back AC"):
        list(analyser.sweep([100.3]))
    script.finish()


@pytest.mark.parametrize(
    ("moved", "fault"),
    [
        (UNMOVED.replace("+2.5", "+4.0"), "source level .* was set to 2.5 and reads back 4"),
        (UNMOVED.replace("+0.0", "+2.0"), "source offset .* was set to 0.0 and reads back 2"),
    ],
)
def test_point_driven_otherwise_is_not_returned(moved, fault):
    lines = moved.split("> SOUR:VOLT:OFFS?")[0] if "+4.0" in moved else moved
    analyser, script = prepared(DRIVE + POINT.removesuffix(UNMOVED) + lines + EMPTY + QUIET)
    with pytest.raises(InstrumentError, match=fault):
        list(analyser.sweep([100.3]))
    script.finish()
