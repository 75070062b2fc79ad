"""Section "measuring": ranges, source, calibration, noise, and the device behind."""

from __future__ import annotations

import math

import numpy as np
import pytest
from instruments.known_device import Recording, known_answer

from sim.analyser35670a import LinearPlant

NOISELESS = {"noise_v": 0.0, "converter_noise": 0.0}
OVERLOAD_2, ABOVE_HALF_1, ABOVE_HALF_2 = 2, 256, 512


# Ranges


def test_autorange_follows_signal_and_takes_time(bench):
    controller = bench(**NOISELESS)
    controller.sweep("SWE:MODE MAN", "FREQ:MAN 150", "SOUR:VOLT 2 VPK")
    first = controller.instrument.agenda.now_s
    assert controller.number("VOLT1:RANG?") == 3
    assert controller.number("VOLT2:RANG?") == -13
    controller.write("ABOR;:INIT")
    controller.run()
    second = controller.instrument.agenda.now_s
    controller.write("SOUR:VOLT 0.1 VPK", "ABOR;:INIT")
    controller.run()
    assert controller.number("VOLT1:RANG?") == pytest.approx(-19, abs=2)
    assert controller.instrument.agenda.now_s - second > second - first + 0.9
    assert controller.integer("STAT:QUES:VOLT?") & 0xF == 0


def test_fixed_range_clips_and_flags_point(bench):
    controller = bench(plant=LinearPlant(lambda hz: 1.0), **NOISELESS)
    controller.sweep("VOLT1:RANG 5 VPK", "VOLT2:RANG 0.5 VPK", "SOUR:VOLT 4 VPK")
    assert controller.integer("STAT:QUES:VOLT?") & 0xF == OVERLOAD_2
    assert controller.integer("STAT:QUES:VOLT?") & 0xF == 0
    gains = controller.complexes("TRAC D1,TRAC1;:TRAC? D1")
    assert len(gains) == 401
    full_scale = math.sqrt(2) * 10 ** (-9 / 20)
    q = 10 ** (2 / 20) * full_scale / 4.0
    clipped = 2 / math.pi * (math.asin(q) + q * math.sqrt(1 - q * q))
    assert np.abs(gains) == pytest.approx(np.full(401, clipped), rel=1e-4)


def test_half_range_bits_follow_input_level(bench):
    controller = bench(plant=LinearPlant(lambda hz: 0.1), **NOISELESS)
    controller.sweep("VOLT1:RANG 1.2 VPK", "VOLT2:RANG 5 VPK", "SOUR:VOLT 1 VPK")
    assert controller.integer("STAT:QUES:VOLT:COND?") == ABOVE_HALF_1
    controller.sweep("VOLT1:RANG 1.2 VPK", "VOLT2:RANG 0.12 VPK", "SOUR:VOLT 1 VPK")
    assert controller.integer("STAT:QUES:VOLT:COND?") == ABOVE_HALF_1 | ABOVE_HALF_2


def test_the_overload_bit_latches_and_sums_up(bench):
    controller = bench(plant=LinearPlant(lambda hz: 1.0))
    controller.write("*SRE 8", "STAT:QUES:ENAB 1", "STAT:QUES:VOLT:ENAB 3")
    controller.sweep("VOLT2:RANG 0.5 VPK", "SOUR:VOLT 4 VPK")
    assert controller.instrument.service_request
    assert controller.integer("STAT:QUES:VOLT:COND?") & 0xF == 0
    assert controller.integer("STAT:QUES?") & 1
    assert controller.integer("STAT:QUES:VOLT?") & OVERLOAD_2


# Source


def test_source_ramps_with_sweep_and_level(bench):
    plant = Recording()
    controller = bench(plant=plant)
    controller.write("INST:SEL SINE;:FREQ:RES:AUTO OFF;:FREQ:STAR 100;STOP 200;RES 3 PNT/SWP",
                     "SOUR:VOLT:SLEW 0.5 VPK/S", "SOUR:VOLT 2 VPK")  # fmt: skip
    instrument = controller.instrument
    assert instrument.output_vpk == 0
    controller.write("ABOR;:INIT")
    controller.wait(1.0)
    assert instrument.output_vpk == pytest.approx(0.5)
    assert plant.calls == []
    controller.wait(3.1)
    assert instrument.output_vpk == 2
    controller.run()
    controller.write("SOUR:VOLT 0 VPK")
    controller.wait(2.0)
    assert instrument.output_vpk == pytest.approx(1.0)
    controller.wait(2.1)
    assert instrument.output_vpk == 0


@pytest.mark.parametrize(("stays", "left"), [(True, 1.0), (False, 0.0)])
def test_source_after_sweep_is_a_choice(bench, stays, left):
    controller = bench(source_stays_on=stays)
    controller.sweep()
    assert controller.instrument.output_vpk == left


def test_level_mode_and_reset_silence_source(bench):
    for message in ("SOUR:VOLT 0 VPK", "INST:SEL FFT", "*RST", "SYST:PRES"):
        controller = bench()
        controller.sweep()
        assert controller.instrument.output_vpk == 1
        controller.write(message)
        assert controller.instrument.output_vpk == 0, message
    controller = bench()
    controller.write("SOUR:VOLT 1 VPK")
    assert controller.instrument.output_vpk == 0
    controller.write("OUTP ON")
    assert controller.instrument.output_vpk == 1
    controller.write("OUTP OFF")
    assert controller.instrument.output_vpk == 0


def test_auto_level_keeps_channel_within_limits(bench):
    def driven(*changes: str) -> float:
        plant = Recording(lambda hz: 0.5)
        controller = bench(plant=plant, **NOISELESS)
        controller.sweep("SWE:MODE MAN", "FREQ:MAN 150", "SOUR:VOLT:AUTO ON", *changes)
        assert controller.errors() == []
        return plant.calls[-1][1]

    wanted = ("SOUR:VOLT:REF 1 VPK", "SOUR:VOLT:LIM 4 VPK", "SOUR:VOLT:LIM:INP 4 VPK")
    assert driven(*wanted) == pytest.approx(2.0, rel=1e-3)
    assert driven(*wanted, "SOUR:VOLT:LIM 1.5 VPK") == pytest.approx(1.5, rel=1e-3)
    assert driven(*wanted, "SOUR:VOLT:LIM:INP 1.2 VPK") == pytest.approx(1.2, rel=1e-3)
    # Within tolerance nothing moves; auto level off ignores both limits.
    assert driven(*wanted, "SOUR:VOLT 1.7 VPK") == pytest.approx(1.7, rel=1e-3)
    assert driven("SOUR:VOLT:AUTO OFF", "SOUR:VOLT:LIM 1 VPK", "SOUR:VOLT 3 VPK") == pytest.approx(
        3.0, rel=1e-3
    )


# Calibration


def test_autocalibration_occurs_in_sweep_or_pause(bench):
    controller = bench(calibrations_s=(5.0,))
    controller.instrument.power_on()
    controller.write("INIT:CONT OFF", "CAL:AUTO ON", "INST:SEL SINE;:FREQ:RES:AUTO OFF",
                     "FREQ:STAR 100;STOP 200;RES 20 PNT/SWP", "SOUR:VOLT 1 VPK",
                     "ABOR;:INIT")  # fmt: skip
    calibrating = []
    while controller.instrument.measurement.running:
        controller.instrument.agenda.run_next()
        calibrating.append(controller.integer("STAT:OPER:COND?") & 1)
    assert 1 in calibrating
    assert calibrating[0] == calibrating[-1] == 0
    assert controller.instrument.measurement.spoilt


def test_autocalibration_follows_its_schedule(bench):
    controller = bench()
    controller.instrument.power_on()
    controller.write("CAL:AUTO ON", "STAT:OPER:PTR 1", "STAT:OPER?")
    controller.read()
    moments = []
    for minute in range(1, 400):
        controller.wait(60.0)
        if controller.integer("STAT:OPER?") & 1:
            moments.append(minute)
    assert moments == [5, 15, 30, 60, 200, 340]
    controller.write("CAL:AUTO OFF")
    controller.wait(10000.0)
    assert controller.integer("STAT:OPER?") & 1 == 0


# Noise


def points(controller) -> np.ndarray:
    gains = controller.complexes("TRAC D1,TRAC1;:TRAC? D1")
    return gains[np.concatenate(([True], np.diff(gains) != 0))]


def test_noise_is_as_stated_per_cycle(bench):
    for cycles, expected in ((30, 0.5e-3), (120, 0.25e-3)):
        controller = bench(seed=cycles)
        controller.sweep("FREQ:RES 401 PNT/SWP", f"SWE:DWEL {cycles} CYCLE", "SOUR:VOLT 2 VPK")
        gains = controller.complexes("TRAC D1,TRAC1;:TRAC? D1")
        hertz = controller.reals("TRAC:X? D1")
        residual = (gains - np.array([known_answer(hz) for hz in hertz])) * 2.0
        for part in (residual.real, residual.imag):
            # 401 draws: the spread is known to 3.5 %, so 15 % fails once in ten thousand.
            assert part.std() == pytest.approx(expected, rel=0.15)
            assert abs(part.mean()) < 4 * expected / math.sqrt(401)


def test_normalised_variance_follows_noise_and_cycles(bench):
    def variance(level: float, cycles: int, noise: float) -> float:
        controller = bench(noise_v=noise)
        controller.sweep("CALC1:FEED 'XFR:POW:VAR 2'", "CALC1:FORM REAL", "FREQ:RES 100 PNT/SWP",
                         f"SOUR:VOLT {level} VPK", f"SWE:DWEL {cycles} CYCLE")  # fmt: skip
        return float(np.median(controller.reals("CALC1:DATA?")))

    # One cycle scatters by noise sqrt(30) in each of two components, over an amplitude near 0.18 V.
    gain = abs(known_answer(150.0))
    assert variance(1.0, 30, 1e-3) == pytest.approx(2 * 30e-6 / gain**2, rel=0.3)
    assert variance(2.0, 30, 1e-3) == pytest.approx(2 * 30e-6 / (2 * gain) ** 2, rel=0.3)
    assert variance(1.0, 30, 2e-3) == pytest.approx(8 * 30e-6 / gain**2, rel=0.3)
    assert variance(1.0, 1, 1e-3) == 0


def test_seed_reproduces_readings_and_others_differ(bench):
    def read(seed: int, again: bool = False) -> np.ndarray:
        controller = bench(seed=seed)
        controller.sweep()
        if again:
            controller.write("ABOR;:INIT")
            controller.run()
        return points(controller)

    assert read(1).tolist() == read(1).tolist()
    assert read(1).tolist() != read(2).tolist()
    assert read(1).tolist() != read(1, again=True).tolist()


# The device behind


def test_channel_1_sees_source_channel_2_response(bench):
    controller = bench(**NOISELESS, source_ohm=50.0, device_ohm=950.0)
    controller.sweep("CALC1:FEED 'XFR:POW:LIN 1'", "CALC2:FEED 'XFR:POW:LIN 2'", "CALC1:FORM MLIN",
                     "CALC2:FORM MLIN", "SOUR:VOLT 2 VPK")  # fmt: skip
    source, response = controller.reals("CALC1:DATA?"), controller.reals("CALC2:DATA?")
    assert source == pytest.approx(np.full(401, 0.95 * 2 / math.sqrt(2)))
    assert response[0] == pytest.approx(0.95 * 2 / math.sqrt(2) * abs(known_answer(100)))


def test_ac_coupling_turns_low_frequencies(bench):
    controller = bench(plant=LinearPlant(lambda hz: 1.0), **NOISELESS)
    controller.sweep("FREQ:STAR 0.5;STOP 100", "SWE:MODE MAN", "FREQ:MAN 0.5", "INP2:COUP AC")
    gains = controller.complexes("TRAC D1,TRAC1;:TRAC? D1")
    assert gains[0] == pytest.approx(0.5 + 0.5j, rel=1e-6)


def test_the_offset_takes_up_range(bench):
    controller = bench(plant=LinearPlant(lambda hz: 1.0), **NOISELESS)
    controller.sweep("SWE:MODE MAN", "FREQ:MAN 150", "SOUR:VOLT 1 VPK", "SOUR:VOLT:OFFS 3")
    assert controller.number("VOLT2:RANG?") >= 7
    controller.sweep("SWE:MODE MAN", "FREQ:MAN 150", "SOUR:VOLT 1 VPK", "SOUR:VOLT:OFFS 3",
                     "INP2:COUP AC")  # fmt: skip
    assert controller.number("VOLT2:RANG?") <= -1


def test_unstable_device_is_reported_not_served(bench):
    from daq.errors import AnalysisError

    class Wild:
        def dwell(self, *call):
            raise AnalysisError("the motion grew without bound")

    controller = bench(plant=Wild())
    controller.sweep()
    assert -240 in controller.errors()
    assert controller.integer("STAT:OPER:COND?") == 0
