"""Section "data": displayed points, coordinates, blocks, registers, reads in mid-sweep."""

from __future__ import annotations

import math

import numpy as np
import pytest

NOISELESS = {"noise_v": 0.0, "converter_noise": 0.0}
LOG_OF_ZERO = -3.40282346639e38


def known_answer(hz: float) -> complex:
    return 0.1 * (1.0 + 1j * hz / 100.0)


@pytest.fixture
def quiet(bench):
    """Five points of the known device without noise."""
    controller = bench(**NOISELESS)
    controller.sweep()
    return controller


@pytest.mark.parametrize(("resolution", "shown"), [(3, 401), (401, 401), (402, 801), (801, 801)])
def test_displayed_points(quiet, resolution, shown):
    quiet.write(f"FREQ:RES {resolution} PNT/SWP", "ABOR;:INIT")
    quiet.run()
    for form in ("MLOG", "NYQ", "POL"):
        quiet.write(f"CALC:FORM {form}")
        quiet.run()
        assert quiet.integer("CALC:DATA:HEAD:POIN?") == shown
        numbers = 2 * shown if form in ("NYQ", "POL") else shown
        assert len(quiet.reals("CALC:DATA?")) == numbers
    assert len(quiet.reals("CALC:X:DATA?")) == shown


def test_axis_is_ramp_from_start_towards_stop(quiet):
    for query in ("CALC:X:DATA?", "TRAC:X? TRAC1"):
        axis = quiet.reals(query)
        assert axis == pytest.approx(100 + 100 * np.arange(401) / 401)
    assert quiet.ask("TRAC:X:UNIT? TRAC1") == '"HZ"'


def test_measured_points_are_displayed_where_measured(quiet):
    quiet.write("FREQ:RES 401 PNT/SWP", "ABOR;:INIT")
    quiet.run()
    gains, axis = quiet.complexes("TRAC D1,TRAC1;:TRAC? D1"), quiet.reals("TRAC:X? D1")
    assert gains == pytest.approx([known_answer(hz) for hz in axis])


@pytest.mark.parametrize(("hold", "filled"), [(True, 401), (False, 5)])
def test_fill_between_points_is_a_choice(bench, hold, filled):
    controller = bench(hold_between=hold, **NOISELESS)
    controller.sweep()
    gains = controller.complexes("TRAC D1,TRAC1;:TRAC? D1")
    assert np.count_nonzero(gains) == filled
    assert len(set(gains[gains != 0])) == 5


@pytest.mark.parametrize(
    ("form", "expected"),
    [
        ("MLIN", lambda g: abs(g)),
        ("MLOG", lambda g: 20 * np.log10(abs(g))),
        ("PHAS", lambda g: np.degrees(np.angle(g))),
        ("UPH", lambda g: np.degrees(np.angle(g))),
        ("REAL", lambda g: g.real),
        ("IMAG", lambda g: g.imag),
        ("NYQ", lambda g: np.column_stack((g.real, g.imag)).ravel()),
        ("POL", lambda g: np.column_stack((abs(g), np.degrees(np.angle(g)))).ravel()),
    ],
)
def test_only_shown_data_follow_coordinates(quiet, form, expected):
    quiet.write(f"CALC:FORM {form}")
    quiet.run()
    gains = quiet.complexes("TRAC D1,TRAC1;:TRAC? D1")
    assert quiet.reals("CALC:DATA?") == pytest.approx(expected(gains))
    assert gains[0] == pytest.approx(known_answer(100))


def test_group_delay_of_a_pure_delay(bench):
    from sim.analyser35670a import LinearPlant

    delay = 1e-3
    plant = LinearPlant(lambda hz: np.exp(-2j * math.pi * hz * delay))
    controller = bench(plant=plant, **NOISELESS)
    controller.sweep("FREQ:RES 401 PNT/SWP", "CALC:FORM GDEL")
    assert controller.reals("CALC:DATA?") == pytest.approx(np.full(401, delay))
    assert controller.ask("DISP:TRAC:Y:BOTT? UNIT") == "S"


def test_angles_in_radians(quiet):
    quiet.write("CALC:FORM PHAS;UNIT:ANGL RAD")
    quiet.run()
    assert quiet.reals("CALC:DATA?")[0] == pytest.approx(math.pi / 4)
    assert quiet.ask("DISP:TRAC:Y:BOTT? UNIT") == "RAD"


@pytest.mark.parametrize(
    ("feed", "form", "unit"),
    [("XFR:POW:RAT 2,1", "MLOG", "DB"), ("XFR:POW:RAT 2,1", "REAL", '""'),
     ("XFR:POW:LIN 1", "MLOG", "DBVRMS"), ("XFR:POW:LIN 1", "MLIN", "VRMS"),
     ("XFR:POW:CROS 1,2", "MLIN", "VRMS2"), ("XFR:POW:RAT 2,1", "PHAS", "DEG"),
     ("XFR:POW:VAR 2", "MLIN", '""')],
)  # fmt: skip
def test_units_of_data(quiet, feed, form, unit):
    quiet.write(f"CALC:FEED '{feed}';FORM {form}")
    quiet.run()
    assert quiet.ask("DISP:TRAC:Y:BOTT? UNIT") == unit


def test_the_measured_data_of_a_sweep(quiet):
    quiet.write("CALC1:FEED 'XFR:POW:LIN 1'", "CALC2:FEED 'XFR:POW:LIN 2'",
                "CALC3:FEED 'XFR:POW:CROS 1,2'", "CALC4:FEED 'XFR:POW:RAT 2,1'")  # fmt: skip
    quiet.run()
    one, two, cross, ratio = (
        quiet.complexes(f"TRAC D{n},TRAC{n};:TRAC? D{n}") for n in (1, 2, 3, 4)
    )
    assert two / one == pytest.approx(ratio)
    assert cross == pytest.approx(np.conj(one) * two)
    quiet.write("CALC1:UNIT:AMPL PEAK;:CALC1:FORM MLIN")
    quiet.run()
    assert quiet.reals("CALC1:DATA?") == pytest.approx(np.abs(one) * math.sqrt(2))


def test_the_time_trace_shows_a_period(quiet):
    quiet.write("CALC:FEED 'XTIM:VOLT 1';FORM REAL")
    quiet.run()
    signal, time = quiet.reals("CALC:DATA?"), quiet.reals("CALC:X:DATA?")
    assert signal.max() == pytest.approx(1.0, rel=1e-3)
    assert signal == pytest.approx(np.sin(2 * math.pi * 180 * time), abs=1e-4)
    assert quiet.ask("TRAC:X:UNIT? TRAC1") == '"S"'


# Reads in mid-sweep


def test_mid_sweep_reads_hold_filler(swept):
    swept.write("FREQ:RES 401 PNT/SWP", "ABOR;:INIT")
    while swept.instrument.measurement.points_begun < 100:
        swept.instrument.agenda.run_next()
    gains = swept.complexes("TRAC D1,TRAC1;:TRAC? D1")
    decibels = swept.reals("CALC1:DATA?")
    measured = gains != 0
    assert measured[:99].all()
    assert not measured[100:].any()
    assert decibels[~measured] == pytest.approx(np.full((~measured).sum(), LOG_OF_ZERO))
    assert np.all(decibels[measured] > -100)
    assert len(swept.reals("CALC1:X:DATA?")) == 401
    swept.write("FORM ASC,12")
    assert (swept.ask("CALC1:DATA?") or "").split(",")[-1] == "-3.40282346639E+038"


def test_downward_sweeps_fill_from_the_top(swept):
    swept.write("FREQ:RES 401 PNT/SWP", "SWE:DIR DOWN", "ABOR;:INIT")
    while swept.instrument.measurement.points_begun < 100:
        swept.instrument.agenda.run_next()
    measured = swept.complexes("TRAC D1,TRAC1;:TRAC? D1") != 0
    assert measured[-98:].all()
    assert not measured[:300].any()


def test_fast_display_delays_points_until_end(swept):
    swept.write("AVER:IRES ON", "SOUR:VOLT 1 VPK", "ABOR;:INIT")
    swept.wait(4.0)
    assert swept.instrument.measurement.points_begun > 1
    assert not swept.complexes("TRAC D1,TRAC1;:TRAC? D1").any()
    swept.run()
    first = swept.complexes("TRAC D1,TRAC1;:TRAC? D1")
    swept.write("ABOR;:INIT")
    swept.wait(2.0)
    assert swept.complexes("TRAC D1,TRAC1;:TRAC? D1").tolist() == first.tolist()
    swept.run()
    assert swept.complexes("TRAC D1,TRAC1;:TRAC? D1").tolist() != first.tolist()


def test_a_register_is_one_frozen_picture(swept):
    swept.write("FREQ:RES 401 PNT/SWP", "ABOR;:INIT")
    swept.wait(5.0)
    swept.write("TRAC D3,TRAC1")
    then = swept.complexes("TRAC? D3")
    swept.run()
    assert swept.complexes("TRAC? D3").tolist() == then.tolist()
    assert swept.complexes("TRAC D4,TRAC1;:TRAC? D4").tolist() != then.tolist()
    assert len(swept.reals("TRAC:X? D3")) == len(then)


def test_change_of_data_or_coordinates_takes_time(quiet):
    quiet.write("CALC:FORM REAL")
    quiet.run()
    real = quiet.reals("CALC:DATA?")
    quiet.write("CALC:FORM IMAG")
    assert quiet.ask("CALC:FORM?") == "IMAG"
    assert quiet.reals("CALC:DATA?").tolist() == real.tolist()
    quiet.write("*WAI")
    quiet.run()
    assert quiet.reals("CALC:DATA?").tolist() != real.tolist()
    quiet.write("*CLS", "CALC:FEED 'XFR:POW:VAR 1';*OPC")
    assert quiet.integer("*ESR?") == 0
    quiet.run()
    assert quiet.integer("*ESR?") == 1


# Blocks and registers


def test_blocks_are_definite_and_big_endian(quiet):
    quiet.write("TRAC:X? TRAC1")
    block = quiet.read() or b""
    assert block[:6] == b"#43208"
    assert block[6:14] == bytes.fromhex("4059000000000000")
    assert block.endswith(b"\n")
    assert len(block) == 6 + 3208 + 1
    quiet.write("FORM REAL,32")
    axis = quiet.reals("TRAC:X? TRAC1", ">f4")
    assert len(axis) == 401
    assert axis[0] == 100


def test_blocks_may_hold_any_byte(bench):
    values = np.arange(802) / 802.0 + 1e-3
    values[:5] = np.frombuffer(
        bytes.fromhex(
            "3F0A0D1B2B000000 3F000A0D1B2B0A0D 3F1B1B2B2B0A0A00 3F2B2B2B2B2B2B2B 3F0A0A0A0A0A0A0A"
        ),
        dtype=">f8",
    )  # fmt: skip
    controller = bench(**NOISELESS)
    controller.sweep("FREQ:RES 401 PNT/SWP")
    controller.write("TRAC D1,TRAC1")
    payload = values.astype(">f8").tobytes()
    controller.write(b"TRAC D1,#46416" + payload + b"\n")
    assert controller.errors() == []
    assert controller.reals("TRAC? D1").astype(">f8").tobytes() == payload


def test_registers_refuse_unsuitable_data(quiet):
    quiet.write("TRAC D1,TRAC1", "TRAC D2,D1")
    quiet.run()
    assert quiet.refusal("TRAC D1,1,2,3") == [-161]
    assert quiet.refusal("TRAC D9,TRAC1") == [-141]
    assert quiet.refusal("TRAC D3,D8") == [-230]
    assert quiet.refusal("TRAC? W1") == [-230]
    assert quiet.refusal("TRAC? TRAC1") == [-141]
    assert quiet.complexes("TRAC? D2").tolist() == quiet.complexes("TRAC? D1").tolist()
    quiet.write("CALC2:FEED 'D2'")
    quiet.run()
    assert len(quiet.reals("CALC2:DATA?")) == 401


def test_ascii_and_binary_transfers_agree(quiet):
    binary = quiet.reals("CALC:DATA?")
    quiet.write("FORM ASC,12")
    text = np.array([float(part) for part in (quiet.ask("CALC:DATA?") or "").split(",")])
    assert text == pytest.approx(binary, rel=1e-11)


def test_the_variance_trace_is_real(quiet):
    quiet.write("CALC:FEED 'XFR:POW:VAR 2';FORM REAL")
    quiet.run()
    assert len(quiet.reals("TRAC D1,TRAC1;:TRAC? D1")) == 401
    assert quiet.reals("CALC:DATA?") == pytest.approx(np.zeros(401), abs=1e-20)


def test_markers(quiet):
    quiet.write("FREQ:RES 401 PNT/SWP", "ABOR;:INIT", "CALC:FORM MLIN")
    quiet.run()
    quiet.write("CALC:MARK:X 150 HZ")
    assert quiet.number("CALC:MARK:Y?") == pytest.approx(abs(known_answer(150)), rel=0.01)
    quiet.write("CALC:MARK:MAX")
    assert quiet.number("CALC:MARK:X?") == pytest.approx(100 + 100 * 400 / 401)
    assert quiet.integer("CALC:MARK:POS:POIN?") == 400


def test_spectrum_shows_the_driving_sine(bench):
    controller = bench()
    controller.write("FORM REAL,64", "SOUR:FREQ 10240 HZ", "SOUR:VOLT 2 VPK", "OUTP ON",
                     "CALC1:FEED 'XFR:POW 1'", "CALC2:FEED 'XFR:POW:RAT 2,1'", "CALC2:FORM REAL",
                     "ABOR;:INIT")  # fmt: skip
    controller.run()
    decibels, axis = controller.reals("CALC1:DATA?"), controller.reals("CALC1:X:DATA?")
    assert len(decibels) == 401
    axis = axis[:401]
    assert axis[decibels.argmax()] == 10240
    assert decibels.max() == pytest.approx(20 * math.log10(math.sqrt(2)), abs=0.01)
    assert controller.reals("CALC2:DATA?")[decibels.argmax()] == pytest.approx(0.1, rel=0.1)
    assert np.median(decibels) < -80
