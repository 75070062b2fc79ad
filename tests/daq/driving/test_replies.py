"""Replies of the wire: exactly of their kind, or an error."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.driving.replies import (
    decode_reals,
    is_filler,
    parse_error,
    parse_integer,
    parse_number,
    parse_string,
    to_volts_peak,
)
from daq.errors import ProtocolError
from daq.transports.base import BLOCK_LIMIT_BYTES, Deadline, checked_line, take_block


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("+1.02400000000E+005", 102400.0),
        ("-3.40282346639E+038", -3.40282346639e38),
        ("+0.00000000000E+000", 0.0),
        ("-9.91E+37", -9.91e37),
        ("5", 5.0),
        (".5e-3", 5e-4),
        (" 7. ", 7.0),
    ],
)
def test_printed_numbers_are_parsed(text, value):
    assert parse_number(text) == value


@pytest.mark.parametrize(
    "text",
    ["", "+", "1,2", "1 2", "nan", "inf", "0x10", "1e", "1_000", "E5", "+1.0E+999", "١", "2\x1d"],
)
def test_text_other_than_number_is_refused(text):
    with pytest.raises(ProtocolError, match="number was due"):
        parse_number(text)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_printed_number_is_read_back(value):
    mantissa, exponent = f"{value:+.16E}".split("E")
    printed = f"{mantissa}E{int(exponent):+04d}"
    assert parse_number(printed) == pytest.approx(value, rel=1e-15, abs=0.0)


@pytest.mark.parametrize(("text", "value"), [("+256", 256), ("-0", 0), ("+0", 0), ("17", 17)])
def test_integers_carry_a_sign(text, value):
    assert parse_integer(text) == value


@pytest.mark.parametrize("text", ["", "+2.56E+002", "1.0", "+", "1 2", "²", "+2\x1d"])
def test_text_other_than_integer_is_refused(text):
    with pytest.raises(ProtocolError, match="integer was due"):
        parse_integer(text)


@pytest.mark.parametrize(
    ("text", "value"),
    [('"1D2,1D3"', "1D2,1D3"), ("'a'", "a"), ('""', ""), ("FFT", "FFT"), ('"a""b"', 'a"b')],
)
def test_strings_lose_their_quotes(text, value):
    assert parse_string(text) == value


@pytest.mark.parametrize("text", ['"open', '"', '"a"b"', "'a\""])
def test_unclosed_quote_is_damage(text):
    with pytest.raises(ProtocolError):
        parse_string(text)


def test_error_queue_entries():
    entry = parse_error('-221,"Settings conflict; SOURCE LEVEL is 0 Volts, measurement paused."')
    assert entry.number == -221
    assert str(entry).endswith("measurement paused.")
    assert parse_error('+0,"No error"').number == 0
    assert parse_error('-113, "Undefined ""X"" header"').text == 'Undefined "X" header'


@pytest.mark.parametrize("text", ["", "0", "+0,No error", '0,"No error', '"No error"', '+0,"a"x'])
def test_invalid_error_queue_entry_is_refused(text):
    with pytest.raises(ProtocolError, match="error-queue entry was due"):
        parse_error(text)


@given(st.text(max_size=30))
def test_no_text_makes_a_parser_fail_otherwise(text):
    for parse in (parse_number, parse_integer, parse_error, parse_string):
        try:
            parse(text)
        except ProtocolError:
            continue


def test_reals_are_big_endian():
    assert decode_reals(struct.pack(">3d", 1.0, -2.5, 1e300)).tolist() == [1.0, -2.5, 1e300]
    with pytest.raises(ProtocolError, match="9 bytes holds no whole number"):
        decode_reals(b"123456789")


def test_fillers_are_recognised_and_readings_are_not():
    values = np.array([9.9e37, 9.91e37, -3.40282346639e38, np.nan, np.inf, 1e30, 0.0, -5.0])
    assert is_filler(values).tolist() == [True] * 5 + [False] * 3


@pytest.mark.parametrize(
    ("value", "unit"),
    [(1.0, "VPK"), (2**-0.5, "VRMS"), (0.0, "dbvpk"), (-3.010299956639812, "DBVRMS")],
)
def test_amplitudes_become_volts_peak(value, unit):
    assert to_volts_peak(value, unit) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("unit", ["V", "DBV", "", "HZ"])
def test_amplitude_in_doubtful_unit_is_refused(unit):
    with pytest.raises(ProtocolError, match="was due"):
        to_volts_peak(0.0, unit)


def feeder(data: bytes):
    """Exactly as many bytes as asked for, as a transport gives them."""
    rest = bytearray(data)

    def take(count: int) -> bytes:
        if count > len(rest):
            raise ProtocolError("no more bytes")
        part = bytes(rest[:count])
        del rest[:count]
        return part

    return take, rest


@given(st.binary(max_size=2000), st.integers(0, 3))
def test_any_payload_passes_through_a_block(payload, zeros):
    digits = f"{'0' * zeros}{len(payload)}"
    take, rest = feeder(f"#{len(digits)}{digits}".encode() + payload + b"\n")
    assert take_block(take) == payload
    assert not rest


@pytest.mark.parametrize(
    ("data", "fault"),
    [
        (b"+1.0\n", "start with '#'"),
        (b"#A12345678", "start with '#'"),
        (b"#0abc\n", "indefinite"),
        (b"#21Xab\n", "should be digits"),
        (b"#2-1ab\n", "should be digits"),
        (b"#9999999999abc", "more than"),
        (b"#15abc", "no more bytes"),
        (b"#15abcdeX", "not by a line feed"),
        (b"#1", "no more bytes"),
    ],
)
def test_a_damaged_block_is_refused(data, fault):
    with pytest.raises(ProtocolError, match=fault):
        take_block(feeder(data)[0])


def test_largest_block_is_accepted():
    size = BLOCK_LIMIT_BYTES
    assert len(take_block(feeder(b"#7%d" % size + bytes(size) + b"\n")[0])) == size


@given(st.binary(max_size=60))
def test_any_bytes_raise_only_block_errors(data):
    try:
        take_block(feeder(data)[0])
    except ProtocolError:
        return


def test_line_is_one_message_within_119_bytes():
    assert checked_line("A" * 119) == b"A" * 119
    for line in ("A" * 120, "", "a\nb", "a\r", "ü"):
        with pytest.raises(ProtocolError, match="nothing was sent"):
            checked_line(line)


def test_deadlines_shrink_and_never_grow():
    deadline = Deadline.after(10.0)
    assert deadline.within(1.0).remaining_s <= 1.0
    assert deadline.within(100.0) is deadline
    assert Deadline.after(0.0).expired
    assert Deadline.after(-1.0).remaining_s == 0.0
