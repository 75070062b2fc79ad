"""The conversation: drained queue, one recovery for every trouble, both sides back in step."""

import pytest
from instruments.wire import Script

from daq.driving.scpi_connection import Dialogue
from daq.driving.settings import Number, near
from daq.errors import BenchTimeout, InstrumentError, LinkError, ProtocolError

LEVEL = Number("level (V)", "VOLT", "V", 0.0, 5.0, near(0.1))
QUIET = '> SYST:ERR?\n< +0,"No error"\n'


def test_a_setting_is_sent_and_read_back():
    script = Script("> VOLT 2 V\n> VOLT?\n< +2.05000000000E+000")
    assert Dialogue(script).apply(LEVEL, 2.0) == "2.05 V"
    script.finish()


def test_wrong_read_back_is_error_with_queue():
    script = Script(
        '> VOLT 2 V\n> VOLT?\n< +1.0E+000\n> SYST:ERR?\n< -222,"Data out of range"\n' + QUIET
    )
    with pytest.raises(InstrumentError) as error:
        Dialogue(script).apply(LEVEL, 2.0)
    assert "level (V) was set to 2.0 and reads back 1 V" in str(error.value)
    assert "-222 Data out of range" in str(error.value)
    script.finish()


def test_error_queue_is_read_until_empty():
    script = Script('> SYST:ERR?\n< -113,"A"\n> SYST:ERR?\n< -350,"Too many"\n' + QUIET)
    with pytest.raises(InstrumentError, match="block 7: the instrument reports: -113 A, -350"):
        Dialogue(script).check("block 7")
    script.finish()


def test_harmless_queue_entry_is_no_error():
    script = Script('> SYST:ERR?\n< -221,"level 0"\n' + QUIET)
    Dialogue(script).check("entry", harmless=lambda entry: entry.number == -221)
    script.finish()


def test_endless_error_queue_is_abandoned():
    script = Script('> SYST:ERR?\n< -113,"A"\n' * 12)
    with pytest.raises(InstrumentError, match="does not end"):
        Dialogue(script).drain()
    script.finish()


class Trouble(Script):
    """A script in which ``<`` may say ``TIMEOUT`` or ``CUT`` or ``GONE``."""

    def read(self, deadline):
        reply = super().read(deadline)
        if reply == "TIMEOUT":
            raise BenchTimeout("'X?' got no answer within 5 s")
        if reply == "CUT":
            raise ProtocolError("cut short")
        if reply == "GONE":
            raise LinkError("gone")
        return reply


def test_timeout_clears_drains_and_makes_state_unknown():
    script = Trouble('> X?\n< TIMEOUT\n! clear\n> SYST:ERR?\n< -410,"Query interrupted"\n' + QUIET)
    dialogue = Dialogue(script)
    dialogue.trusted = True
    with pytest.raises(BenchTimeout) as error:
        dialogue.ask("X?")
    assert str(error.value) == (
        "'X?' got no answer within 5 s; after a device clear, its queue held "
        "-410 Query interrupted; its state is unknown"
    )
    assert not dialogue.trusted
    script.finish()


@pytest.mark.parametrize(
    ("ask", "reply"),
    [("ask_integer", "1.5"), ("ask_number", "FFT"), ("ask", "CUT"), ("ask_integer", "")],
)
def test_damaged_reply_clears_and_drains(ask, reply):
    script = Trouble(f"> X?\n< {reply}\n! clear\n" + QUIET)
    with pytest.raises(ProtocolError, match="its state is unknown"):
        getattr(Dialogue(script), ask)("X?")
    script.finish()


def test_lost_link_gets_no_further_message():
    script = Trouble("> X?\n< GONE")
    dialogue = Dialogue(script)
    dialogue.trusted = True
    with pytest.raises(LinkError):
        dialogue.ask("X?")
    assert not dialogue.trusted
    script.finish()


def test_failed_recovery_is_reported():
    script = Trouble("> X?\n< TIMEOUT\n! clear\n> SYST:ERR?\n< TIMEOUT")
    with pytest.raises(BenchTimeout, match="no recovery: 'X\\?' got no answer"):
        Dialogue(script).ask("X?")
    script.finish()


def test_old_replies_are_dropped_without_device_clear():
    script = Trouble(
        """
        > X?
        < TIMEOUT
        ! drops only
        > STAT:USER:ENAB 17
        > STAT:USER:ENAB?
        ; the late answer to X?, half of another, and then the one asked for
        < +3
        < CUT
        < +17
        > STAT:USER:ENAB 0
        > SYST:ERR?
        < +0,"No error"
        """
    )
    dialogue = Dialogue(script)
    with pytest.raises(BenchTimeout):
        dialogue.ask("X?")
    script.finish()


def test_synchronising_number_differs_from_the_last():
    once = "! drops only\n> STAT:USER:ENAB {0}\n> STAT:USER:ENAB?\n< +{0}\n> STAT:USER:ENAB 0\n"
    script = Script(once.format(17) + once.format(34))
    dialogue = Dialogue(script)
    dialogue.clear()
    dialogue.clear()
    script.finish()


def test_pause_calls_the_wait_callback():
    script = Script("")
    dialogue = Dialogue(script)
    looks = []
    dialogue.on_wait = lambda: looks.append(script.paused_s)
    dialogue.pause(0.45)
    assert script.paused_s == pytest.approx(0.45)
    assert len(looks) >= 5
    dialogue.on_wait = lambda: (_ for _ in ()).throw(KeyboardInterrupt)
    with pytest.raises(KeyboardInterrupt):
        dialogue.pause(1.0)
