"""The simulated SR785 as any controller meets it: its sweep, source, traces and readings.

Expected values are those of the manual, as docs/sr785.md has them; none of this knows the driver.
"""

import math
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from instruments.fake_analyser import known_gain
from instruments.simulated_sr785 import IFC, Bench

from sim.instrument.bus import TalkState
from sim.sr785.model import MODEL

FILLER = -3.4028235e38


# ------------------------------------------------------------ sweep and source


def test_sweep_measures_the_plant():
    bench = Bench()
    bench.swept(points=21, VIEW="0,3")
    bench.send("VIEW 1,4")
    frequencies = [float(bench.ask(f"DBIN? 0,{row}")) for row in range(21)]
    assert frequencies == pytest.approx(np.linspace(100, 200, 21))
    real, imaginary = bench.trace(0), bench.trace(1)
    assert bench.ask("DSPN? 0") == "22"
    assert len(real) == 22
    assert real[-1] == pytest.approx(FILLER)
    for hz, one, other in zip(frequencies, real, imaginary, strict=False):
        assert complex(one, other) == pytest.approx(known_gain(hz), rel=1e-5)


def test_bins_ascend_in_either_sweep_direction():
    bench = Bench()
    bench.swept(SSTR="2,200", SSTP="2,100")
    assert float(bench.ask("DBIN? 0,0")) == 100.0
    down = bench.trace()
    bench.swept()
    assert bench.trace() == pytest.approx(down, rel=1e-5)


@pytest.mark.parametrize(
    ("view", "shown"),
    [
        (0, lambda z: abs(z)), (1, lambda z: abs(z)), (2, lambda z: abs(z) ** 2),
        (3, lambda z: z.real), (4, lambda z: z.imag),
        (5, lambda z: math.degrees(math.atan2(z.imag, z.real))),
    ],
)  # fmt: skip
def test_views_are_those_of_the_manual(view, shown):
    bench = Bench()
    bench.swept(VIEW=f"2,{view}")
    for row, hz in enumerate(np.linspace(100, 200, 12)):
        assert float(bench.ask(f"DSPY? 0,{row}")) == pytest.approx(shown(known_gain(hz)), rel=1e-5)


def test_decibels_and_radians_are_given_on_request():
    bench = Bench()
    bench.swept(VIEW="2,0", UNDB="2,1")
    assert float(bench.ask("DSPY? 0,0")) == pytest.approx(20 * math.log10(abs(known_gain(100))))
    bench.send("UNPH 2,1")
    bench.send("VIEW 0,5")
    z = known_gain(100)
    assert float(bench.ask("DSPY? 0,0")) == pytest.approx(math.atan2(z.imag, z.real), rel=1e-5)


def test_nyquist_pairs_differ_in_binary_and_text():
    """Binary pairs give y first, text pairs x first."""
    bench = Bench()
    bench.swept(VIEW="2,7")
    z = known_gain(100)
    assert [float(word) for word in bench.ask("DSPY? 0,0").split(",")] == pytest.approx(
        [z.real, z.imag], rel=1e-5
    )
    bench.send("DSPB? 0,0")
    assert struct.unpack("<2f", bench.take()) == pytest.approx((z.imag, z.real), rel=1e-5)
    bench.send("DSPB? 0")
    assert len(bench.take()) == 8 * 13


def test_binary_equals_text_without_header_or_end():
    bench = Bench()
    bench.swept()
    text = bench.trace()
    bench.send("DSPB? 0")
    data = bench.take()
    assert len(data) == 4 * 13
    assert struct.unpack("<13f", data) == pytest.approx(text, rel=1e-6)


def test_transfer_occupies_bus_and_times_out():
    """It is given up after a second."""
    bench = Bench()
    bench.swept()
    bench.send("DSPB? 0")
    assert not bench.box.serial_poll() & IFC
    assert len(bench.box.talk(8).data) == 8
    bench.wall_s += 0.9
    assert len(bench.box.talk(8).data) == 8
    bench.wall_s += 1.1
    assert bench.box.serial_poll() & IFC
    assert bench.box.talk().state is TalkState.NOTHING
    assert bench.ask("ERRS? 0") == "1"


def test_binary_does_not_go_to_rs232(bench):
    bench.swept()
    bench.send("OUTX 1")
    bench.send("DSPB? 0")
    assert bench.box.serial_out() == b""
    bench.send("OUTX 0")
    assert bench.events() == 16


@pytest.mark.parametrize(
    ("settle", "integrate", "hz", "seconds"),
    [((1, 0.0078125), (1, 0.015625), 100.0, 0.01 + 0.02),
     ((1, 0.0078125), (1, 0.015625), 1000.0, 0.008 + 0.016),
     ((30, 0.0078125), (60, 0.015625), 100.0, 0.9),
     ((1, 0.5), (1, 1.0), 100.0, 1.5),
     ((1, 0.0078125), (1, 0.0234375), 100.0, 0.01 + 0.03)],
)  # fmt: skip
def test_point_takes_longer_of_cycles_or_time(settle, integrate, hz, seconds):
    """Rounded up to whole cycles."""
    bench = Bench(point_overhead_s=0.0, command_s=1e-6)
    bench.swept(
        points=10, SSTR=f"2,{hz}", SSTP=f"2,{hz * 1.0001}", SSCY=f"2,{settle[0]}",
        SSTM=f"2,{settle[1]}", SICY=f"2,{integrate[0]}", SITM=f"2,{integrate[1]}",
        A1RG="0", A2RG="0",
    )  # fmt: skip
    bench.send("STRT")
    begun_s = bench.box.agenda.now_s
    while bench.box.sweep.running:
        bench.rest(0.001)
    assert bench.box.agenda.now_s - begun_s == pytest.approx(10 * seconds, rel=0.02, abs=0.03)


def test_source_drives_only_during_sweep():
    bench = Bench()
    assert bench.box.driven_v == 0.0
    bench.swept(points=40)
    assert bench.box.driven_v == 0.0
    bench.send("STRT")
    assert bench.box.driven_v == 1.0
    bench.send("PAUS")
    assert bench.box.driven_v == 0.0
    assert int(bench.ask("INST?")) & 32
    begun = bench.box.points_begun
    bench.rest(5.0)
    assert bench.box.points_begun <= begun + 1
    bench.send("CONT")
    assert bench.box.driven_v == 1.0
    bench.send("SRCO 0")
    assert bench.box.driven_v == 0.0


def test_entering_fft_drives_if_switch_is_on():
    bench = Bench()
    bench.swept(S1AM="2 V")
    assert bench.box.driven_v == 0.0
    bench.send("MGRP 2,0")
    assert bench.box.driven_v == 2.0
    bench.send("SRCO 0")
    assert bench.box.driven_v == 0.0


def test_ramp_has_its_duration():
    bench = Bench()
    bench.swept(points=40, SRMP="1", SRAT="0.5")
    bench.send("STRT")
    bench.rest(1.0)
    assert 0.4 < bench.box.driven_v < 0.6
    bench.rest(2.0)
    assert bench.box.driven_v == 1.0
    bench.send("PAUS")
    bench.rest(1.0)
    assert 0.4 < bench.box.driven_v < 0.6


def test_grid_change_discards_data_and_restarts():
    bench = Bench()
    bench.swept(points=40)
    bench.send("STRT")
    bench.rest(1.0)
    begun = bench.box.measurements_begun
    bench.send("SICY 2,3")
    assert bench.box.measurements_begun == begun
    bench.send("SNPS 2,20")
    assert bench.box.measurements_begun == begun + 1
    bench.rest(100.0)
    assert bench.ask("DSPN? 0") == "21"


def test_too_small_input_range_clips_and_reports():
    bench = Bench(gain=lambda hz: 0.5)
    bench.swept(A2RG="0", I2RG="-12 dBVpk")
    bits = int(bench.ask("INPS?"))
    assert bits >> 8 & 4
    assert not bits & 4
    assert 0.25 < bench.trace()[0] < 0.45


def test_autorange_only_rises_unless_tracking():
    for tracking, step in (("0", 0), ("1", -20)):
        bench = Bench(gain=lambda hz: 0.1)
        bench.swept(A2RG="1", I2RG="0 dBVpk", I2AR=tracking)
        assert bench.ask("I2RG?") == f"{step},0"


def test_automatic_resolution_skips_points_silently():
    bench = Bench()
    bench.swept(points=60, SARS="2,1", SFST="2,3", SSKP="2,10")
    taken = len(bench.box.sweep.bins)
    assert taken < 40
    assert all(value > FILLER * 0.99 for value in bench.trace()[:-1])


def test_automatic_level_respects_maximum():
    bench = Bench(gain=lambda hz: 0.25)
    bench.swept(SSAL="2", SSRF="500 mV", SMAX="5 V", MEAS="2,43", VIEW="2,1", UNPK="2,1")
    assert bench.trace()[0] == pytest.approx(0.5, rel=0.15)
    bench.send("SSAL 0")
    bench.swept(SSAL="2", SMAX="1 V", MEAS="2,43", VIEW="2,1", UNPK="2,1")
    assert bench.trace()[0] == pytest.approx(0.25, rel=0.01)


def test_psd_units_set_in_fft_distort_sweep():
    bench = Bench()
    bench.send("PSDU 0,1")
    bench.swept()
    assert bench.trace()[0] != pytest.approx(known_gain(100).real, rel=0.1)
    bench.send("*RST")
    bench.rest(13.0)
    assert bench.ask("PSDU? 0") == "1"


def test_normalised_variance_is_that_of_cycle():
    bench = Bench(noise_v=1e-3, seed=4)
    bench.swept(points=40, MEAS="2,45", VIEW="2,1", SICY="2,100")
    relative = 1e-3 * math.sqrt(30) / np.abs([known_gain(hz) for hz in np.linspace(100, 200, 40)])
    assert np.median(bench.trace()[:-1] / (2 * relative**2)) == pytest.approx(1.0, rel=0.15)


def test_unit_has_characters_of_old_code_page():
    bench = Bench()
    bench.swept(MEAS="2,42", VIEW="2,2", PSDU="2,1")
    bench.send("UNIT? 0")
    assert bench.take() == b"Vpk\xfd/\xfbHz\n"


def test_an_sr780_has_other_numbers():
    bench = Bench(model="SR780")
    assert "SR780" in bench.ask("*IDN?")
    bench.send("MGRP 2,3")
    assert bench.events() & 16
    bench.send("MGRP 2,2")
    bench.send("MEAS 2,32")
    assert bench.events() == 0


# ------------------------------------------------------------ anything at all


@settings(max_examples=40)
@given(st.binary(max_size=300) | st.text("SRCOMGP?2,;0 \n*ESVY", max_size=80).map(str.encode))
def test_device_recovers_from_any_input(data):
    bench = Bench()
    bench.box.listen(data, end=True)
    bench.rest(30.0)
    bench.take()
    bench.box.device_clear()
    bench.send("OUTX 0;*CLS")
    assert bench.events() == 0
    assert bench.ask("*IDN?").startswith("Stanford")


@pytest.mark.parametrize("fault", sorted(MODEL.faults))
def test_every_fault_has_effect(fault):
    bench = Bench([f"{fault}:point=0"])
    try:
        bench.swept(points=10)
        bench.send("DSPB? 0")
        bench.take()
    except (AssertionError, ValueError):
        pass  # that is what a fault does to a controller
    for link in ("dropped-connection", "adapter-reset"):
        bench.box.damage.link_fault(link)
    assert bench.box.faults.faults[0].struck > 0
