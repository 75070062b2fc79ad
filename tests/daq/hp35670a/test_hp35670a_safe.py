"""The safe-off recipe: its steps in order, each tried, proof or an honest word, no raise."""

import threading
import time

import pytest
from instruments.wire import Script

from daq.analyser import PointSettings, SourceState
from daq.errors import BenchTimeout, LinkError, MeasurementError, ProtocolError
from daq.hp35670a import HP35670A
from daq.hp35670a.safe import make_safe
from daq.transports.base import Deadline
from sim.analyser35670a import Analyser35670A, Choices, LinearPlant
from sim.analyser35670a.settings import Mode
from sim.loopback import Loopback

EMPTY = '> SYST:ERR?\n< +0,"No error"\n'

QUIET = """
! clear
> ABOR
> INIT:CONT OFF
> SOUR:VOLT 0 VPK
> SOUR:VOLT:OFFS 0 V
> INST:SEL?
< {mode}
{ramp}> INST:SEL FFT
> SOUR:VOLT 0 VPK
> SOUR:VOLT:OFFS 0 V
> OUTP OFF
"""
RAMP = "> SOUR:VOLT:SLEW? UNIT\n< VPK/S\n> SOUR:VOLT:SLEW?\n< +1.0E+001\n"
PROOF = """
> OUTP?
< +0
> SOUR:VOLT? UNIT
< VPK
> SOUR:VOLT?
< +0.00000000000E+000
> SOUR:VOLT:OFFS?
< +0.00000000000E+000
> INST:SEL?
< FFT
"""
FROM_SINE = QUIET.format(mode="SINE", ramp=RAMP)
RESET = "> *RST\n> INST:SEL?\n< FFT\n> OUTP OFF\n"


def test_the_recipe_in_order_with_proof():
    script = Script(
        FROM_SINE + PROOF
        + '> SYST:ERR?\n< -221,"Settings conflict; SOURCE LEVEL is 0 Volts"\n' + EMPTY
    )  # fmt: skip
    done = make_safe(script)
    script.finish()
    assert done.state is SourceState.CONFIRMED_OFF
    assert not any(step.failed for step in done.steps)
    assert str(done) == "source confirmed-off"
    # The ramp from the highest level is waited for, since the true one is not known.
    assert script.paused_s == pytest.approx(5.0 / 10.0 + 0.1)


def test_missing_ramp_is_not_awaited():
    script = Script(QUIET.format(mode="FFT", ramp="") + PROOF + EMPTY)
    assert make_safe(script).state is SourceState.CONFIRMED_OFF
    none = QUIET.format(mode="SINE", ramp=RAMP.replace("+1.0E+001", "+0.0E+000"))
    script_2 = Script(none + PROOF + EMPTY)
    assert make_safe(script_2).state is SourceState.CONFIRMED_OFF
    assert script.paused_s == script_2.paused_s == 0.0


def test_slow_ramp_is_awaited_within_bound():
    slow = FROM_SINE.replace("+1.0E+001", "+1.0E-003")
    script = Script(slow + PROOF + EMPTY)
    assert make_safe(script).state is SourceState.CONFIRMED_OFF
    assert script.paused_s == 10.0


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("> OUTP?\n< +0", "> OUTP?\n< +1"),
        ("< VPK\n> SOUR:VOLT?", "< DBVRMS\n> SOUR:VOLT?"),
        ("SOUR:VOLT?\n< +0.00000000000E+000", "SOUR:VOLT?\n< +2.50000000000E-003"),
        ("OFFS?\n< +0.00000000000E+000", "OFFS?\n< +1.0E+000"),
        ("< FFT", "< SINE"),
        ("> OUTP?\n< +0", "> OUTP?\n< FFT"),
    ],
)
def test_failed_proof_resets_then_reports_unconfirmed(old, new):
    failed = PROOF.replace(old, new)
    assert failed != PROOF
    script = Script(FROM_SINE + failed + RESET + failed + EMPTY)
    assert make_safe(script).state is SourceState.UNCONFIRMED
    script.finish()
    # If the reset helps, it is proven after all.
    script = Script(FROM_SINE + failed + RESET + PROOF + EMPTY)
    assert make_safe(script).state is SourceState.CONFIRMED_OFF
    script.finish()


class Broken:
    """A wire on which everything fails, in one of the ways there are."""

    address = "broken:"

    def __init__(self, fault: Exception, works: tuple[str, ...] = ()) -> None:
        self.fault, self.works = fault, works
        self.tried: list[str] = []

    def write(self, line, deadline):
        self.tried.append(line)
        if not line.startswith(self.works) or not self.works:
            raise self.fault

    def read(self, deadline):
        raise self.fault

    read_block = serial_poll = device_clear = read

    def pause(self, seconds):
        pass

    def close(self):
        pass


@pytest.mark.parametrize(
    "fault",
    [LinkError("gone"), BenchTimeout("silent"), ProtocolError("rubbish"), OSError("cable"),
     RuntimeError("a bug")],
)  # fmt: skip
def test_every_step_is_tried_without_raising(fault):
    wire = Broken(fault)
    done = make_safe(wire)
    assert done.state is SourceState.UNKNOWN
    for line in ("ABOR", "INIT:CONT OFF", "SOUR:VOLT 0 VPK", "SOUR:VOLT:OFFS 0 V", "INST:SEL FFT",
                 "OUTP OFF", "OUTP?", "SOUR:VOLT?", "*RST"):  # fmt: skip
        assert line in wire.tried
    assert wire.tried.count("SOUR:VOLT 0 VPK") == 2
    assert all(step.failed for step in done.steps)
    assert str(fault) in str(done)


def test_make_safe_ignores_driver_state_and_repeats():
    instrument = Analyser35670A(LinearPlant(lambda hz: 0.5 + 0j))
    analyser = HP35670A(Loopback(instrument))
    assert analyser.make_safe() is SourceState.CONFIRMED_OFF
    analyser.identify()
    analyser.prepare(50.0, 200.0, PointSettings(2.5, 2, 3))
    points = analyser.sweep([60.0, 70.0, 80.0])
    next(points)
    assert instrument.output_vpk == pytest.approx(2.5)
    assert analyser.make_safe() is SourceState.CONFIRMED_OFF
    assert analyser.make_safe() is SourceState.CONFIRMED_OFF
    assert instrument.output_vpk == 0.0
    assert analyser.source_state() is SourceState.CONFIRMED_OFF
    with pytest.raises(MeasurementError, match="made safe while the sweep ran"):
        next(points)
    assert instrument.output_vpk == 0.0


@pytest.mark.parametrize("mode", [Mode.FFT, Mode.SINE])
def test_both_modes_are_quiet_afterwards(mode):
    instrument = Analyser35670A(LinearPlant(lambda hz: 0.5 + 0j), Choices(source_stays_on=True))
    wire = Loopback(instrument)

    for line in ("INST:SEL FFT;:SOUR:VOLT 1 VPK;:SOUR:VOLT:OFFS 0.5 V;:OUTP ON",
                 "INST:SEL SINE;:SOUR:VOLT 2 VPK;:SOUR:VOLT:OFFS 0.25 V;:INIT:CONT ON",
                 f"INST:SEL {mode.name}"):  # fmt: skip
        wire.write(line, Deadline.after(1.0))
    if mode is Mode.FFT:
        assert instrument.output_vpk > 0
    assert HP35670A(wire).make_safe() is SourceState.CONFIRMED_OFF
    assert instrument.output_vpk == 0.0
    assert instrument.source.offset_v == 0.0


def test_entering_swept_sine_drives_no_earlier_level():
    instrument = Analyser35670A(LinearPlant(lambda hz: 0.5 + 0j))
    wire = Loopback(instrument)

    wire.write("INST:SEL SINE;:SOUR:VOLT 5 VPK;:INST:SEL FFT", Deadline.after(1.0))
    seen = []
    refresh = instrument.refresh_source

    def watched():
        refresh()
        seen.append((instrument.source.target_vpk, instrument.source.offset_v))

    instrument.refresh_source = watched
    analyser = HP35670A(wire)
    analyser.identify()
    analyser.prepare(50.0, 200.0, PointSettings(2.5, 2, 3))
    assert set(seen) == {(0.0, 0.0)}


def test_make_safe_from_thread_ends_the_sweep():
    instrument = Analyser35670A(LinearPlant(lambda hz: 0.5 + 0j))
    analyser = HP35670A(Loopback(instrument))
    analyser.identify()
    analyser.prepare(50.0, 200.0, PointSettings(2.5, 2, 3))
    states = []
    stop = threading.Thread(target=lambda: states.append(analyser.make_safe()))
    points = analyser.sweep([60.0 + 0.1 * k for k in range(1000)])
    taken = [next(points) for _ in range(5)]
    stop.start()
    with pytest.raises(MeasurementError, match="made safe while the sweep ran"):
        taken.extend(points)
    stop.join()
    assert states == [SourceState.CONFIRMED_OFF]
    assert instrument.output_vpk == 0.0
    assert analyser.source_state() is SourceState.CONFIRMED_OFF


def test_a_silent_instrument_costs_a_bounded_time():
    class Silent(Broken):
        """Takes everything and never answers; each wait lasts as long as it may."""

        def write(self, line, deadline):
            self.tried.append(line)

        def read(self, deadline):
            time.sleep(deadline.remaining_s / 50.0)
            raise BenchTimeout("silent")

        device_clear = read

    started = time.monotonic()
    assert make_safe(Silent(BenchTimeout("silent"))).state is SourceState.UNKNOWN
    assert time.monotonic() - started < 20.0 / 50.0 + 0.2
