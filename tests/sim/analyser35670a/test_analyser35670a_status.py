"""Section "status": registers, enables, summary bits, service request, and when OPC comes."""

from __future__ import annotations

import pytest

MEASURING, AVERAGING, SETTLING, RANGING, CALIBRATING = 16, 256, 2, 4, 1


def test_power_on_bit_is_read_once(bench):
    controller = bench()
    controller.instrument.power_on()
    assert controller.integer("*ESR?") & 128
    assert controller.integer("*ESR?") & 128 == 0


@pytest.mark.parametrize(("message", "bit"), [("JUNK", 32), ("FREQ:STEP 1E9", 16), ("*OPC", 1)])
def test_events_set_their_bit_and_reading_clears(controller, message, bit):
    controller.write(message)
    assert controller.integer("*ESR?") == bit
    assert controller.integer("*ESR?") == 0


def test_device_errors_set_theirs(bench):
    controller = bench("calibration-failure")
    assert controller.ask("CAL?") == "+1"
    assert controller.integer("*ESR?") == 8
    assert controller.errors() == [-310]
    assert controller.integer("STAT:QUES:COND?") & 256
    assert controller.ask("CAL?") == "+0"
    assert controller.integer("STAT:QUES:COND?") & 256 == 0


def test_status_byte_summarises_and_stb_clears_nothing(controller):
    controller.write("*ESE 32;*SRE 32", "JUNK")
    assert controller.integer("*STB?") == 32 | 64
    assert controller.integer("*STB?") == 32 | 64
    controller.write("*ESE 0")
    assert controller.integer("*STB?") == 0
    controller.write("*ESE 32")
    assert controller.integer("*STB?") == 32 | 64


def test_a_serial_poll_clears_only_the_request(controller):
    instrument = controller.instrument
    controller.write("*ESE 32;*SRE 32", "JUNK")
    assert instrument.service_request
    assert instrument.serial_poll() == 32 | 64
    assert not instrument.service_request
    assert instrument.serial_poll() == 32
    assert controller.integer("*STB?") == 32 | 64
    # The same reason again is no new reason; a fresh one after clearing is.
    controller.write("JUNK")
    assert not instrument.service_request
    controller.write("*ESR?")
    controller.read()
    controller.write("JUNK")
    assert instrument.service_request


def test_enabling_a_set_bit_requests_service(controller):
    controller.write("*ESE 32", "JUNK")
    assert not controller.instrument.service_request
    controller.write("*SRE 32")
    assert controller.instrument.service_request


def test_request_enable_ignores_bit_6(controller):
    controller.write("*SRE 96")
    assert controller.integer("*SRE?") == 32


def test_message_available(controller):
    controller.write("*IDN?")
    assert controller.instrument.serial_poll() == 16
    controller.read()
    assert controller.instrument.serial_poll() == 0
    controller.write("*SRE 16", "*IDN?")
    assert controller.instrument.service_request


def test_filters_decide_which_transition_is_an_event(swept):
    swept.write("STAT:OPER:PTR 0;NTR 16", "STAT:OPER?", "ABOR;:INIT")
    swept.read()
    swept.errors()
    assert swept.integer("STAT:OPER:COND?") & MEASURING
    assert swept.integer("STAT:OPER?") == 0
    swept.run()
    assert swept.integer("STAT:OPER:COND?") & MEASURING == 0
    assert swept.integer("STAT:OPER?") == MEASURING
    assert swept.integer("STAT:OPER?") == 0


def test_user_register(controller):
    controller.write("STAT:USER:ENAB 4", "STAT:USER:PULS 5")
    assert controller.instrument.serial_poll() == 1
    assert controller.integer("STAT:USER?") == 5
    assert controller.instrument.serial_poll() == 0


def test_clear_empties_events_and_leaves_enables(controller):
    controller.write("*ESE 61;*SRE 32", "STAT:USER:ENAB 1", "STAT:USER:PULS 1", "JUNK", "*CLS")
    assert controller.instrument.serial_poll() == 0
    assert controller.integer("*ESE?") == 61
    assert controller.integer("STAT:USER:ENAB?") == 1
    assert controller.errors() == []


def test_status_preset(controller):
    controller.write("STAT:OPER:ENAB 5;PTR 5;NTR 5", "STAT:USER:ENAB 5", "STAT:PRES")
    assert controller.ask("STAT:OPER:ENAB?;PTR?;NTR?") == "+0;+32767;+0"
    assert controller.integer("STAT:USER:ENAB?") == 0


@pytest.mark.parametrize(("flag", "kept"), [(1, 0), (0, 61)])
def test_power_on_clear(controller, flag, kept):
    controller.write(f"*PSC {flag}", "*ESE 61")
    controller.instrument.power_on()
    assert controller.integer("*ESE?") == kept


def test_autocalibration_off_shows_in_the_device_register(controller):
    controller.write("CAL:AUTO OFF")
    assert controller.integer("STAT:DEV:COND?") & 1 == 1
    controller.write("CAL:AUTO ON")
    assert controller.integer("STAT:DEV:COND?") & 1 == 0


def test_the_bits_of_a_sweep(bench):
    controller = bench(ranging_step_s=0.5)
    controller.write("INST:SEL SINE", "FREQ:RES:AUTO OFF", "FREQ:STAR 100;STOP 200",
                     "FREQ:RES 3 PNT/SWP", "SOUR:VOLT 1 VPK", "ABOR;:INIT")  # fmt: skip
    seen = []
    while controller.instrument.agenda.has_work:
        seen.append(controller.integer("STAT:OPER:COND?"))
        controller.instrument.agenda.run_next()
    assert controller.integer("STAT:OPER:COND?") == 0
    # Measuring and averaging hold from start to end, the phases come and go; nothing else.
    assert all(bits & (MEASURING | AVERAGING) == MEASURING | AVERAGING for bits in seen)
    assert {bits & ~(MEASURING | AVERAGING) for bits in seen} == {0, SETTLING, RANGING}
    assert seen.index(272 + SETTLING) < seen.index(272 + RANGING)


def test_opc_comes_at_end_of_sweep(swept):
    swept.write("*CLS", "ABOR;:INIT;*OPC")
    points = 0
    while swept.instrument.agenda.has_work:
        assert swept.instrument.status.standard_event & 1 == 0
        swept.instrument.agenda.run_next()
        points = swept.instrument.measurement.points_begun
    assert points == 5
    assert swept.integer("*ESR?") == 1


def test_service_request_loop_works(swept):
    swept.write("*CLS;*ESE 61;*SRE 32", "ABOR;:INIT;*OPC")
    assert not swept.instrument.service_request
    swept.run()
    assert swept.instrument.service_request
    assert swept.instrument.serial_poll() == 32 | 64
    assert swept.integer("*ESR?") == 1


@pytest.mark.parametrize("killer", ["*CLS", "*RST", "SYST:PRES", "clear"])
def test_a_wait_can_be_cancelled_by_accident(swept, killer):
    swept.write("*CLS", "ABOR;:INIT;*OPC")
    if killer == "clear":
        swept.instrument.device_clear()
    else:
        swept.write(killer)
    swept.instrument.agenda.run_until(swept.instrument.agenda.now_s + 100.0)
    assert swept.integer("*ESR?") & 1 == 0
    if killer in ("*CLS", "clear"):
        # The measurement ran on; nobody was told.
        assert swept.instrument.measurement.points_begun == 5


def test_display_ready_follows_point_or_sweep(swept):
    for fast, expected in (("OFF", 5), ("ON", 1)):
        swept.write(f"AVER:IRES {fast}", "STAT:DEV?", "ABOR;:INIT")
        swept.errors()
        swept.integer("STAT:DEV?")
        ready = 0
        while swept.instrument.agenda.run_next():
            ready += swept.integer("STAT:DEV?") & 32 == 32
        assert ready == expected


@pytest.mark.parametrize("clears", [False, True])
def test_clearing_by_condition_read_is_choice(bench, clears):
    controller = bench(condition_reads_clear=clears)
    controller.write("CAL:AUTO OFF")
    assert controller.integer("STAT:DEV:COND?") == 1
    assert controller.integer("STAT:DEV:COND?") == (0 if clears else 1)
