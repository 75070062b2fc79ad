"""The simulated SR785 as any controller meets it: its language, its buffers, its status words.

Expected values are those of the manual, as docs/sr785.md has them; none of this knows the driver.
"""

import pytest
from instruments.simulated_sr785 import DISP, IFC, SRQ, Bench

from sim.instrument.bus import TalkState

# ------------------------------------------------------------ language


def test_identity_is_sr785(bench):
    assert bench.ask("*IDN?").startswith("Stanford_Research_Systems,SR785,")


@pytest.mark.parametrize(
    "line", ["SSTR?0", "sstr ? 0", " SSTR?  0 ", "SSTR? 0;", ";;SSTR?0", "SsTr ?0"]
)
def test_blanks_and_case_do_not_matter(bench, line):
    assert float(bench.ask(line)) == 100.0


@pytest.mark.parametrize(
    ("line", "hertz"),
    [("SSTR2,51.2 k", 51200.0), ("SSTR 2, 5E2", 500.0), ("SSTR 2,500mHz", 0.5),
     ("SSTR 2,.5khz", 500.0), ("SSTR 2,500 H", 500.0)],
)  # fmt: skip
def test_the_beginning_of_a_unit_is_enough(bench, line, hertz):
    bench.send("MGRP 2,3")
    bench.send(line)
    assert bench.events() == 0
    assert float(bench.ask("SSTR? 1")) == pytest.approx(hertz)


@pytest.mark.parametrize(
    ("line", "event"),
    [
        ("FOOO 1", 32), ("SSTR", 32), ("SSTR 2,1,2", 32), ("SSTR 2,ten", 32), ("STRT 1", 32),
        ("SSTR 2,1 furlong", 32), ("SSTR 2,1e9", 16), ("SSTR 3,100", 16), ("MGRP 2,9", 16),
        ("MEAS 0,11", 16),
        ("SNPS 2,9", 16), ("SNPS 2,2049", 16), ("SSAM 5001 mV", 16), ("SOFF 6", 16),
    ],
)  # fmt: skip
def test_refused_command_sets_bit_changes_nothing(bench, line, event):
    questions = "SSTR? 0", "SNPS? 0", "MEAS? 0", "SSAM?", "SOFF?", "MGRP? 1"
    bench.send("MGRP 2,3")
    before = [bench.ask(question) for question in questions]
    bench.send(line)
    assert bench.events() == event
    assert before == [bench.ask(question) for question in questions]


def test_a_refused_question_is_not_answered(bench):
    for line in ("FOOO?", "SSTR? 2", "DSPY? 0,9999", "STRT?"):
        bench.send(line)
        assert bench.box.talk().state is TalkState.NOTHING
    assert bench.events() & 48


def test_queries_in_one_line_are_answered_separately(bench):
    bench.send("SRCO?;MGRP? 0;*STB?")
    replies = [bench.box.talk() for _ in range(3)]
    assert [reply.data for reply in replies] == [b"0\n", b"0\n", b"16\n"]
    assert all(reply.end for reply in replies)


def test_swept_sine_settings_need_group_and_display(bench):
    """The display must be live."""
    bench.send("SSTR 2,300")
    assert bench.events() == 16
    bench.send("MGRP 2,3")
    bench.send("SSTR 2,300")
    assert bench.events() == 0
    bench.send("DISP 0,0")
    bench.send("SSTR 2,400")
    assert bench.events() == 16
    assert bench.ask("SSTR? 0") == "300"


def test_level_reply_has_index_of_unit(bench):
    bench.send("MGRP 2,3")
    for line, reply in (("SSAM 500 mV", "500,0"), ("SSAM .5 V", "0.5,1"), ("SSAM -20dB", "-20,2")):
        bench.send(line)
        assert bench.ask("SSAM?") == reply
    assert bench.events() == 0


def test_amplitude_and_offset_share_five_volts(bench):
    bench.send("MGRP 2,3")
    bench.send("SSAM 4 V")
    bench.send("SOFF 1.5")
    assert bench.events() == 16
    bench.send("SOFF -1")
    bench.send("SSAM 4.5 V")
    assert bench.events() == 16
    assert bench.ask("SSAM?") == "4,1"


# ------------------------------------------------------------ interfaces and buffers


def test_outx_selects_the_reply_port(bench):
    bench.send("OUTX 1")
    bench.send("SRCO?")
    assert bench.box.talk().state is TalkState.NOTHING
    assert bench.box.serial_out() == b"0\r"
    bench.box.serial_in(b"*IDN?\r\nOUTX 0\nSRCO?\r")
    bench.rest(1.0)
    assert bench.box.serial_out().startswith(b"Stanford")
    assert bench.take() == b"0\n"


def test_line_ends_with_line_feed_or_eoi(bench):
    """On the bus."""
    bench.box.listen(b"SRCO?\n")
    bench.rest()
    assert bench.take() == b"0\n"
    bench.box.listen(b"SRCO?")
    bench.rest()
    assert bench.box.talk().state is TalkState.NOTHING
    bench.box.listen(b" ", end=True)
    bench.rest()
    assert bench.take() == b"0\n"


def test_more_than_256_characters_empty_both_buffers(bench):
    bench.send("*IDN?")
    bench.box.listen(b"SRCO?;" * 50, end=True)
    bench.rest(10.0)
    assert bench.box.talk().state is TalkState.NOTHING
    assert bench.events() & 8
    for _ in range(10):
        bench.send("*IDN?")
    bench.box.device_clear()
    assert bench.events() & 4
    assert int(bench.ask("ERRS? 0")) == 1


def test_bus_is_free_when_nothing_executes(bench):
    bench.box.listen(b"SRCO 0", end=True)
    assert not bench.box.serial_poll() & IFC
    bench.rest()
    assert bench.box.serial_poll() & IFC
    assert int(bench.ask("*STB?")) & IFC == 0


def test_reset_takes_twelve_seconds(bench):
    bench.send("MGRP 2,3")
    bench.send("*RST")
    bench.box.listen(b"MGRP? 0", end=True)
    bench.rest(11.0)
    assert bench.box.talk().state is TalkState.WAITING
    bench.rest(2.0)
    assert bench.take() == b"0\n"


def test_device_clear_empties_buffers_but_continues_sweep():
    bench = Bench()
    bench.swept(points=40)
    bench.send("STRT")
    bench.send("*IDN?")
    bench.box.device_clear()
    assert bench.box.talk().state is TalkState.NOTHING
    assert bench.box.sweep.running
    assert bench.box.driven_v == 1.0


# ------------------------------------------------------------ status


def test_status_words_clear_whole_or_by_bit(bench):
    bench.swept()
    assert bench.ask("DSPS? 4") == "1"
    assert bench.ask("DSPS? 4") == "0"
    assert int(bench.ask("DSPS?")) & (1 << 12)
    assert bench.ask("DSPS?") == "0"


def test_enabled_bit_shows_in_poll_requests_service(bench):
    bench.send("DSPE 16")
    bench.send("*SRE 2")
    assert bench.box.serial_poll() == IFC
    bench.swept()
    assert bench.box.service_request
    assert bench.box.serial_poll() == IFC | DISP | SRQ
    assert bench.box.serial_poll() == IFC | DISP
    bench.ask("DSPS?")
    assert bench.box.serial_poll() == IFC


def test_enables_survive_power_cycle_if_set_so(bench):
    bench.send("*ESE 48")
    bench.box.power_on()
    assert bench.ask("*ESE?") == "0"
    bench.send("*PSC 0")
    bench.send("*ESE 48")
    bench.box.power_on()
    assert bench.ask("*ESE?") == "48"
