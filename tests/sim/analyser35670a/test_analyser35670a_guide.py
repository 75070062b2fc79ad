"""What clients of others ran into: units between quotes, averages, spectra, markers, maths."""

from __future__ import annotations

import numpy as np
import pytest

BUSY = 16 | 256
FFT = ("INIT:CONT OFF", "FORM REAL,64", "CALC1:FEED 'XFR:POW 2'", "CALC1:FORM REAL")


@pytest.fixture
def fft(bench):
    """FFT mode, stopped, the power spectrum of channel 2 in trace A."""
    controller = bench()
    controller.write(*FFT)
    controller.run()
    return controller


def measured(controller):
    controller.write("ABOR;:INIT")
    controller.run()
    return controller


# Units


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("CALC1:UNIT:VOLT", ("V", "V2", "V/RTHZ", "V2/HZ", "V2S/HZ")),
        ("CALC1:UNIT:X", ("HZ", "CPM", "ORD", "USER")),
        ("CALC1:UNIT:DBR", ("DBV", "DBM", "DBSPL", "DBUSER")),
        ("CALC1:UNIT:MECH", ("G", "M/S2", "MILS")),
    ],
)
def test_units_are_quoted_both_ways(fft, header, words):
    for word in words:
        for sent in (f"'{word}'", f'"{word}"', f"'{word.lower()}'"):
            fft.write(f"{header} {sent}")
            assert fft.ask(f"{header}?") == f'"{word}"'
    assert fft.errors() == []
    fft.write(f"{header} {words[0]}")
    assert fft.errors() == [-151]
    fft.write(f"{header} 'FURLONG'")
    assert fft.errors() == [-151]


def test_data_without_unit_answer_null_string(fft):
    assert fft.ask("CALC1:UNIT:VOLT?") == '"V2"'
    assert fft.ask("CALC1:UNIT:AMPL?") == "RMS"
    fft.write("CALC1:FEED 'XFR:POW:RAT 2,1'")
    fft.run()
    for header, value in (("CALC1:UNIT:VOLT", "'V'"), ("CALC1:UNIT:AMPL", "PEAK")):
        assert fft.ask(f"{header}?") == '""'
        fft.write(f"{header} {value}")
        assert fft.errors() == [-221]


@pytest.mark.parametrize("quoted", [False, True])
@pytest.mark.parametrize("word", ["UNIT", "unit", "'UNIT'"])
def test_unit_of_value_is_reported_uniformly(bench, quoted, word):
    controller = bench(unit_quoted=quoted)
    for header, unit in (("SOUR:VOLT", "VPK"), ("VOLT2:RANG", "DBVRMS"), ("FREQ:STAR", "HZ")):
        assert controller.ask(f"{header}? {word}") == (f'"{unit}"' if quoted else unit)
    assert controller.ask(f"FREQ:RES? {word}") == '""'


def test_spectrum_is_equal_in_every_unit(fft):
    fft.write("WIND UNIF", "FREQ:STOP 25600 HZ")
    measured(fft)
    power = fft.reals("CALC1:DATA?")
    width_hz = 25600.0 / 400
    for unit, wanted in {
        "V": np.sqrt(power), "V2/HZ": power / width_hz, "V/RTHZ": np.sqrt(power / width_hz),
        "V2S/HZ": power / width_hz**2, "V2": power,
    }.items():  # fmt: skip
        fft.write(f"CALC1:UNIT:VOLT '{unit}'")
        fft.run()
        assert fft.reals("CALC1:DATA?") == pytest.approx(wanted, rel=1e-9)
    fft.write("CALC1:UNIT:AMPL PEAK")
    fft.run()
    assert fft.reals("CALC1:DATA?") == pytest.approx(2 * power, rel=1e-9)


# Averages


def busy(controller):
    return controller.integer("STAT:OPER:COND?") & BUSY


@pytest.mark.parametrize("continuous", ["ON", "OFF"])
def test_frozen_averages_end(fft, continuous):
    fft.write("AVER ON;:AVER:TYPE RMS;TCON FRE;COUN 7", "*CLS", "*ESE 1")
    fft.write("ABOR;:INIT:IMM;*OPC" if continuous == "OFF" else "ABOR;:INIT:CONT ON;*OPC")
    assert busy(fft) == BUSY
    fft.run()
    assert busy(fft) == 0
    assert fft.integer("*ESR?") & 1
    first = fft.reals("CALC1:DATA?")
    assert (fft.reals("CALC1:DATA?") == first).all()


def test_repeating_averages_do_not_end(fft):
    fft.write("AVER ON;:AVER:TYPE RMS;TCON REP;COUN 2", "ABOR;:INIT:CONT ON")
    fft.run()
    assert busy(fft) == BUSY
    first = fft.reals("CALC1:DATA?")
    assert (fft.reals("CALC1:DATA?") != first).any()


def test_more_averages_are_quieter(fft):
    spread = []
    for count in (1, 100):
        fft.write(f"AVER ON;:AVER:COUN {count}")
        power = measured(fft).reals("CALC1:DATA?")
        spread.append(power.std() / power.mean())
    # A power of one record scatters as much as it is large, of a hundred a tenth of it.
    assert 0.7 < spread[0] < 1.4
    assert 0.07 < spread[1] < 0.14


def test_averages_raised_afterwards_are_added(fft):
    fft.write("AVER ON;:AVER:TCON FRE;COUN 40")
    few = measured(fft).reals("CALC1:DATA?")
    fft.write("AVER:COUN 400")
    assert busy(fft) == 0
    fft.write("INIT:CONT ON")
    assert fft.errors() == []
    fft.run()
    many = fft.reals("CALC1:DATA?")
    assert busy(fft) == 0
    assert many.std() < 0.5 * few.std()
    # The first forty are part of them: their share of the scatter is a third.
    assert 0.15 < np.corrcoef(few, many)[0, 1] < 0.5
    fft.write("AVER:COUN 3", "INIT:CONT OFF", "INIT:CONT ON")
    assert fft.errors() == [-200]


def test_coherence_follows_from_averages(fft):
    fft.write("CALC1:FEED 'XFR:POW:COH 1,2'", "AVER ON;:AVER:COUN 50")
    coherence = measured(fft).reals("CALC1:DATA?")
    # Two noises that know nothing of each other: one in fifty.
    assert 0.01 < coherence.mean() < 0.04
    fft.write("AVER:COUN 1")
    assert measured(fft).reals("CALC1:DATA?") == pytest.approx(1.0)


# Lines


@pytest.mark.parametrize(
    ("asked", "lines", "read"),
    [(100, 100, 129), (400, 400, 513), (800, 800, 1025), (801, 1600, 2049)],
)
def test_axis_extends_beyond_displayed_lines(fft, asked, lines, read):
    fft.write(f"FREQ:RES {asked}")
    measured(fft)
    assert float(fft.ask("FREQ:RES?")) == lines
    assert fft.integer("CALC1:DATA:HEAD:POIN?") == lines + 1
    axis = fft.reals("CALC1:X:DATA?")
    assert len(axis) == read
    assert axis[lines] == pytest.approx(float(fft.ask("FREQ:STOP?")))


def test_axis_length_can_match_data(bench):
    controller = bench(long_fft_axis=False)
    controller.write(*FFT)
    measured(controller)
    assert len(controller.reals("CALC1:X:DATA?")) == len(controller.reals("CALC1:DATA?"))


# Markers and maths


def test_uncalculated_marker_function_says_so(fft):
    assert float(fft.ask("CALC1:MARK:FUNC:RES?")) == 9.91e37
    fft.write("CALC1:MARK:FUNC WEIG")
    assert float(fft.ask("CALC1:MARK:FUNC:RES?")) == 0.0
    fft.write("INST:SEL SINE", "CALC1:MARK:FUNC FREQ")
    assert float(fft.ask("CALC1:MARK:FUNC:RES?")) == 9.91e37
    assert fft.errors() == []


@pytest.mark.parametrize(
    ("sent", "kept"),
    [("(PSD(PSPEC1))", "(PSD(PSPEC1))"), ("(K1*FRES)", "(K1*FRES)"), ("(time1-time2)",
     "(TIME1-TIME2)"), ("(D1/(F2+K3))", "(D1/(F2+K3))")],
)  # fmt: skip
def test_maths_is_sent_between_parentheses(fft, sent, kept):
    fft.write(f"Calculate:Math:Expr2 {sent}", "CALC1:MATH:SEL F2;STAT ON")
    assert fft.ask("CALC:MATH:EXPR2?") == f'"{kept}"'
    assert fft.errors() == []


@pytest.mark.parametrize("sent", ["'K1*FRES'", "K1", "(K1*FRES", "(K9)", "(PSD[PSPEC1])"])
def test_invalid_maths_is_refused(fft, sent):
    fft.write(f"CALC:MATH:EXPR1 {sent}")
    assert fft.errors() == [-120]
    assert fft.ask("CALC:MATH:EXPR1?") == '""'
