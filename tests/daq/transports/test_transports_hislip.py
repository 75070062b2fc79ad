"""An instrument on HiSLIP: whole messages, service requests, late replies, clears, locks."""

import socket
import struct
import threading
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from instruments.bench_server import simulated
from instruments.fake_analyser import known_gain
from instruments.hislip import HislipServer, OnBus, Replies
from instruments.wire import ByteServer

from daq.analyser import PointSettings, SourceState
from daq.drivers import DRIVERS, open_analyser
from daq.errors import BenchTimeout, LashbenchError, LinkError, ProtocolError
from daq.plan import spaced_frequencies
from daq.transports.base import Deadline, ask, ask_block
from daq.transports.hislip import Kind, packed
from daq.transports.open import open_transport
from sim.instrument.plant import LinearPlant

PAYLOAD = struct.pack(">600d", *range(600))
BLOCK = b"#4%d" % len(PAYLOAD) + PAYLOAD + b"\n"


def reply_to(line):
    return {b"A?": b"+1\n", b"B?": b"+2\n", b"BLOCK?": BLOCK, b"CUT?": BLOCK[:20],
            b"BINARY?": b"\xff\n"}.get(line)  # fmt: skip


@pytest.fixture
def server():
    with HislipServer(Replies(reply_to, status_byte=96)) as server:
        yield server


@pytest.fixture
def transport(server):
    transport = open_transport(f"TCPIP::127.0.0.1::hislip0,{server.port}::INSTR")
    yield transport
    transport.close()


def soon(seconds=2.0):
    return Deadline.after(seconds)


def test_text_blocks_and_counted_bytes_come_whole(transport):
    for _ in range(3):
        assert ask(transport, "A?", soon()) == "+1"
        assert ask_block(transport, "BLOCK?", soon()) == PAYLOAD
        transport.write("BLOCK?", soon())
        assert transport.read_bytes(len(BLOCK), soon()) == BLOCK


def test_damaged_replies_are_reported(transport):
    with pytest.raises(ProtocolError, match="not text"):
        ask(transport, "BINARY?", soon())
    with pytest.raises(ProtocolError, match="20 bytes came"):
        ask_block(transport, "CUT?", soon())
    transport.write("A?", soon())
    with pytest.raises(ProtocolError, match="3 bytes, 8 were due"):
        transport.read_bytes(8, soon())
    assert ask(transport, "A?", soon()) == "+1"


def test_poll_reply_ignores_pending_service_request(server, transport):
    server.requests_before_answers = True
    for status in (96, 0, 32, 65):
        server.instrument.status_byte = status
        assert transport.serial_poll(soon()) == status


def test_service_is_waited_for(server, transport):
    assert not transport.wait_for_service(soon(0.05))
    server.instrument.service_request = False

    def later(line):
        server.instrument.service_request = line == b"GO"

    server.instrument.reply_to = later
    transport.write("GO", soon())
    assert transport.wait_for_service(soon())
    assert not transport.wait_for_service(soon(0.05))


def test_late_reply_is_never_taken_for_next(server, transport):
    server.late_s = 0.2
    with pytest.raises(BenchTimeout, match=r"'A\?' got no answer within 0.05 s"):
        ask(transport, "A?", soon(0.05))
    assert ask(transport, "B?", soon()) == "+2"


def test_clear_drops_reply_arriving_before_acknowledgement(server, transport):
    server.late_s = 0.2
    transport.write("BLOCK?", soon())
    assert transport.device_clear(soon())
    assert server.instrument.cleared == 1
    assert ask(transport, "B?", soon()) == "+2"
    assert transport.serial_poll(soon()) == 96


def test_lock_of_another_client_is_reported(server, transport):
    server.locked = True
    with pytest.raises(BenchTimeout, match="another client has locked the instrument"):
        ask(transport, "A?", soon(0.1))
    server.locked = False
    assert transport.device_clear(soon())
    assert ask(transport, "B?", soon()) == "+2"


def test_restarted_server_is_reconnected(server, transport):
    server.restart()
    with pytest.raises(LinkError):
        ask(transport, "A?", soon())
    again = open_transport(f"TCPIP::127.0.0.1::hislip0,{server.port}::INSTR")
    assert ask(again, "A?", soon()) == "+1"
    again.close()


def test_missing_or_other_server_gives_no_connection():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        with pytest.raises(LinkError, match="no INITIALIZE_RESPONSE within"):
            open_transport(f"TCPIP::127.0.0.1::hislip0,{port}::INSTR", opening_s=0.2)
    with pytest.raises(LinkError, match="no connection"):
        open_transport(f"TCPIP::127.0.0.1::hislip0,{port}::INSTR", opening_s=0.2)
    with (
        ByteServer(lambda _: b"HTTP/1.1 400 Bad Request\r\n\r\n") as other,
        pytest.raises(LinkError, match="begins no message"),
    ):
        open_transport(f"TCPIP::127.0.0.1::hislip0,{other.port}::INSTR", opening_s=0.5)
    refusal = packed(Kind.FATAL_ERROR, 4, 0, b"too many clients")
    with (
        ByteServer(lambda _: refusal) as full,
        pytest.raises(LinkError, match="'too many clients'"),
    ):
        open_transport(f"TCPIP::127.0.0.1::hislip0,{full.port}::INSTR", opening_s=0.5)


@settings(max_examples=15, deadline=None)
@given(st.binary(max_size=60))
def test_server_bytes_raise_no_other_error(noise):
    hello = packed(Kind.INITIALIZE_RESPONSE, 0, 1) + packed(Kind.ASYNC_INITIALIZE_RESPONSE)
    size = packed(Kind.ASYNC_MAXIMUM_MESSAGE_SIZE_RESPONSE)
    with ByteServer(lambda _: hello + size + noise) as one:
        began = time.monotonic()
        with pytest.raises(LashbenchError):
            open_transport(f"TCPIP::127.0.0.1::hislip0,{one.port}::INSTR", opening_s=0.05)
        assert time.monotonic() - began < 2.0


@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: driver.scheme or "preset")
def test_every_driver_measures_over_hislip(driver):
    box = simulated(driver.scheme, LinearPlant(known_gain))
    lead = f"{driver.scheme}:" if driver.scheme else ""
    with HislipServer(OnBus(box)) as server:
        analyser = open_analyser(f"{lead}TCPIP::127.0.0.1::hislip0,{server.port}::INSTR")
        assert analyser.identify().model in driver.models
        analyser.prepare(100.0, 200.0, PointSettings(1.0, 2, 3, slew_vpk_per_s=0.0))
        points = []
        for point in analyser.sweep(spaced_frequencies(120.0, 160.0, 11)):
            points.append(point)
            server.requests_before_answers = len(points) % 2 == 1
        # Its reply is late once: the source still goes off, proven.
        server.late_s = 1.3
        assert analyser.make_safe() is SourceState.CONFIRMED_OFF
        analyser.close()
    assert box.driven_v == 0.0
    for point in points:
        assert point.gain == pytest.approx(known_gain(point.frequency_hz), rel=1e-4)


@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: driver.scheme or "preset")
def test_the_gateway_restarts_while_a_sweep_runs(driver):
    """The old connection is dead; a new one finds the instrument and switches it off."""
    box = simulated(driver.scheme, LinearPlant(known_gain))
    lead = f"{driver.scheme}:" if driver.scheme else ""
    with HislipServer(OnBus(box)) as server:
        url = f"{lead}TCPIP::127.0.0.1::hislip0,{server.port}::INSTR"
        analyser = open_analyser(url)
        analyser.identify()
        analyser.prepare(100.0, 200.0, PointSettings(1.0, 2, 3, slew_vpk_per_s=0.0))
        points = analyser.sweep(spaced_frequencies(120.0, 160.0, 11))
        next(points)
        restarting = threading.Thread(target=server.restart)
        restarting.start()
        with pytest.raises(LashbenchError):
            list(points)
        restarting.join()
        assert analyser.make_safe() is SourceState.UNKNOWN
        analyser.close()
        again = open_analyser(url)
        assert again.make_safe() is SourceState.CONFIRMED_OFF
        again.close()
    assert box.driven_v == 0.0
