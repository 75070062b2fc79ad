"""Serial and TCP links: one report for every way in which a port can die, no wait without end."""

import os
import time

import pytest
from instruments.wire import ByteServer, Pty, TinyAdapter

from daq.errors import BenchTimeout, LinkError
from daq.transports.base import Deadline, ask
from daq.transports.links import SerialLink, TcpLink
from daq.transports.open import open_transport


def number(message: bytes) -> bytes | None:
    return b"+5\n" if message.endswith(b"?") else None


def test_a_whole_dialogue_over_a_serial_port():
    adapter = TinyAdapter(number, status_byte=96)
    with Pty(adapter.feed) as pty:
        transport = open_transport(f"prologix:{pty.device}?addr=14")
        assert ask(transport, "A?", Deadline.after(1.0)) == "+5"
        assert transport.serial_poll(Deadline.after(1.0)) == 96
        transport.close()
    assert adapter.settings["addr"] == "14"


def test_a_whole_dialogue_over_tcp():
    adapter = TinyAdapter(number)
    with ByteServer(adapter.feed) as server:
        transport = open_transport(f"prologix-tcp:127.0.0.1:{server.port}?addr=3")
        assert ask(transport, "A?", Deadline.after(1.0)) == "+5"
        transport.close()
        transport.close()
    assert adapter.settings["addr"] == "3"


def test_pyserial_urls_join_the_two():
    with ByteServer(TinyAdapter(number).feed) as server:
        transport = open_transport(f"prologix:socket://127.0.0.1:{server.port}")
        assert ask(transport, "A?", Deadline.after(1.0)) == "+5"
        transport.close()


def test_adapter_that_wakes_late_is_awaited():
    adapter = TinyAdapter(number)
    awake = time.monotonic() + 1.0

    def feed(data: bytes) -> bytes:
        return adapter.feed(data) if time.monotonic() > awake else b""

    with Pty(feed) as pty:
        transport = open_transport(f"prologix:{pty.device}", opening_s=5.0)
        assert ask(transport, "A?", Deadline.after(1.0)) == "+5"
        transport.close()


def test_a_second_program_is_refused_at_opening():
    with Pty(TinyAdapter(number).feed) as pty:
        first = SerialLink(pty.device)
        with pytest.raises(LinkError, match=r"cannot be opened .* another program"):
            SerialLink(pty.device)
        first.close()


def test_missing_port_is_reported():
    with pytest.raises(LinkError, match="is it plugged in"):
        SerialLink("/dev/ttyNONE7")


def test_unplugged_port_is_lost_both_ways():
    pty = Pty(lambda data: b"")
    link = SerialLink(pty.device)
    pty.unplug()
    started = time.monotonic()
    with pytest.raises(LinkError, match=r"lost|gone"):
        link.receive(Deadline.after(5.0))
    with pytest.raises(LinkError):
        link.send(b"++ver\n", Deadline.after(1.0))
    link.close()
    link.close()
    assert time.monotonic() - started < 1.0
    with pytest.raises(LinkError, match="closed"):
        link.send(b"x", Deadline.after(1.0))
    pty.__exit__()


def test_port_vanishing_while_idle_is_noticed(tmp_path):
    with Pty(lambda data: b"") as pty:
        name = tmp_path / "adapter"
        os.symlink(pty.device, name)
        link = SerialLink(str(name))
        name.unlink()
        with pytest.raises(LinkError, match="port is gone"):
            link.receive(Deadline.after(5.0))
        link.close()


def test_reading_nothing_ends_at_deadline():
    with Pty(lambda data: b"") as pty:
        link = SerialLink(pty.device)
        started = time.monotonic()
        assert link.receive(Deadline.after(0.1)) == b""
        assert 0.09 < time.monotonic() - started < 0.4
        started = time.monotonic()
        for _ in range(20):
            assert link.receive(Deadline.after(0.0)) == b""
        assert time.monotonic() - started < 0.05
        link.close()


def test_closed_or_absent_tcp_link_is_lost():
    with ByteServer(lambda data: None) as server:
        link = TcpLink("127.0.0.1", server.port, Deadline.after(1.0))
        assert link.receive(Deadline.after(0.05)) == b""
        link.send(b"bye\n", Deadline.after(1.0))
        with pytest.raises(LinkError, match="other side closed"):
            link.receive(Deadline.after(5.0))
        link.close()
        link.close()
        with pytest.raises(LinkError, match="is closed"):
            link.receive(Deadline.after(1.0))
    with pytest.raises(LinkError, match="no connection"):
        TcpLink("127.0.0.1", server.port, Deadline.after(1.0))


def test_full_peer_bounds_the_wait():
    with ByteServer(lambda data: time.sleep(0.3) or b"") as server:
        link = TcpLink("127.0.0.1", server.port, Deadline.after(1.0))
        with pytest.raises(BenchTimeout, match="was not taken within"):
            link.send(b"x" * 50_000_000, Deadline.after(0.1))
        link.close()
