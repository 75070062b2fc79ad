"""Sections "identity and modes" and "settings coerced to the grid"."""

from __future__ import annotations

import math

import pytest

GRID = 1 / 64


def test_identity_and_options(controller, bench):
    assert controller.ask("*IDN?") == "HEWLETT-PACKARD,35670A,LASHSIM001,A.01.11"
    assert controller.ask("*OPT?") == '"1D2"'
    assert controller.ask("SYST:VERS?") == "1992.0"
    assert bench(options="1D2,AY6,UFC").ask("*OPT?") == '"1D2,AY6,UFC"'
    assert bench(options="").ask("*OPT?") == '""'


def test_swept_sine_without_option_is_refused(bench):
    """The mode stays as it is."""
    controller = bench(options="1D3")
    controller.write("INST:SEL SINE")
    assert controller.ask("SYST:ERR?") == (
        '-200,"Execution error; OPTION 1D2, Swept Sine Measurements not installed."'
    )
    assert controller.refusal("INST:NSEL 3") == [-200]
    assert controller.ask("INST?") == "FFT"


def test_modes_by_name_and_by_number(bench):
    controller = bench(options="1D0,1D1,1D2")
    for number, name in enumerate(("FFT", "OCT", "ORD", "SINE", "HIST", "CORR")):
        controller.write(f"INST:NSEL {number}")
        assert controller.ask("INST:SEL?") == name
        controller.write(f"INST {name}")
        assert controller.integer("INST:NSEL?") == number


def test_each_mode_remembers_its_own_settings(controller):
    controller.write("SOUR:VOLT 0.5 VPK", "INST:SEL SINE", "SOUR:VOLT 2 VPK;:FREQ:STOP 500")
    controller.write("INST:SEL FFT")
    assert controller.number("SOUR:VOLT?") == 0.5
    assert controller.number("FREQ:STOP?") == 51200
    controller.write("INST:SEL SINE")
    assert controller.number("SOUR:VOLT?") == 2
    assert controller.number("FREQ:STOP?") == 500


@pytest.mark.parametrize(
    ("message", "number"),
    [
        ("*TRG", -221), ("TRIG:SOUR BUS", -221), ("TRIG:SOUR?", -221), ("ARM:SOUR MAN", -221),
        ("SOUR:FUNC RAND", -221), ("SOUR:FREQ 100", -221), ("AVER ON", -221),
        ("AVER:COUN 4", -221), ("AVER:TYPE RMS", -221), ("AVER:TCON EXP", -221),
        ("WIND HANN", -221), ("SWE:TIME 1", -221), ("SWE:OVER 5", -221), ("TCAP", -200),
        ("SENS:FEED TCAP", -221), ("FREQ:SPAN:FULL", -221), ("DISP:WAT ON", -221),
        ("CALC:FEED 'XFR:POW:COH 1,2'", -200), ("CALC:FEED 'XFR:POW 1'", -200),
        ("VOLT:RANG:AUTO:DIR UP", -200), ("OUTP OFF", -221), ("OUTP?", -221),
    ],
)  # fmt: skip
def test_swept_sine_refuses_fft_commands(swept, message, number):
    assert swept.refusal(message) == [number]


def test_the_texts_name_the_reason(swept):
    for message, text in (
        ("TRIG:SOUR BUS", "No TRIGGER With SWEPT SINE"),
        ("WIND HANN", "No WINDOW With SWEPT SINE"),
        ("CALC:FEED 'XFR:POW:COH 1,2'", "not available with Inst Mode SWEPT SINE"),
        ("TCAP", "Capture cannot be used with Inst Mode SWEPT SINE"),
    ):
        swept.write(message)
        assert text in (swept.ask("SYST:ERR?") or "")


def test_fft_refuses_swept_sine_commands(controller):
    for message, number in (
        ("CALC:FEED 'XFR:POW:VAR 1'", -200), ("SWE:MODE MAN", -221), ("FREQ:MAN 100", -221),
        ("SWE:STIM 5 CYCLE", -221), ("FREQ:RES:AUTO ON", -221), ("SOUR:VOLT:SLEW 1", -221),
    ):  # fmt: skip
        assert controller.refusal(message) == [number]


def test_output_in_swept_sine_is_a_choice(bench):
    controller = bench(output_in_sine=True)
    controller.write("INST:SEL SINE", "OUTP OFF")
    assert controller.integer("OUTP?") == 0
    assert controller.errors() == []


def test_feeds_require_their_channels(bench):
    controller = bench(options="1D2,AY6")
    assert controller.refusal("INST:SEL SINE;:CALC:FEED 'XFR:POW:RAT 3,1'") == [-200]
    assert controller.refusal("INP4 ON;:CALC:FEED 'XFR:POW:RAT 3,1'") == []
    assert controller.refusal("CALC:FEED 'XFR:POW:RAT 4,3'") == [-200]
    assert controller.refusal("REF PAIR;:CALC:FEED 'XFR:POW:RAT 4,3'") == []
    assert controller.refusal("INP2 OFF;:CALC:FEED 'XFR:POW:RAT 2,1'") == [-200]
    assert controller.number("FREQ:STOP?") == 25600


@pytest.mark.parametrize(
    ("reset", "expected"),
    [("*RST", ("+1", "+0", "+0", "CENT", -0.6)), ("SYST:PRES", ("+0", "+1", "+1", "STAR", -0.3))],
)
def test_the_two_resets_differ(controller, reset, expected):
    controller.write("INST:SEL SINE", "FREQ:STOP 500", "SOUR:VOLT 2 VPK", "VOLT2:RANG 7")
    controller.write(reset)
    controller.run()
    assert controller.ask("INST?") == "FFT"
    controller.write("INIT:CONT?")
    continuous = (controller.read() or b"").decode().strip()
    calibrates, link = controller.ask("CAL:AUTO?"), controller.ask("FREQ:SPAN:LINK?")
    aperture = math.log10(controller.number("CALC:GDAP:APER?"))
    controller.write("INIT:CONT OFF", "INST:SEL SINE")
    automatic = controller.ask("FREQ:RES:AUTO?")
    assert (automatic, calibrates, continuous, link, round(aperture, 1)) == expected
    assert controller.number("SOUR:VOLT?") == 0
    assert controller.number("FREQ:STOP?") == 51200
    assert controller.number("VOLT2:RANG?") == -51
    assert controller.ask("SOUR:VOLT? UNIT") == "VPK"


def test_reset_keeps_status_enables(controller):
    controller.write("*ESE 61;*SRE 32", "STAT:OPER:ENAB 16;NTR 16;PTR 0", "SYST:KLOC ON")
    for reset in ("*RST", "SYST:PRES"):
        controller.write(reset)
        controller.run()
        assert controller.ask("*ESE?;*SRE?") == "+61;+32"
        assert controller.ask("STAT:OPER:ENAB?;NTR?;PTR?") == "+16;+16;+0"
        assert controller.ask("SYST:KLOC?") == "+1"


def test_a_reset_cancels_the_wait(swept):
    swept.write("INIT;*OPC", "*RST")
    swept.run()
    assert swept.integer("*ESR?") & 1 == 0
    swept.write("*RST;*OPC")
    swept.run()
    assert swept.integer("*ESR?") & 1 == 1


# Grids


@pytest.mark.parametrize(
    ("key", "sent", "answer"),
    [
        ("STAR", 100.01, 100.0), ("STAR", 100.015625, 100.015625), ("STAR", 0.02, GRID),
        ("STOP", 500.001, 500.015625), ("STOP", 500.0, 500.0), ("SPAN", 50.001, 50.015625),
        ("CENT", 2000.015, 2000.0),
    ],
)  # fmt: skip
def test_frequencies_are_rounded_to_their_grid(swept, key, sent, answer):
    swept.write("FREQ:STAR 30;STOP 2030")
    swept.write(f"FREQ:{key} {sent}")
    assert swept.number(f"FREQ:{key}?") == answer


def test_start_stop_centre_and_span_stay_consistent(swept):
    def band():
        return [swept.number(f"FREQ:{key}?") for key in ("STAR", "STOP", "CENT", "SPAN")]

    swept.write("FREQ:SPAN:LINK STAR", "FREQ:STAR 100;STOP 300")
    assert band() == [100, 300, 200, 200]
    swept.write("FREQ:SPAN 100")
    assert band() == [100, 200, 150, 100]
    swept.write("FREQ:CENT 1000")
    assert band() == [950, 1050, 1000, 100]
    swept.write("FREQ:SPAN:LINK CENT", "FREQ:SPAN 300")
    assert band() == [850, 1150, 1000, 300]
    swept.write("FREQ:STOP 2000")
    assert band() == [850, 2000, 1425, 1150]
    assert swept.ask("FREQ:SPAN:LINK?") == "STAR"
    assert swept.refusal("FREQ:STAR 0.001") == [-222]
    assert swept.refusal("FREQ:STOP 51201") == [-222]
    assert band() == [850, 2000, 1425, 1150]


def test_decades_and_octaves_need_log_spacing(swept):
    assert swept.refusal("FREQ:SPAN 1 DEC") == [-131]
    swept.write("SWE:SPAC LOG", "FREQ:SPAN:LINK STAR", "FREQ:SPAN 1 DEC")
    assert swept.number("FREQ:STOP?") == 1000
    swept.write("FREQ:SPAN 1 OCT")
    assert swept.number("FREQ:STOP?") == 200


@pytest.mark.parametrize(
    ("sent", "dbvrms"),
    [("-50", -49), ("-51", -51), ("2", 3), ("5 VPK", 11), ("1 VRMS", 1), ("0.01 VPK", -43),
     ("31.7 VPK", 27), ("20 DBVPK", 17), ("3.99 MVPK", -51)],
)  # fmt: skip
def test_ranges_are_rounded_up_and_end_autorange(controller, sent, dbvrms):
    assert controller.integer("VOLT1:RANG:AUTO?") == 1
    controller.write(f"VOLT1:RANG {sent}")
    assert controller.errors() == []
    value, unit = controller.number("VOLT1:RANG?"), controller.ask("VOLT1:RANG? UNIT")
    vpk = math.sqrt(2) * 10 ** (dbvrms / 20)
    expected = {
        "DBVRMS": dbvrms, "VPK": vpk, "VRMS": vpk / math.sqrt(2), "DBVPK": 20 * math.log10(vpk),
    }  # fmt: skip
    assert value == pytest.approx(expected[unit or ""], rel=1e-10)
    assert controller.integer("VOLT1:RANG:AUTO?") == 0


def test_ranges_beyond_the_ends_are_refused(controller):
    for sent in ("28", "-52", "33 VPK", "0 VPK", "-1 VPK"):
        assert controller.refusal(f"VOLT1:RANG {sent}") == [-222]


@pytest.mark.parametrize(
    ("sent", "vpk"),
    [("2.5011 VPK", 2.5), ("2.5013 VPK", 2.5025), ("0.1 VPK", 0.1), ("0.10013 VPK", 0.10025),
     ("0.2514 VPK", 0.2515), ("0.2846 VPK", 0.285),
     ("1 VRMS", 1.415), ("13.979 DBVPK", 5.0), ("0 DBVPK", 1.0), ("5 VPK", 5.0)],
)  # fmt: skip
def test_levels_have_two_steps(controller, sent, vpk):
    controller.write(f"SOUR:VOLT {sent}")
    assert controller.errors() == []
    value, unit = controller.number("SOUR:VOLT?"), controller.ask("SOUR:VOLT? UNIT")
    scale = {"VPK": value, "VRMS": value * math.sqrt(2), "DBVPK": 10 ** (value / 20)}
    assert scale[unit or ""] == pytest.approx(vpk, rel=1e-10)


def test_levels_out_of_range(controller):
    controller.write("SOUR:VOLT 1 VPK")
    for sent in ("5.01 VPK", "-0.1 VPK", "14 DBVPK", "4 VRMS"):
        assert controller.refusal(f"SOUR:VOLT {sent}") == [-222]
    assert controller.number("SOUR:VOLT?") == 1


@pytest.mark.parametrize(
    ("sent", "volts"), [("1.2344", 1.234), ("-1.2346", -1.235), ("2.0024", 2.0), ("3.003", 3.005),
                        ("9.999", 10.0), ("1500 MV", 1.5)],
)  # fmt: skip
def test_offsets_have_two_steps(controller, sent, volts):
    controller.write(f"SOUR:VOLT:OFFS {sent}")
    assert controller.number("SOUR:VOLT:OFFS?") == pytest.approx(volts, abs=1e-12)


@pytest.mark.parametrize("order", ["level first", "offset first"])
def test_offset_yields_silently_to_the_level(controller, order):
    messages = ["SOUR:VOLT 3 VPK", "SOUR:VOLT:OFFS -9 V"]
    controller.write(*(messages if order == "level first" else messages[::-1]))
    assert controller.number("SOUR:VOLT:OFFS?") == -7
    assert controller.number("SOUR:VOLT?") == 3
    assert controller.errors() == []


@pytest.mark.parametrize(
    ("sent", "answer"), [("30 CYCLE", 30), ("0.2 CYCLE", 1), ("0 CYCLE", 1), ("7.4 CYCLE", 7)]
)
def test_integration_takes_at_least_one_whole_cycle(swept, sent, answer):
    swept.write(f"SWE:DWEL {sent}")
    assert swept.number("SWE:DWEL?") == answer
    assert swept.ask("SWE:DWEL? UNIT") == "CYCLE"


def test_integration_limits(swept):
    assert swept.refusal("SWE:DWEL 235 CYCLE") == [-222]
    assert swept.refusal("SWE:DWEL 0.0001 S") == [-222]
    assert swept.refusal("SWE:DWEL 1 S") == []
    assert swept.ask("SWE:DWEL? UNIT") == "S"


@pytest.mark.parametrize(
    ("spacing", "sent", "number"),
    [("LIN", "2 PNT/SWP", -222), ("LIN", "802 PNT/SWP", -222), ("LIN", "10 PNT/DEC", -131),
     ("LOG", "1 HZ", -131), ("LIN", "0 HZ", -222), ("LIN", "1 HZ", None), ("LIN", "1 PCT", None),
     ("LOG", "100 PNT/OCT", None), ("LOG", "3 PNT/OCT", None), ("LIN", "401 PNT/SWP", None)],
)  # fmt: skip
def test_resolution_takes_the_units_of_the_spacing(swept, spacing, sent, number):
    swept.write(f"SWE:SPAC {spacing}")
    assert swept.refusal(f"FREQ:RES {sent}") == ([] if number is None else [number])


def test_manual_point_is_within_band(swept):
    assert swept.refusal("FREQ:MAN 99") == [-222]
    assert swept.refusal("FREQ:MAN 201") == [-222]
    swept.write("FREQ:MAN 150.01")
    assert swept.number("FREQ:MAN?") == 150.015625


def test_the_state_of_the_instrument_round_trips(controller, bench):
    controller.write("INST:SEL SINE", "FREQ:STAR 77;STOP 177", "SOUR:VOLT 1.5 VRMS", "INP2:COUP AC")
    controller.write("CALC2:FEED 'XFR:POW:VAR 2'", "FORM REAL,32", "SYST:SET?")
    controller.run()
    block = controller.read() or b""
    assert block.startswith(b"#")
    other = bench()
    other.write(b"SYST:SET " + block)
    assert other.errors() == []
    for query in ("INST?", "FREQ:STAR?", "FREQ:STOP?", "SOUR:VOLT?", "SOUR:VOLT? UNIT",
                  "INP2:COUP?", "CALC2:FEED?", "FORM?", "FREQ:RES:AUTO?"):  # fmt: skip
        assert other.ask(query) == controller.ask(query)


def test_a_damaged_state_is_refused_whole(controller):
    controller.write("INST:SEL SINE", "FREQ:STAR 77", "SYST:SET?")
    block = bytearray(controller.read() or b"")
    block[60] ^= 1
    controller.write(b"SYST:SET " + bytes(block))
    assert controller.errors() == [-161]
    assert controller.number("FREQ:STAR?") == 77
