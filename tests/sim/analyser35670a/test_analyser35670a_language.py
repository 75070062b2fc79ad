"""Section "language": spelling, paths, arguments, and the number of every refusal."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.analyser35670a import Analyser35670A, Choices, LinearPlant, TalkState
from sim.analyser35670a.commands.dispatch import all_settings, command_tables
from sim.analyser35670a.kinds import Pick, Quoted, Switch, Text, Whole
from sim.analyser35670a.settings import Setting

NO_ERROR = '+0,"No error"'


@pytest.mark.parametrize(
    "header",
    ["SYST:ERR?", "SYSTEM:ERROR?", ":syst:err?", "System:Err?", "sySt:ErRoR?", ":SYST:ERROR?"],
)
def test_the_error_query_in_every_spelling(controller, header):
    assert controller.ask(header) == NO_ERROR


@pytest.mark.parametrize(
    "header",
    ["SYST:ERR:NEXT?", "SYST:ERR:ALL?", "SYST:ERR:COUN?", "SYSTE:ERR?", "SYST:ERRO?",
     "FREQU:STAR 1", "*IDNN?", "SYS:ERR?"],
)  # fmt: skip
def test_abbreviations_and_newer_commands_are_refused(controller, header):
    assert controller.refusal(header) == [-113]
    assert controller.instrument.talk().state is TalkState.NOTHING


@pytest.mark.parametrize(
    "header",
    [
        "VOLT2:RANG?", "SENS:VOLT2:DC:RANG:UPP?", "SENSE:VOLTAGE2:DC:RANGE:UPPER?",
        ":volt2:rang:upp?", "VOLT2:DC:RANG?",
    ],
)  # fmt: skip
def test_bracketed_nodes_are_optional(controller, header):
    controller.write("VOLT1:RANG 1 VPK", "VOLT2:RANG 11")
    assert controller.number(header) == 11


def test_omitted_channel_or_trace_is_first(controller):
    controller.write("VOLT1:RANG -5", "VOLT2:RANG 11", "CALC1:FORM IMAG", "CALC2:FORM PHAS")
    assert controller.number("VOLT:RANG?") == -5
    assert controller.ask("CALC:FORM?") == "IMAG"
    assert controller.refusal("CALC5:FORM?") == [-113]
    assert controller.refusal("CALC0:FORM?") == [-113]


def test_the_path_lasts_until_a_colon(controller):
    controller.write("INST:SEL SINE;:FREQ:STAR 100;STOP 300;*CLS;STEP 7;:SWE:DIR DOWN;MODE MAN")
    assert controller.errors() == []
    assert controller.ask("FREQ:STAR?;STOP?;STEP?;:SWE:DIR?;MODE?") == (
        "+1.00000000000E+002;+3.00000000000E+002;+7.00000000000E+000;DOWN;MAN"
    )


def test_missing_colon_keeps_last_command_level(controller):
    assert controller.refusal("FREQ:STEP 7;FREQ:STEP 8") == [-113]
    assert controller.number("FREQ:STEP?") == 7
    # A one-word header leaves the path at the root.
    assert controller.refusal("INP2 ON;INP2:COUP AC;COUP DC") == []
    assert controller.ask("INP2:COUP?") == "DC"
    # And each message starts at the root.
    assert controller.refusal("STEP 9") == [-113]


def test_omitted_optional_nodes_leave_the_path(controller):
    assert controller.refusal("AVER ON;INP2 ON;:AVER:COUN 3;TYPE RMS") == []
    assert controller.refusal("VOLT2:RANG 1 VPK;RANG:AUTO ON") == []
    assert controller.integer("VOLT2:RANG:AUTO?") == 1
    assert controller.integer("VOLT1:RANG:AUTO?") == 1


@pytest.mark.parametrize(
    ("message", "number"),
    [
        ("FREQ: STEP 1", -113),
        ("FREQ :STEP 1", -113),
        ("FREQ:STEP? 1 2", -120),
        ("FREQ:STEP", -109),
        ("FREQ:STEP 1,2", -104),
        ("FREQ:STEP 1,", -109),
        ("*CLS 1", -104),
        ("ABOR 1", -104),
        ("FREQ:STEP 1 V", -131),
        ("FREQ:STEP 1 FURLONG", -131),
        ("SOUR:VOLT 1 HZ", -131),
        ("FREQ:STEP BIG", -141),
        ("INP2:COUP XY", -141),
        ("INP2 MAYBE", -141),
        ("FREQ:STEP 'text'", -120),
        ("FREQ:STEP (1)", -120),
        ("CALC:FEED 'XFR:POW 1", -151),
        ("CALC:FEED 'NONSENSE'", -151),
        ("CALC:FEED XFRPOW", -151),
        ("SYST:SET #1", -161),
        ("SYST:SET #9ABC", -161),
        ("SYST:SET 1", -161),
        ("SYST:SET #15hello", -161),
        ("FREQ:STEP 1E9", -222),
        ("FREQ:STEP -1", -222),
        ("FREQ:STEP 1E999", -222),
        ("*ESE 256", -222),
        ("FORM REAL,48", -224),
        ("IDN?", -113),
        ("FREQ:STEP 1?", -120),
        ("SYST:ERR", -100),
        ("*IDN", -100),
        ("ABOR?", -113),
        ("INP3 ON", -241),
        ("INP1 OFF", -200),
        ("MMEM:STOR:TRAC TRAC1,'INT:X'", -252),
        ("HCOP", -200),
        ("CALC:CFIT", -200),
        ("PROG:DEF?", -200),
        ("TRAC? TRAC1", -141),
        ("TRAC? D1", -230),
        ("TRAC D1,1,2", -200),
    ],
)
def test_refusals_have_their_error_number(controller, message, number):
    assert controller.refusal(message) == [number]


def test_value_out_of_range_is_unchanged(controller):
    controller.write("FREQ:STEP 55")
    assert controller.refusal("FREQ:STEP 1E9") == [-222]
    assert controller.number("FREQ:STEP?") == 55


def test_wrong_unit_does_not_stop_message(controller):
    assert controller.refusal("FREQ:STEP 1 V;STEP 44") == [-131]
    assert controller.number("FREQ:STEP?") == 44


@pytest.mark.parametrize(
    ("sent", "hertz"),
    [("1.5 KHZ", 1500), ("1500", 1500), ("+1.5e3HZ", 1500), ("90000 CPM", 1500), (".5 khz", 500)],
)
def test_suffixes_scale(controller, sent, hertz):
    controller.write(f"FREQ:STEP {sent}")
    assert controller.number("FREQ:STEP?") == pytest.approx(hertz, rel=1e-11)


def test_bounds_steps_and_units(controller):
    controller.write("FREQ:STEP MAX")
    assert controller.number("FREQ:STEP?") == 102400
    controller.write("FREQ:STEP MIN")
    assert controller.number("FREQ:STEP?") == 1 / 64
    controller.write("INST:SEL SINE", "FREQ:STEP 10", "FREQ:STAR 100", "FREQ:STAR UP")
    assert controller.number("FREQ:STAR?") == 110
    controller.write("FREQ:STAR DOWN;STAR DOWN")
    assert controller.number("FREQ:STAR?") == 90
    controller.write("FREQ:STOP MAX")
    assert controller.number("FREQ:STOP?") == 51200
    controller.write("VOLT2:RANG 1;RANG UP")
    assert controller.number("VOLT2:RANG?") == 3
    controller.write("VOLT2:RANG DOWN;RANG DOWN")
    assert controller.number("VOLT2:RANG?") == -1
    controller.write("VOLT2:RANG MAX")
    assert controller.number("VOLT2:RANG?") == 27
    assert controller.ask("VOLT2:RANG? UNIT") == "DBVRMS"
    assert controller.ask("SOUR:VOLT? UNIT") == "VPK"
    assert controller.ask("FREQ:RES? UNIT") == "PNT/SWP"
    assert controller.number("FREQ:STEP? MAX") == 102400
    assert controller.errors() == []


def test_numbers_are_signed_with_three_exponent_digits(controller):
    assert controller.ask("FREQ:STOP?") == "+5.12000000000E+004"
    assert controller.ask("SOUR:VOLT:OFFS?") == "+0.00000000000E+000"
    controller.write("SOUR:VOLT:OFFS -0.5")
    assert controller.ask("SOUR:VOLT:OFFS?") == "-5.00000000000E-001"
    assert controller.ask("*STB?") == "+0"
    assert controller.ask("INP2?") == "+1"
    assert controller.ask("FORM?") == "ASC,+12"
    controller.write("FORM REAL,32")
    assert controller.ask("FORM?") == "REAL,+32"


@pytest.mark.parametrize(("digits", "length"), [(3, 10), (7, 14), (12, 19)])
def test_ascii_data_have_requested_digits(controller, digits, length):
    controller.write(f"FORM ASC,{digits}")
    first = (controller.ask("CALC:X:DATA?") or "").split(",")[1]
    assert len(first) == length
    assert float(first) == pytest.approx(128.0, rel=10.0**-digits)


def test_error_queue_keeps_oldest_and_reports_overflow(controller):
    controller.write("FREQ:STEP 1 V", *["JUNK"] * 7)
    assert controller.errors() == [-131, -113, -113, -113, -350]
    assert controller.ask("SYST:ERR?") == NO_ERROR


def test_clearing_commands_empty_error_queue(controller):
    for message, left in (("*RST", [-113]), ("*CLS", []), ("SYST:PRES", [])):
        controller.write("JUNK", message)
        controller.run()
        assert controller.errors() == left


def test_quote_in_error_text_is_escaped(controller):
    controller.write('CALC:FEED "XFR:POW:RAT ""2,1"""')
    reply = controller.ask("SYST:ERR?") or ""
    assert reply.count('"') % 2 == 0


def headers() -> list[tuple[str, Setting]]:
    """Every setting's long and short spelling, optional nodes in and out."""
    found = []
    for setting in all_settings():
        pieces = re.sub(r"#\d?", "1", setting.pattern).split(":")
        long = ":".join(piece.strip("[]") for piece in pieces)
        short = ":".join(
            "".join(sign for sign in piece if not sign.islower())
            for piece in pieces
            if not piece.startswith("[")
        )
        found += [(long, setting), (short, setting)]
    return found


@pytest.mark.parametrize("mode", ["FFT", "SINE"])
def test_every_listed_command_works_in_both_forms(bench, mode):
    controller = bench(options="1D0,1D1,1D2,1D3,1D4,1C2")
    controller.write(f"INST:SEL {mode}")
    controller.run()
    for header, setting in headers():
        controller.errors()
        reply = controller.ask(f"{header}?")
        if controller.instrument.settings.mode in setting.modes:
            assert reply is not None, header
            assert controller.errors() == [], header
        else:
            assert reply is None
            assert controller.errors()[0] == setting.refusal[0], header


def test_setting_accepts_its_own_reply(bench):
    controller = bench(options="1D2,1D3,1D4,1C2")
    controller.write("INST:SEL SINE", "SWE:MODE MAN")
    for header, setting in headers():
        simple = isinstance(setting.kind, Switch | Pick | Quoted | Whole | Text)
        # Where nothing can be set, a null string is answered.
        simple = simple and setting.applies is None and setting.pattern != "CALCulate#:UNIT:VOLTage"
        if simple and controller.instrument.settings.mode in setting.modes:
            answer = controller.ask(f"{header}?")
            controller.write(f"{header} {answer}")
            assert controller.errors() == [], (header, answer)
            assert controller.ask(f"{header}?") == answer


TREE, COMMON = command_tables()
WORDS = sorted(
    {piece for header, _setting in headers() for piece in header.split(":")}
    | set(COMMON)
    | {"SYST", "ERR", "INIT", "ABOR", "DATA", "HEAD", "POIN", "TRAC"}
)
ARGUMENTS = [
    "", "1", "ON", "-1E9", "1E400", "2 VPK", "3 HZ", "'XFR:POW:RAT 2,1'", "D1,TRAC1", "#15hel",
    "#0x", "MAX", "UP", "SINE", "D1", "REAL,64", "?", ",", '"', "#", "#9999999999", "1,2,3",
]  # fmt: skip


@settings(max_examples=40, deadline=2000)
@given(st.data())
def test_message_neither_crashes_nor_hangs_simulator(data):
    instrument = Analyser35670A(LinearPlant(lambda hz: 0.1), Choices())
    pieces = data.draw(
        st.lists(
            st.one_of(
                st.builds(
                    lambda words, query, argument, end: (
                        f"{':'.join(words)}{query} {argument}{end}".encode()
                    ),
                    st.lists(st.sampled_from(WORDS), min_size=1, max_size=4),
                    st.sampled_from(["", "?"]),
                    st.sampled_from(ARGUMENTS),
                    st.sampled_from(["\n", ";", ";:", "\r\n"]),
                ),
                st.binary(max_size=40),
            ),
            max_size=8,
        )
    )
    for piece in pieces:
        instrument.listen(piece, data.draw(st.booleans()))
        if data.draw(st.booleans()):
            instrument.talk(data.draw(st.sampled_from([None, 1, 3])))
        instrument.agenda.run_next()
    instrument.device_clear()
    instrument.agenda.run_until(instrument.agenda.now_s + 1000.0)
    instrument.listen(b"*CLS\n")
    instrument.listen(b"SYST:ERR?\n")
    talk = instrument.talk()
    if not instrument.damage.dead:
        assert talk.data == b'+0,"No error"\n'


@settings(max_examples=40)
@given(st.text(st.characters(codec="ascii", exclude_characters="\n"), max_size=60))
def test_every_refusal_has_listed_number(text):
    instrument = Analyser35670A(LinearPlant(lambda hz: 0.1), Choices())
    instrument.listen(text.encode() + b"\n")
    instrument.device_clear()
    for _ in range(6):
        instrument.listen(b"SYST:ERR?\n")
        number = int(instrument.talk().data.split(b",")[0])
        assert number == 0 or -500 < number <= -100
        if number == 0:
            return
    raise AssertionError("the queue does not end")


def test_headers_are_distinct():
    """No two commands share a spelling, or one of them could never be reached."""
    for header, setting in headers():
        found = TREE.find(header.upper(), TREE.root)
        assert found is not None
        assert found.leaf.pattern == setting.pattern
