"""VISA resources: raw socket and VXI-11, each against its own server."""

import struct
import threading
import time
from contextlib import suppress

import pytest
from instruments.bench_server import simulated
from instruments.fake_analyser import known_gain
from instruments.vxi11 import (
    CLEAR,
    IO_TIMEOUT,
    READ,
    READ_STB,
    WRITE,
    Gateway,
    RestartingGateway,
    Vxi11Instrument,
)
from instruments.wire import ByteServer, lines_of

from daq.analyser import PointSettings, SourceState
from daq.drivers import DRIVERS, open_analyser
from daq.errors import BenchTimeout, LashbenchError, LinkError, ProtocolError
from daq.limits import Limits
from daq.plan import SweepPlan, spaced_frequencies
from daq.session import Session
from daq.session_request import SessionRequest
from daq.store_records import MeasurementHeader
from daq.transports.base import Deadline, ask, ask_block
from daq.transports.open import open_transport
from daq.transports.rpc import Records, accepted, parse_call, words
from daq.transports.visa import open_visa
from daq.transports.vxi11 import open_vxi11
from sim.instrument.plant import LinearPlant

PAYLOAD = struct.pack(">6d", 1.0, -2.0, 10.0, 43.0, 9.9e37, 0.0) + b"\n\r\x1b+\0#\n"
BLOCK = b"#2%d" % len(PAYLOAD) + PAYLOAD + b"\n"


def instrument(line):
    return {
        b"A?": b"+1\n",
        b"BLOCK?": BLOCK,
        b"CUT?": BLOCK[:20],
        b"LONG?": b"#3999" + PAYLOAD + b"\n",
        b"BINARY?": b"\xff\xff\n",
    }.get(line, b"")


@pytest.fixture
def raw():
    with ByteServer(lines_of(instrument)) as server:
        transport = open_transport(f"TCPIP::127.0.0.1::{server.port}::SOCKET")
        yield transport
        transport.close()


def test_a_raw_socket_answers_text_and_blocks(raw):
    for _ in range(3):
        assert ask(raw, "A?", Deadline.after(2.0)) == "+1"
        assert ask_block(raw, "BLOCK?", Deadline.after(2.0)) == PAYLOAD


def test_consecutive_commands_do_not_wait(raw):
    started = time.monotonic()
    for _ in range(20):
        raw.write("X 1", Deadline.after(1.0))
        raw.write("Y 2", Deadline.after(1.0))
        ask(raw, "A?", Deadline.after(1.0))
    # Held back by acknowledgements it would take 40 ms each.
    assert time.monotonic() - started < 0.5


def test_raw_socket_has_no_poll_or_clear(raw):
    """A clear drops the queued reply."""
    assert raw.serial_poll(Deadline.after(1.0)) is None
    raw.write("A?", Deadline.after(1.0))
    time.sleep(0.05)
    assert not raw.device_clear(Deadline.after(1.0))
    with pytest.raises(BenchTimeout):
        raw.read(Deadline.after(0.05))
    assert ask(raw, "A?", Deadline.after(1.0)) == "+1"


def test_timeout_error_names_the_act(raw):
    started = time.monotonic()
    with pytest.raises(BenchTimeout, match=r"'N\?' got no answer within 0.1 s"):
        ask(raw, "N?", Deadline.after(0.1))
    assert 0.09 < time.monotonic() - started < 0.5


@pytest.mark.parametrize("query", ["CUT?", "LONG?"])
def test_short_block_is_a_damaged_reply(raw, query):
    with pytest.raises(ProtocolError, match="cut short"):
        ask_block(raw, query, Deadline.after(0.1))


def test_text_instead_of_block_is_damaged_reply(raw):
    with pytest.raises(ProtocolError, match="should start with '#'"):
        ask_block(raw, "A?", Deadline.after(0.5))


def test_bytes_other_than_text_are_damaged_reply(raw):
    with pytest.raises(ProtocolError, match="not text"):
        ask(raw, "BINARY?", Deadline.after(0.5))


def test_closed_connection_is_lost_at_once():
    with ByteServer(lambda data: None if b"BYE" in data else b"+1\n") as server:
        transport = open_transport(f"TCPIP::127.0.0.1::{server.port}::SOCKET")
        assert ask(transport, "A?", Deadline.after(1.0)) == "+1"
        started = time.monotonic()
        with pytest.raises(LinkError, match="closed the connection"):
            ask(transport, "BYE", Deadline.after(5.0))
        with pytest.raises(LinkError):
            transport.device_clear(Deadline.after(5.0))
        with pytest.raises(LinkError):
            ask(transport, "A?", Deadline.after(5.0))
        assert time.monotonic() - started < 1.0
        transport.close()
        transport.close()


def test_connection_closed_while_waiting_ends_wait():
    hang_up = threading.Event()

    def answer(data):
        hang_up.wait(2.0)

    with ByteServer(answer) as server:
        transport = open_transport(f"TCPIP::127.0.0.1::{server.port}::SOCKET")
        timer = threading.Timer(0.1, hang_up.set)
        timer.start()
        started = time.monotonic()
        with pytest.raises(LinkError, match="closed the connection"):
            ask(transport, "A?", Deadline.after(10.0))
        assert time.monotonic() - started < 1.0
        timer.join()
        transport.close()


def test_port_without_listener_gives_no_connection():
    with ByteServer(lambda data: b"") as server:
        port = server.port
    with pytest.raises(LinkError, match="no connection"):
        open_transport(f"TCPIP::127.0.0.1::{port}::SOCKET")


def test_gpib_card_without_back_end_is_reported():
    with pytest.raises(LinkError, match="needs its maker's VISA, or linux-gpib"):
        open_transport("GPIB0::11::INSTR")


@pytest.fixture(params=[open_vxi11, open_visa], ids=["own", "visa"])
def vxi11(request):
    """Our own client, and that of the Python back end, which makers' VISA takes the place of."""
    device = Vxi11Instrument(instrument, status_byte=96)
    with ByteServer(device.feed) as server:
        transport = request.param(
            f"TCPIP::127.0.0.1,{server.port}::inst0::INSTR", Deadline.after(3.0)
        )
        yield transport, device
        transport.close()


@pytest.mark.parametrize("largest_read", [1 << 20, 7])
def test_vxi11_answers_text_and_blocks(vxi11, largest_read):
    transport, device = vxi11
    device.largest_read = largest_read
    assert ask(transport, "A?", Deadline.after(2.0)) == "+1"
    assert ask_block(transport, "BLOCK?", Deadline.after(2.0)) == PAYLOAD
    assert device.messages == [b"A?", b"BLOCK?"]


def test_bytes_without_a_header_are_counted(vxi11, raw):
    for transport in (vxi11[0], raw):
        transport.write("BLOCK?", Deadline.after(2.0))
        assert transport.read_bytes(len(BLOCK), Deadline.after(2.0)) == BLOCK
        transport.write("A?", Deadline.after(2.0))
        with pytest.raises(ProtocolError, match="3 bytes, 8 were due|was cut short"):
            transport.read_bytes(8, Deadline.after(0.3))
        transport.write("N?", Deadline.after(2.0))
        with pytest.raises(BenchTimeout):
            transport.read_bytes(8, Deadline.after(0.1))


@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: driver.scheme or "preset")
def test_every_driver_measures_through_a_gateway(driver):
    box = simulated(driver.scheme, LinearPlant(known_gain))
    lead = f"{driver.scheme}:" if driver.scheme else ""
    with ByteServer(Gateway(box).feed) as server:
        analyser = open_analyser(f"{lead}TCPIP::127.0.0.1,{server.port}::inst0::INSTR")
        assert analyser.identify().model in driver.models
        analyser.prepare(100.0, 200.0, PointSettings(1.0, 2, 3, slew_vpk_per_s=0.0))
        points = list(analyser.sweep(spaced_frequencies(120.0, 160.0, 11)))
        assert analyser.make_safe() is SourceState.CONFIRMED_OFF
        analyser.close()
    assert box.driven_v == 0.0
    assert len(points) == 11
    for point in points:
        assert point.gain == pytest.approx(known_gain(point.frequency_hz), rel=1e-4)


@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: driver.scheme or "preset")
@pytest.mark.parametrize(
    "refused",
    [
        *(pytest.param(one, marks=pytest.mark.long) for one in ((READ_STB,), (CLEAR,))),
        (READ_STB, CLEAR),
    ],
    ids=str,
)
def test_gateway_without_poll_or_clear_is_reported(store, driver, refused):
    """Error 8, operation not supported."""
    box = simulated(driver.scheme, LinearPlant(known_gain), ["truncated-block:point=9"])
    lead = f"{driver.scheme}:" if driver.scheme else ""
    plan = SweepPlan(
        spaced_frequencies(120.0, 160.0, 11), (1.0,), settle_cycles=2, integrate_cycles=3
    )
    with ByteServer(Gateway(box, errors=dict.fromkeys(refused, 8)).feed) as server:
        url = f"{lead}TCPIP::127.0.0.1,{server.port}::inst0::INSTR"
        for resume in (None, 1):
            header = MeasurementHeader("ADSS", "7", plan, url, "lashbench test")
            request = SessionRequest(
                header=header if resume is None else None, limits=(Limits("bench"),), resume=resume
            )
            analyser, told = open_analyser(url), []
            with suppress(LashbenchError):
                told += Session(analyser, store, request).run()
            analyser.close()
            assert box.driven_v == 0.0
    found = store.measurement(1)
    assert (found.state, found.source_state) == ("complete", SourceState.CONFIRMED_OFF)
    for stored in store.points(1):
        assert stored.point.gain == pytest.approx(known_gain(stored.requested_hz), rel=1e-4)
    # A driver that never polls does not miss it.
    names = {READ_STB: "serial poll", CLEAR: "device clear"}
    assert set(analyser.wire_lacks) <= {names[one] for one in refused}
    assert (CLEAR in refused) == ("device clear" in analyser.wire_lacks)
    notes = " ".join(event.text for event in store.events(1) if "wire: " in event.text)
    for lack in analyser.wire_lacks:
        assert f"no {lack}" in notes


@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: driver.scheme or "preset")
def test_restarted_gateway_ends_session_with_source_off(store, driver):
    box = simulated(driver.scheme, LinearPlant(known_gain))
    lead = f"{driver.scheme}:" if driver.scheme else ""
    plan = SweepPlan(
        spaced_frequencies(120.0, 160.0, 11), (1.0,), settle_cycles=2, integrate_cycles=3
    )
    with ByteServer(RestartingGateway(box, away_s=1.0).feed) as server:
        url = f"{lead}TCPIP::127.0.0.1,{server.port}::inst0::INSTR"
        header = MeasurementHeader("ADSS", "7", plan, url, "lashbench test")
        request = SessionRequest(header=header, limits=(Limits("bench"),))
        session = Session(open_analyser(url), store, request, reopen=lambda: open_analyser(url))
        with pytest.raises(LinkError, match="connection was lost"):
            list(session.run())
        assert box.driven_v == 0.0
        assert session.finished.source_state is SourceState.CONFIRMED_OFF
    for stored in store.points(1):
        assert stored.point.gain == pytest.approx(known_gain(stored.requested_hz), rel=1e-4)


@pytest.mark.parametrize(
    ("procedure", "act"),
    [
        (READ_STB, lambda transport: transport.serial_poll(Deadline.after(0.2))),
        (CLEAR, lambda transport: transport.device_clear(Deadline.after(0.2))),
        (WRITE, lambda transport: transport.write("A?", Deadline.after(0.2))),
        (READ, lambda transport: ask(transport, "NONE?", Deadline.after(0.2))),
    ],
    ids=["poll", "clear", "write", "read"],
)
@pytest.mark.parametrize("fault", ["hangs up", "silent", "no answer"])
def test_lost_gateway_differs_from_silent_instrument(procedure, act, fault):
    device = Vxi11Instrument(instrument)

    def feed(data):
        call = struct.unpack(">I", data[24:28])[0] if len(data) >= 28 else 0
        if call != procedure or fault == "no answer":
            return device.feed(data)
        return None if fault == "hangs up" else b""

    if fault == "no answer" and procedure != READ:
        device.errors = {procedure: IO_TIMEOUT}
    with ByteServer(feed) as server:
        transport = open_transport(f"TCPIP::127.0.0.1,{server.port}::inst0::INSTR")
        with pytest.raises(BenchTimeout if fault == "no answer" else LinkError):
            act(transport)
        with suppress(Exception):
            transport.close()


def test_instrument_locked_by_another_is_reported(vxi11):
    transport, device = vxi11
    device.errors = {WRITE: 11, READ_STB: 11}
    for act in (lambda: transport.write("A?", Deadline.after(1.0)),
                lambda: transport.serial_poll(Deadline.after(1.0))):  # fmt: skip
        with pytest.raises(LinkError, match="another client has locked the instrument"):
            act()


def test_usb_without_back_end_is_reported():
    with pytest.raises(LinkError, match="USB needs a maker's VISA, or pyusb"):
        open_transport("USB0::0x03EB::0x2065::GPIB_11_3E1F::INSTR")


def test_vxi11_polls_and_clears(vxi11):
    transport, device = vxi11
    assert transport.serial_poll(Deadline.after(2.0)) == 96
    transport.write("A?", Deadline.after(2.0))
    assert transport.device_clear(Deadline.after(2.0))
    assert device.cleared == 1
    with pytest.raises(BenchTimeout):
        transport.read(Deadline.after(0.1))


def test_vxi11_times_out_by_name(vxi11):
    transport, _ = vxi11
    with pytest.raises(BenchTimeout, match=r"'N\?' got no answer"):
        ask(transport, "N?", Deadline.after(0.1))


@pytest.mark.parametrize(("query", "fault"), [("CUT?", "20 bytes came"), ("LONG?", "were due")])
def test_vxi11_states_received_length_of_block(vxi11, query, fault):
    with pytest.raises(ProtocolError, match=fault):
        ask_block(vxi11[0], query, Deadline.after(0.5))


def test_vxi11_without_anybody_there_is_no_connection():
    with ByteServer(lambda data: b"") as server:
        port = server.port
    with pytest.raises(LinkError, match="cannot be opened"):
        open_transport(f"TCPIP::127.0.0.1,{port}::inst0::INSTR", opening_s=1.0)


def test_call_that_gateway_leaves_open_is_aborted():
    """Its link keeps the bus otherwise, and the next session waits behind it."""
    aborted, records = [], Records()

    def abort(data):
        records.feed(data)
        call = parse_call(records.take())
        aborted.append((call.program, call.procedure, call.arguments.whole()))
        return accepted(call, words(0))

    device = Vxi11Instrument(instrument)

    def core(data):
        read = len(data) >= 28 and struct.unpack(">I", data[24:28])[0] == READ
        return b"" if read else device.feed(data)

    with ByteServer(abort) as side, ByteServer(core) as server:
        device.abort_port = side.port
        transport = open_transport(f"TCPIP::127.0.0.1,{server.port}::inst0::INSTR")
        with pytest.raises(BenchTimeout, match=r"'N\?' got no answer"):
            ask(transport, "N?", Deadline.after(0.1))
        # The connection is of use again.
        assert transport.serial_poll(Deadline.after(1.0)) == 0
        transport.close()
    assert aborted == [(0x0607B0, 1, 7)]


@pytest.mark.parametrize(("procedure", "error"), [(25, 8), (25, 6), (20, 8)], ids=str)
def test_gateway_without_service_requests_is_polled(procedure, error):
    device = Vxi11Instrument(instrument, status_byte=96)
    device.errors = {25: 0, 20: 0} | {procedure: error}
    with ByteServer(device.feed) as server:
        transport = open_transport(f"TCPIP::127.0.0.1,{server.port}::inst0::INSTR")
        assert not transport.wait_for_service(Deadline.after(5.0))
        assert transport.lacks == ["service requests"]
        assert transport.serial_poll(Deadline.after(1.0)) == 96
        transport.close()
