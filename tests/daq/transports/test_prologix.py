"""Instruments behind Prologix and AR488 adapters: bytes, dialects, late and missing replies."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from instruments.wire import MemoryLink, TinyAdapter

from daq.errors import BenchTimeout, LinkError, ProtocolError
from daq.transports.base import Deadline, ask, ask_block
from daq.transports.prologix import PrologixTransport
from daq.transports.prologix_adapter import AR488, OTHER, PROLOGIX, Adapter, dialect_of, escape

SOON = 0.02


def soon() -> Deadline:
    return Deadline.after(SOON)


def echo_number(message: bytes) -> bytes | None:
    return b"+" + message[:-1] + b"\n" if message.endswith(b"?") else None


def opened(adapter: TinyAdapter, address: int = 11) -> PrologixTransport:
    adapter.link = MemoryLink(adapter)
    return PrologixTransport(Adapter(adapter.link, address, Deadline.after(1.0)), "test:")


# Bytes


@given(st.binary(max_size=200))
def test_escaping_survives_the_adapter(message):
    adapter = TinyAdapter(lambda _: None)
    adapter.settings["auto"] = "0"
    adapter.feed(escape(message) + b"\n")
    assert adapter.messages == ([message] if message else [])


def test_special_bytes_are_escaped():
    assert escape(b"a\rb\nc\x1bd+e") == b"a\x1b\rb\x1b\nc\x1b\x1bd\x1b+e"


def test_message_like_adapter_command_reaches_the_instrument():
    adapter = TinyAdapter(lambda _: None)
    opened(adapter).write("++addr 5", soon())
    assert adapter.messages == [b"++addr 5"]
    assert adapter.settings["addr"] == "11"


@pytest.mark.parametrize("line", ["X" * 120, "+" * 60, "", "two\nlines", "grün"])
def test_unsendable_message_is_refused_and_not_sent(line):
    adapter = TinyAdapter(lambda _: None)
    transport = opened(adapter)
    with pytest.raises(ProtocolError, match="nothing was sent"):
        transport.write(line, soon())
    assert adapter.messages == []


def test_longest_line_is_sent():
    adapter = TinyAdapter(lambda _: None)
    opened(adapter).write("X" * 119, soon())
    assert adapter.messages == [b"X" * 119]


@given(st.binary(min_size=0, max_size=300), st.integers(0, 50))
def test_any_block_arrives_whole_however_split(payload, piece):
    digits = str(len(payload)).encode()
    block = b"#" + str(len(digits)).encode() + digits + payload + b"\n"
    transport = opened(TinyAdapter(lambda _: block, piece=piece))
    assert ask_block(transport, "B?", Deadline.after(5.0)) == payload


# Opening


@pytest.mark.parametrize(
    ("version", "dialect"),
    [
        ("Prologix GPIB-USB Controller version 6.107", PROLOGIX),
        ("Prologix GPIB-ETHERNET Controller version 01.06.06.00", PROLOGIX),
        ("AR488 GPIB controller, ver. 0.53.04, 13/04/2025", AR488),
        ("GPIB-USB Version 6.00", OTHER),
        ("+1.000E+00", None),
        ("++ver", None),
        ("", None),
    ],
)
def test_dialect_follows_from_version(version, dialect):
    assert dialect_of(version) is dialect


def test_every_adapter_setting_is_sent_explicitly():
    adapter = TinyAdapter(lambda _: None)
    opened(adapter, address=14)
    wanted = {"mode": "1", "auto": "0", "eoi": "1", "eos": "2", "eot_enable": "0", "addr": "14"}
    assert {key: adapter.settings[key] for key in wanted} == wanted
    assert int(adapter.settings["read_tmo_ms"]) <= 3000


def test_prologix_stops_saving_before_any_setting():
    adapter = TinyAdapter(lambda _: None)
    opened(adapter)
    before = adapter.lines[: adapter.lines.index(b"++savecfg 0")]
    assert set(before) == {b"++ver"}


@pytest.mark.parametrize(
    "version", ["AR488 GPIB controller, ver. 0.53.04", "GPIB-USB Version 6.00"]
)
def test_savecfg_is_never_sent_to_saving_adapters(version):
    adapter = TinyAdapter(lambda _: None, version=version)
    opened(adapter)
    assert not any(line.startswith(b"++savecfg") for line in adapter.lines)
    assert adapter.eeprom_writes == 0


def test_ar488_under_another_name_is_recognised():
    adapter = TinyAdapter(lambda _: None, version="my GPIB box no. 3")
    assert Adapter(MemoryLink(adapter), 11, Deadline.after(1.0)).dialect is AR488


def test_verbose_ar488_is_silenced_without_own_idn():
    adapter = TinyAdapter(echo_number, version="AR488 GPIB controller, ver. 0.53", verbose=True)
    transport = opened(adapter)
    assert not adapter.verbose
    assert adapter.settings["idn"] == "0"
    assert ask(transport, "7?", soon()) == "+7"


def test_greeting_is_not_taken_for_version():
    adapter = TinyAdapter(echo_number, version="AR488 GPIB controller, ver. 0.53")
    link = MemoryLink(adapter)
    link.buffer = b"AR488 starting\r\n"
    opened = Adapter(link, 11, Deadline.after(1.0))
    assert opened.version == "AR488 GPIB controller, ver. 0.53"
    assert opened.resynchronise(Deadline.after(1.0))


def test_a_silent_port_is_no_adapter():
    with pytest.raises(LinkError, match=r"no GPIB adapter answered.*silent"):
        Adapter(MemoryLink(TinyAdapter(lambda _: None, silent=True)), 11, soon())


def test_something_else_on_the_port_is_quoted():
    with pytest.raises(LinkError, match="it said 'ttyACM ready'"):
        Adapter(MemoryLink(TinyAdapter(lambda _: None, version="ttyACM ready")), 11, soon())


def test_setting_with_wrong_read_back_is_refused():
    adapter = TinyAdapter(lambda _: None)
    del adapter.settings["eos"]
    with pytest.raises(LinkError, match=r"'\+\+eos 2' and reads back 'Unrecognized command'"):
        opened(adapter)


# Replies


def test_late_reply_is_requested_again_and_kept():
    adapter = TinyAdapter(echo_number, late_reads=3)
    transport = opened(adapter)
    assert ask(transport, "5?", Deadline.after(5.0)) == "+5"
    assert adapter.messages == [b"5?"]
    assert adapter.empty_reads == 0


def test_nul_bytes_around_reply_are_dropped():
    assert ask(opened(TinyAdapter(lambda _: b"\0+5\0\n")), "X?", soon()) == "+5"


def test_silent_instrument_differs_from_silent_adapter():
    adapter = TinyAdapter(lambda _: None)
    transport = opened(adapter)
    with pytest.raises(BenchTimeout, match=r"instrument is silent, 'FREQ\?' got no answer"):
        ask(transport, "FREQ?", soon())
    adapter.silent = True
    with pytest.raises(LinkError, match=r"adapter is silent since 'FREQ\?'"):
        ask(transport, "FREQ?", soon())


def test_short_reply_error_states_received_length():
    transport = opened(TinyAdapter(lambda _: b"+1.02"))
    with pytest.raises(ProtocolError, match=r"'X\?' was cut short, 5 bytes came"):
        ask(transport, "X?", soon())


def test_short_block_error_states_received_length():
    transport = opened(TinyAdapter(lambda _: b"#216" + struct.pack(">d", 1.0)))
    with pytest.raises(ProtocolError, match=r"'B\?' was cut short, 12 bytes came"):
        ask_block(transport, "B?", soon())


def test_unrequested_reply_stops_the_next_message():
    adapter = TinyAdapter(lambda _: None)
    transport = opened(adapter)
    adapter.link.buffer = b"+3\n"
    with pytest.raises(ProtocolError, match=r"b'\+3\\n' came unasked for"):
        transport.write("A 1", soon())
    assert adapter.messages == []


def test_noise_of_nul_bytes_is_no_reply():
    adapter = TinyAdapter(lambda _: None)
    transport = opened(adapter)
    adapter.link.buffer = b"\0\0"
    transport.write("A 1", soon())
    assert adapter.messages == [b"A 1"]


def test_reply_that_is_not_text_is_refused():
    with pytest.raises(ProtocolError, match="not text"):
        ask(opened(TinyAdapter(lambda _: b"\xff\xfe\n")), "X?", soon())


# Polls and clears


def test_a_serial_poll_gives_the_status_byte():
    assert opened(TinyAdapter(lambda _: None, status_byte=96)).serial_poll(soon()) == 96


def test_unanswered_poll_is_error_of_its_own():
    transport = opened(TinyAdapter(lambda _: None, status_byte=None))
    with pytest.raises(BenchTimeout, match="'serial poll' got no answer"):
        transport.serial_poll(soon())


def test_a_poll_answered_by_nonsense_is_refused():
    transport = opened(TinyAdapter(lambda _: None, status_byte=256))
    with pytest.raises(ProtocolError, match="0 to 255"):
        transport.serial_poll(soon())


def test_device_clear_discards_old_replies():
    adapter = TinyAdapter(lambda message: b"old" if message == b"OLD?" else b"new\n")
    transport = opened(adapter)
    with pytest.raises(ProtocolError, match="cut short"):
        ask(transport, "OLD?", soon())
    adapter.queued = b"older still\n"
    adapter.link.buffer = b"+9\n"
    assert transport.device_clear(Deadline.after(1.0))
    assert adapter.cleared == 1
    assert ask(transport, "NEW?", soon()) == "new"


def test_reset_adapter_is_noticed_and_configured_again():
    adapter = TinyAdapter(echo_number)
    transport = opened(adapter)
    adapter.settings |= {"addr": "5", "auto": "1", "mode": "0"}
    adapter.instrument = lambda _: None
    with pytest.raises(BenchTimeout, match="adapter was reset and lost its settings"):
        ask(transport, "7?", soon())
    adapter.instrument = echo_number
    assert transport.device_clear(Deadline.after(1.0))
    assert (adapter.settings["addr"], adapter.settings["auto"]) == ("11", "0")
    assert ask(transport, "8?", soon()) == "+8"


def test_clear_through_silent_adapter_loses_link():
    adapter = TinyAdapter(lambda _: None)
    transport = opened(adapter)
    adapter.silent = True
    with pytest.raises(LinkError, match="adapter is silent"):
        transport.device_clear(soon())


@pytest.mark.parametrize("deaf_for", range(3))
def test_adapter_starting_during_query_is_asked_again(deaf_for):
    adapter = TinyAdapter(echo_number)
    transport = opened(adapter)
    lost, hear = [], adapter.feed

    def deaf(data: bytes) -> bytes:
        if data.startswith(b"++ver") and len(lost) < deaf_for:
            lost.append(data)
            return b""
        return hear(data)

    adapter.feed = deaf
    assert transport.device_clear(Deadline.after(3.0))
    assert len(lost) == deaf_for
    assert ask(transport, "1?", soon()) == "+1"


def test_stale_answer_is_never_taken_as_new():
    adapter = TinyAdapter(echo_number)
    transport = opened(adapter)
    adapter.silent = True
    with pytest.raises(LinkError):
        ask(transport, "1?", soon())
    # Now it works off what it was sent meanwhile, version texts and all.
    adapter.silent = False
    adapter.link.buffer += b"+1\n" + adapter.version.encode() + b"\r\n"
    assert ask(transport, "2?", soon()) == "+2"
    assert ask(transport, "3?", soon()) == "+3"


def test_late_version_is_no_reply():
    """An adapter that the instrument held up answers an old question of ours."""
    late = TinyAdapter(echo_number).version.encode() + b"\r\n"
    adapter = TinyAdapter(lambda message: late + b"+0" + late if b"CUT" in message else late)
    transport = opened(adapter)
    with pytest.raises(BenchTimeout, match=r"silent, 'OUTP\?' got no answer within [^;]*; is it"):
        ask(transport, "OUTP?", soon())
    with pytest.raises(BenchTimeout, match=r"silent, 'CUT\?' got no answer"):
        ask(transport, "CUT?", soon())
    adapter.instrument = lambda message: late + b"+5\n"
    adapter.link.buffer = late
    assert ask(transport, "SOUR:VOLT?", soon()) == "+5"


def test_silent_adapter_gets_commands_but_no_queries():
    adapter = TinyAdapter(echo_number)
    transport = opened(adapter)
    adapter.silent = True
    with pytest.raises(LinkError):
        ask(transport, "1?", soon())
    sent = []
    adapter.feed = lambda data: sent.append(data) or b""
    transport.write("SOUR:VOLT 0 VPK", soon())
    assert b"SOUR:VOLT 0 VPK\n" in sent
    with pytest.raises(LinkError, match="adapter is silent"):
        transport.write("SOUR:VOLT?", soon())
    assert not any(b"SOUR:VOLT?" in data for data in sent)


def test_closing_lets_the_link_go():
    adapter = TinyAdapter(lambda _: None)
    opened(adapter).close()
    assert adapter.link.closed
