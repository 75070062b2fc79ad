"""Section "measuring": starting, pausing, time, and which points are measured."""

from __future__ import annotations

import numpy as np
import pytest
from instruments.known_device import Recording, known_answer

NOISELESS = {"noise_v": 0.0, "converter_noise": 0.0}
OVERLOAD_2, ABOVE_HALF_1, ABOVE_HALF_2 = 2, 256, 512


def test_a_measurement_is_overlapped(swept):
    swept.write("ABOR;:INIT")
    assert swept.integer("STAT:OPER:COND?") & 16
    swept.write("FREQ:STEP 33")
    assert swept.number("FREQ:STEP?") == 33
    assert swept.integer("STAT:OPER:COND?") & 16
    assert swept.ask("*OPC?") == "+1"
    assert swept.integer("STAT:OPER:COND?") & 16 == 0


def test_wai_holds_parser_until_sweep_end(swept):
    swept.write("ABOR;:INIT;*WAI;:STAT:OPER:COND?")
    assert swept.instrument.measurement.points_begun < 5
    assert swept.read() == b"+0\n"
    assert swept.instrument.measurement.points_begun == 5


def test_init_is_ignored_in_continuous_mode(swept):
    swept.write("INIT:CONT ON")
    begun = swept.instrument.measurement.started
    swept.write("INIT")
    assert swept.instrument.measurement.started == begun
    assert swept.errors() == []


def test_pause_and_go_on(swept):
    swept.write("ABOR;:INIT")
    while swept.instrument.measurement.points_begun < 3:
        swept.instrument.agenda.run_next()
    swept.write("INIT:CONT OFF")
    swept.wait(1000.0)
    assert swept.instrument.measurement.points_begun == 3
    assert swept.integer("STAT:OPER:COND?") == 0
    swept.write("INIT:CONT ON")
    assert swept.errors() == []
    swept.wait(3.0)
    assert swept.instrument.measurement.points_begun > 3


@pytest.mark.parametrize("change", ["SOUR:VOLT 2 VPK", "SWE:STIM 9 CYCLE", "FREQ:STOP 210",
                                    "CAL:AUTO ONCE", "VOLT2:RANG 1 VPK"])  # fmt: skip
def test_continuing_after_change_or_calibration_is_refused(swept, change):
    swept.write("ABOR;:INIT")
    swept.wait(1.0)
    swept.write("INIT:CONT OFF", change)
    swept.wait(20.0)
    swept.write("INIT:CONT ON")
    assert "Cannot continue measurement" in (swept.ask("SYST:ERR?") or "")
    assert swept.integer("INIT:CONT?") == 0
    # A fresh start is always possible.
    assert swept.refusal("ABOR;:INIT") == []


def test_zero_level_pauses_the_sweep(swept):
    swept.write("SOUR:VOLT 0 VPK", "*CLS", "ABOR;:INIT;*OPC")
    assert swept.ask("SYST:ERR?") == (
        '-221,"Settings conflict; SOURCE LEVEL is 0 Volts, measurement paused."'
    )
    swept.wait(1e5)
    assert swept.integer("*ESR?") & 1 == 0
    assert swept.instrument.measurement.points_begun == 0
    assert swept.integer("STAT:OPER:COND?") & 16 == 0


def test_level_zeroed_in_sweep_pauses_it(swept):
    swept.write("*CLS", "ABOR;:INIT;*OPC")
    swept.wait(1.0)
    swept.write("SOUR:VOLT 0 VPK")
    assert swept.errors() == [-221]
    assert swept.instrument.output_vpk == 0
    begun = swept.instrument.measurement.points_begun
    swept.wait(1000.0)
    assert swept.instrument.measurement.points_begun == begun


def test_continuous_swept_sine_starts_at_level_zero(bench):
    controller = bench()
    controller.write("SYST:PRES")
    controller.run()
    controller.write("INST:SEL SINE")
    assert controller.errors() == [-221]


def test_abort_ends_operation_and_start_restarts(swept):
    swept.write("*CLS", "ABOR;:INIT;*OPC")
    swept.wait(1.0)
    swept.write("ABOR")
    assert swept.integer("STAT:OPER:COND?") == 0
    swept.wait(1000.0)
    assert swept.instrument.measurement.points_begun < 5
    swept.write("ABOR;:INIT")
    swept.run()
    assert np.count_nonzero(swept.complexes("TRAC D1,TRAC1;:TRAC? D1")) == 401


# Time


@pytest.mark.parametrize(
    ("settle", "dwell", "seconds"),
    [
        ("2 CYCLE", "3 CYCLE", sum(5 / hz + 0.5 for hz in (100, 120, 140, 160, 180))),
        ("0.5 S", "1 CYCLE", sum(0.5 + 1 / hz + 0.5 for hz in (100, 120, 140, 160, 180))),
        ("0 S", "0.2 S", 5 * 0.7),
    ],
)
def test_time_passes_as_cycles_and_seconds_ask(swept, settle, dwell, seconds):
    swept.write(f"SWE:STIM {settle}", f"SWE:DWEL {dwell}", "VOLT1:RANG 5 VPK", "VOLT2:RANG 5 VPK")
    begin = swept.instrument.agenda.now_s
    swept.write("ABOR;:INIT")
    swept.run()
    assert swept.instrument.agenda.now_s - begin == pytest.approx(seconds, rel=1e-3)


def test_service_guide_example_takes_a_minute(bench):
    controller = bench()
    controller.write("INST:SEL SINE;:FREQ:RES:AUTO OFF;:SWE:SPAC LOG", "AVER:IRES ON",
                     "FREQ:STOP 51200;STAR 51.2;RES 101 PNT/SWP", "SWE:DWEL 0.1 S",
                     "SOUR:VOLT 5 VPK")  # fmt: skip
    begin = controller.instrument.agenda.now_s
    controller.write("ABOR;:INIT")
    controller.run()
    assert controller.errors() == []
    assert 50 < controller.instrument.agenda.now_s - begin < 70


def test_settle_and_integrate_cycles_reach_the_device(bench):
    plant = Recording()
    bench(plant=plant).sweep("SWE:STIM 7 CYCLE", "SWE:DWEL 11 CYCLE", "SOUR:VOLT:OFFS 0.5")
    assert {call[3:] for call in plant.calls} == {(7, 11)}
    assert {round(call[1], 4) for call in plant.calls} == {1.0}
    assert {round(call[2], 4) for call in plant.calls} == {0.5}


# Which points


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ([], [100, 120, 140, 160, 180]),
        (["SWE:DIR DOWN"], [200, 180, 160, 140, 120]),
        (["FREQ:RES 25 HZ"], [100, 125, 150, 175]),
        (["FREQ:RES 25 PCT"], [100, 125, 150, 175]),
        (["SWE:SPAC LOG", "FREQ:RES 4 PNT/SWP"], [100 * 2 ** (k / 4) for k in range(4)]),
        (["SWE:SPAC LOG", "FREQ:RES 4 PNT/OCT"], [100 * 2 ** (k / 4) for k in range(4)]),
        (["SWE:MODE MAN", "FREQ:MAN 150"], [150]),
    ],
)
def test_sweep_settings_decide_measured_points(bench, changes, expected):
    plant = Recording()
    bench(plant=plant).sweep(*changes)
    assert plant.frequencies == pytest.approx(expected)


def test_measuring_the_stop_frequency_is_choice(bench):
    plant = Recording()
    bench(plant=plant, both_ends=True).sweep()
    assert plant.frequencies == [100, 125, 150, 175, 200]


def test_auto_resolution_refines_where_response_changes(bench):
    def resonance(hz):
        return 0.1 / (1.0 - (hz / 150.0) ** 2 + 0.02j * hz / 150.0)

    plant = Recording(resonance)
    controller = bench(plant=plant)
    controller.sweep("FREQ:RES:AUTO ON", "FREQ:RES:AUTO:MIN 401 PNT/SWP", "FREQ:RES:AUTO:MCH 10")
    steps = np.diff(plant.frequencies)
    assert plant.frequencies[0] == 100
    assert plant.frequencies[-1] == pytest.approx(200)
    middle = np.array(plant.frequencies[:-1])
    near = steps[np.abs(middle - 150) < 3]
    far = steps[(middle > 105) & (middle < 130)]
    assert near.max() < far.min()
    assert steps.min() >= 100 / 401 * 0.999
    axis = controller.reals("TRAC:X? TRAC1")
    assert len(axis) == 401
    assert axis[: len(middle) + 1] == pytest.approx(plant.frequencies)
    gains = controller.complexes("TRAC D1,TRAC1;:TRAC? D1")[: len(middle)]
    assert np.abs(gains) == pytest.approx([abs(resonance(hz)) for hz in middle], rel=0.02)


def test_manual_points_one_after_the_other(swept):
    swept.write("SWE:MODE MAN", "FREQ:RES 401 PNT/SWP")
    for hz in (150.0, 110.015625, 199.0):
        swept.write(f"FREQ:MAN {hz}", "ABOR;:INIT")
        swept.run()
        swept.write("TRAC D1,TRAC1")
        gains, axis = swept.complexes("TRAC? D1"), swept.reals("TRAC:X? D1")
        seen = np.flatnonzero(gains)
        assert len(seen) == 1
        assert abs(axis[seen[0]] - hz) <= 100 / 401
        assert gains[seen[0]] == pytest.approx(known_answer(hz), abs=0.01)
