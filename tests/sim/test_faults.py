"""Faults on demand: reading them, when they strike, what they do."""

from __future__ import annotations

import math

import pytest

from daq.errors import InputError
from sim.analyser35670a import TalkState
from sim.faults import CATALOGUE, FaultBoard, parse_fault


def test_every_fault_is_read_with_presets():
    for name, kind in CATALOGUE.items():
        fault = parse_fault(name)
        assert (fault.name, fault.point, fault.phase) == (name, kind.point, kind.phase)
        assert fault.times == 1
        assert fault.seconds == (kind.seconds or 0.0)


def test_parameters_are_read():
    fault = parse_fault("slow-reply:seconds=2.5,phase=sweep,times=0,skip=3")
    assert (fault.seconds, fault.phase, fault.times, fault.skip) == (2.5, "sweep", 0, 3)
    assert fault.point is None
    assert parse_fault("dropped-connection:point=7").point == 7
    # With a phase the preset point no longer counts.
    assert parse_fault("silence:phase=prepare").point is None
    assert parse_fault("silence").seconds == math.inf


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("nonsense", "truncated-block"), ("", "dropped-connection"),
        ("silence:when=3", "when"), ("silence:point", "KEY=VALUE"),
        ("silence:point=-1", "point"), ("silence:point=1.5", "point"),
        ("silence:phase=later", "read-out"), ("silence:seconds=soon", "seconds"),
        ("silence:seconds=-1", "seconds"), ("silence:point=1,point=2", "twice"),
        ("overload-burst:seconds=1", "seconds"), ("dropped-connection:", "KEY=VALUE"),
    ],
)  # fmt: skip
def test_bad_faults_are_refused_with_allowed_ones(text, names):
    with pytest.raises(InputError, match=names):
        parse_fault(text)


def test_when_a_fault_strikes():
    board = FaultBoard([parse_fault("silence:point=3,times=2,skip=1"), parse_fault("lost-power")])
    board.points_begun = 2
    assert board.take("silence") is None
    board.points_begun = 3
    taken = [board.take("silence") is not None for _ in range(5)]
    assert taken == [False, True, True, False, False]
    assert board.take("overload-burst") is None
    board = FaultBoard([parse_fault("silence:phase=sweep,times=0")])
    assert board.take("silence") is None
    board.phase = "sweep"
    assert all(board.take("silence") for _ in range(10))


def running(bench, *faults, clock=None):
    """A sweep of five points with faults."""
    controller = bench(*faults, clock=clock)
    controller.sweep()
    return controller


def test_silent_instrument_ignores_the_bus(bench):
    now = [0.0]
    controller = running(bench, "silence:point=3,seconds=10", clock=lambda: now[0])
    instrument = controller.instrument
    assert instrument.serial_poll() is None
    assert instrument.listen(b"*IDN?\n") == 0
    assert instrument.talk().state is TalkState.WAITING
    assert not instrument.service_request
    now[0] = 11.0
    assert controller.ask("*OPT?") == '"1D2"'
    assert controller.number("SOUR:VOLT?") == 1


def test_lost_power_takes_all_settings(bench):
    now = [0.0]
    controller = bench("lost-power:point=3,seconds=2", clock=lambda: now[0])
    controller.write("*ESE 61", "*PSC 0")
    controller.sweep()
    assert controller.instrument.listen(b"*IDN?\n") == 0
    assert controller.instrument.output_vpk == 0
    now[0] = 3.0
    assert controller.ask("INST?") == "FFT"
    assert controller.integer("*ESR?") & 128
    assert controller.integer("*ESE?") == 61
    assert controller.integer("INIT:CONT?") == 1
    controller.write("INST:SEL SINE")
    assert controller.number("SOUR:VOLT?") == 0
    assert controller.number("FREQ:STOP?") == 51200
    assert controller.instrument.measurement.points_begun == 3


def test_garbage_precedes_a_reply(bench):
    controller = running(bench, "garbage-bytes:phase=read-out,size=4")
    controller.write("*OPT?")
    reply = controller.read() or b""
    assert reply == b"\x00\xff\x15\x7f" + b'"1D2"\n'
    assert controller.ask("*OPT?") == '"1D2"'


def test_a_truncated_block(bench):
    controller = running(bench, "truncated-block:size=16")
    controller.write("*OPT?")
    assert controller.read() == b'"1D2"\n'
    controller.write("TRAC:X? TRAC1")
    block = controller.read() or b""
    assert block.startswith(b"#43208")
    assert len(block) == 6 + 3208 - 16
    assert len(controller.reals("TRAC:X? TRAC1")) == 401


def test_a_wrong_length(bench):
    controller = running(bench, "wrong-length:size=8")
    controller.write("TRAC:X? TRAC1")
    block = controller.read() or b""
    assert block.startswith(b"#43216")
    assert len(block) == 6 + 3208 + 1


def test_a_missing_end(bench):
    controller = running(bench, "missing-eoi")
    controller.write("*OPT?")
    talk = controller.instrument.talk()
    assert (talk.data, talk.end) == (b'"1D2"\n', False)
    assert controller.ask("*OPT?") == '"1D2"'


def test_an_overload_burst_spoils_one_point(bench):
    controller = bench("overload-burst:point=3")
    controller.write("STAT:QUES:VOLT?")
    controller.read()
    controller.sweep("FREQ:RES 401 PNT/SWP")
    assert controller.integer("STAT:QUES:VOLT?") & 3 == 3
    gains, axis = controller.complexes("TRAC D1,TRAC1;:TRAC? D1"), controller.reals("TRAC:X? D1")
    expected = [0.1 * (1 + 1j * hz / 100) for hz in axis]
    assert gains == pytest.approx(expected, abs=0.01)
    controller.write("CALC:FEED 'XFR:POW:LIN 1';FORM MLIN")
    controller.run()
    source = controller.reals("CALC:DATA?")
    assert source[2] < 0.9 * source[1]
    assert source[3] == pytest.approx(source[1], rel=1e-3)


def test_a_stuck_measuring_bit(bench):
    controller = bench("stuck-measuring-bit")
    controller.write("*CLS")
    controller.write("INST:SEL SINE;:FREQ:RES:AUTO OFF;:SOUR:VOLT 1 VPK", "ABOR;:INIT;*OPC")
    controller.wait(1e4)
    assert controller.integer("STAT:OPER:COND?") & 16
    assert controller.integer("*ESR?") & 1 == 0
    controller.write("ABOR")
    assert controller.integer("STAT:OPER:COND?") & 16
    controller.write("*RST")
    controller.run()
    assert controller.integer("STAT:OPER:COND?") & 16 == 0


def test_device_clear_frees_a_stuck_parser(bench):
    controller = bench("stuck-parser:phase=prepare,skip=1")
    controller.instrument.listen(b"FREQ:STEP 1\n")
    controller.instrument.listen(b"FREQ:STEP 2\n*IDN?\n")
    assert controller.instrument.talk().state is TalkState.WAITING
    assert controller.instrument.serial_poll() == 0
    controller.instrument.device_clear()
    assert controller.ask("*OPT?") == '"1D2"'


def test_an_overflowing_error_queue(bench):
    controller = running(bench, "error-queue-overflow:point=2")
    assert controller.errors() == [-113, -113, -113, -113, -350]


def test_a_hardware_error(bench):
    controller = running(bench, "hardware-error:point=2")
    assert controller.errors() == [-240]
    assert controller.integer("STAT:DEV:COND?") & 4


def test_a_missing_option(bench):
    controller = bench("missing-option", options="1D1,1D2,UFF")
    assert controller.ask("*OPT?") == '"1D1,UFF"'
    assert controller.refusal("INST:SEL SINE") == [-200]


def test_power_off_over_bus_needs_a_person(bench):
    controller = bench()
    controller.sweep()
    controller.write("SYST:POW:STAT OFF")
    assert controller.instrument.serial_poll() is None
    assert controller.instrument.output_vpk == 0


@pytest.mark.parametrize(
    ("phase", "reached"), [("prepare", "setup"), ("sweep", "start"), ("read-out", "read")]
)
def test_a_fault_waits_for_its_phase(bench, phase, reached):
    # The message that resets the instrument has been an opportunity as well.
    controller = bench(f"error-queue-overflow:phase={phase},skip={int(phase == 'prepare')}")
    order = {
        "setup": ["INST:SEL SINE;:FREQ:RES:AUTO OFF;:SOUR:VOLT 1 VPK"],
        "start": ["ABOR;:INIT"],
        "read": ["TRAC D1,TRAC1"],
    }
    struck = ""
    for step, messages in order.items():
        controller.write(*messages)
        controller.run()
        if len(controller.instrument.errors) and not struck:
            struck = step
    assert struck == reached
