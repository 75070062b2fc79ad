"""The kinds of settings by themselves; the analyser's own are in test_hp35670a_settings."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.driving.settings import Choice, Number, Switch, down_to, near, up_to
from daq.errors import LimitError, ProtocolError

START = Number("start (Hz)", "FREQ:STAR", "HZ", 1.0, 100.0, down_to(0.5))
LEVEL = Number("level", "VOLT", "VPK", 0.0, 5.0, near(0.1), ("VPK", "VRMS"), asks_unit=True)


@pytest.mark.parametrize("value", [0.99, 100.01, -5.0, math.nan, math.inf, True, "7", None])
def test_number_out_of_range_is_never_clipped(value):
    """It is refused."""
    with pytest.raises(LimitError, match="nothing was sent"):
        START.command(value)


@given(st.floats(1.0, 100.0))
def test_sent_number_is_the_requested_one(value):
    line = START.command(value)
    header, number, unit = line.split(" ")
    assert (header, unit) == ("FREQ:STAR", "HZ")
    assert float(number) == pytest.approx(value, rel=1e-11)


def test_read_back_allows_rounding_of_instrument():
    assert START.accepts(10.3, "+1.00000000000E+001")
    assert not START.accepts(10.3, "+1.05000000000E+001")
    assert not START.accepts(10.3, "+9.70000000000E+000")
    stop = Number("stop", "FREQ:STOP", "HZ", 0, 100, up_to(0.5))
    assert stop.accepts(10.3, "10.5")
    assert not stop.accepts(10.3, "10.0")


def test_read_back_unit_is_converted_or_refused():
    assert LEVEL.accepts(2.0, "+1.41421356237E+000", "VRMS")
    assert not LEVEL.accepts(2.0, "+2.00000000000E+000", "VRMS")
    assert LEVEL.shown("+1.41421356237E+000", "VRMS") == "2 VPK"
    with pytest.raises(ProtocolError, match="answers in 'DBVRMS'"):
        LEVEL.accepts(2.0, "3", "DBVRMS")


def test_words_and_their_long_forms():
    spacing = Choice("spacing", "SWE:SPAC", ("LIN", "LOG"), ("LINEAR", "LOGARITHMIC"))
    assert spacing.command("LOG") == "SWE:SPAC LOG"
    assert spacing.accepts("LOG", "LOG")
    assert spacing.accepts("LOG", "Logarithmic")
    assert not spacing.accepts("LOG", "LIN")
    for word in ("log", "LOGA", "", None, 1):
        with pytest.raises(LimitError, match="is not one of LIN, LOG"):
            spacing.command(word)


def test_quoted_words_read_back_in_any_quotes():
    """Blanks may surround them."""
    feed = Choice("data", "CALC1:FEED", ("XFR:POW:RAT 2,1",), quoted=True)
    assert feed.command("XFR:POW:RAT 2,1") == "CALC1:FEED 'XFR:POW:RAT 2,1'"
    assert feed.accepts("XFR:POW:RAT 2,1", '"XFR:POW:RAT 2, 1"')
    assert not feed.accepts("XFR:POW:RAT 2,1", '"XFR:POW:RAT 3,1"')


def test_switch_is_sent_and_read_back():
    switch = Switch("continuous", "INIT:CONT")
    assert (switch.command(True), switch.command(False)) == ("INIT:CONT ON", "INIT:CONT OFF")
    assert switch.accepts(True, "+1")
    assert not switch.accepts(False, "+1")
    assert (switch.shown("+1"), switch.shown("+0")) == ("on", "off")
    for value in (1, 0, "ON", None):
        with pytest.raises(LimitError, match="neither True nor False"):
            switch.command(value)
    with pytest.raises(ProtocolError):
        switch.accepts(True, "ON")
