"""Simulated instruments behind VXI-11 and HiSLIP gateways, met by our drivers, PyVISA and bytes."""

import socket
import struct
import time
from contextlib import ExitStack, closing, suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from instruments.bench_server import GATEWAYS, served, simulated
from instruments.fake_analyser import known_gain

from daq.analyser import PointSettings, SourceState
from daq.drivers import DRIVERS, open_analyser
from daq.errors import BenchTimeout, LinkError
from daq.plan import spaced_frequencies
from daq.transports.base import Deadline, ask
from daq.transports.hislip import HEADER, Kind, packed
from daq.transports.open import open_transport
from daq.transports.rpc import Records, opaque, packed_call, parse_call, parse_reply, words
from sim.instrument.plant import LinearPlant

CORE, ABORT = 0x0607AF, 0x0607B0
CREATE, WRITE, READ, STATUS, CLEAR, LOCK, UNLOCK, DESTROY = 10, 11, 12, 13, 15, 18, 19, 23
ENABLE, CONNECT, DISCONNECT = 20, 25, 26
LOCALHOST = 0x7F000001
HZ = spaced_frequencies(120.0, 160.0, 11)


def box(driver="", *faults):
    return simulated(driver, LinearPlant(known_gain), faults)


def place(url):
    """Host and port in the address of a gateway."""
    return "127.0.0.1", int("".join(c for c in url.split(",")[1].split("::")[0]))


@pytest.fixture
def wires():
    with ExitStack() as stack:
        yield lambda where: stack.enter_context(socket.create_connection(where, 10.0))


class Caller:
    """Remote procedure calls by hand."""

    def __init__(self, wire, program=CORE):
        self.wire = wire
        self._records, self._program, self._number = Records(), program, 0

    def send(self, procedure, arguments):
        self._number += 1
        self.wire.sendall(packed_call(self._number, self._program, procedure, arguments))

    def result(self):
        while (record := self._records.take()) is None:
            data = self.wire.recv(4096)
            assert data, "hung up"
            self._records.feed(data)
        number, result = parse_reply(record)
        assert number == self._number
        return result

    def call(self, procedure, arguments):
        self.send(procedure, arguments)
        return self.result()

    def linked(self, locks=0):
        found = self.call(CREATE, words(1, locks, 200) + opaque(b"gpib0,11"))
        assert found.whole() == 0
        return found.whole(), found.whole()

    def write(self, link, text, flags=8):
        return self.call(WRITE, words(link, 500, 100, flags) + opaque(text)).whole()

    def read(self, link, size=4096, patience_ms=500, flags=0, end=0):
        found = self.call(READ, words(link, size, patience_ms, 100, flags, end))
        return found.whole(), found.whole(), found.bytes()


@pytest.mark.parametrize("wire", GATEWAYS)
@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: driver.scheme or "preset")
def test_every_driver_measures_alike_through_gateways(driver, wire):
    found = {}
    for way in ("tcp", wire):
        instrument = box(driver.scheme)
        with served(instrument, way, driver.scheme) as url:
            analyser = open_analyser(url)
            analyser.prepare(100.0, 200.0, PointSettings(1.0, 2, 3, slew_vpk_per_s=0.0))
            found[way] = [point.gain for point in analyser.sweep(HZ)]
            assert analyser.make_safe() is SourceState.CONFIRMED_OFF
            analyser.close()
        assert instrument.driven_v == 0.0
    assert found[wire] == found["tcp"]


@pytest.mark.parametrize("name", ["vxi11", "hislip"])
def test_pyvisa_queries_polls_and_clears(name):
    pyvisa = pytest.importorskip("pyvisa")
    manager = pyvisa.ResourceManager("@py")
    with served(box(), name) as url:
        analyser = manager.open_resource(url)
        analyser.timeout = 5000
        assert "35670A" in analyser.query("*IDN?")
        # The Python back end takes a service request for the answer to its poll on HiSLIP.
        analyser.write("*ESE 32;*SRE 32" if name == "vxi11" else "*ESE 32")
        analyser.write("JUNK")
        assert analyser.read_stb() == (96 if name == "vxi11" else 32)
        analyser.clear()
        assert "-113" in analyser.query("SYST:ERR?")
        analyser.close()
    manager.close()


@pytest.mark.parametrize("wire", GATEWAYS)
@pytest.mark.parametrize(
    ("driver", "fault"),
    [
        ("", "link-away:point=3,seconds=0.3"),
        # The sweep goes on by itself, and so does what restarts the gateway.
        ("sr785", "link-away:point=3,times=3,seconds=0.3"),
    ],
)
def test_restarted_gateway_is_reconnected_and_made_safe(wire, driver, fault):
    instrument = box(driver, fault)
    with served(instrument, wire, driver) as url:
        analyser = open_analyser(url)
        analyser.prepare(100.0, 200.0, PointSettings(1.0, 2, 3, slew_vpk_per_s=0.0))
        began = time.monotonic()
        with pytest.raises(LinkError):
            list(analyser.sweep(HZ))
        analyser.close()
        assert driver or instrument.driven_v > 0.0  # a sweep that goes on by itself has ended
        while time.monotonic() - began < 10.0:
            with suppress(LinkError):
                again = open_analyser(url)
                break
            time.sleep(0.05)
        assert again.make_safe() is SourceState.CONFIRMED_OFF
        again.close()
    assert instrument.driven_v == 0.0


@pytest.mark.parametrize("wire", GATEWAYS)
def test_late_reply_is_awaited_silence_is_reported(wire):
    with served(box("", "slow-reply:point=0,seconds=0.3"), wire) as url:
        transport = open_transport(url)
        assert "35670A" in ask(transport, "*IDN?", Deadline.after(5.0))
        transport.close()
    with served(box("", "silence:point=0"), wire) as url:
        transport = open_transport(url)
        with pytest.raises(BenchTimeout):
            ask(transport, "*IDN?", Deadline.after(0.3))
        with pytest.raises(BenchTimeout):
            transport.serial_poll(Deadline.after(0.3))
        transport.close()


def test_vxi11_reads_pieces_up_to_a_character(wires):
    with served(box(), "vxi11") as url:
        caller = Caller(wires(place(url)))
        link, _ = caller.linked()
        assert caller.write(link, b"*ID", flags=0) == 0
        assert caller.write(link, b"N?\n") == 0
        assert caller.read(link, size=7) == (0, 1, b"HEWLETT")
        assert caller.read(link, flags=128, end=ord(",")) == (0, 2, b"-PACKARD,")
        error, reason, rest = caller.read(link)
        assert (error, reason) == (0, 4)
        assert rest.startswith(b"35670A")
        began = time.monotonic()
        assert caller.read(link, patience_ms=200) == (15, 0, b"")
        assert 0.15 < time.monotonic() - began < 5.0


def test_vxi11_abort_ends_only_a_read(wires):
    with served(box(), "vxi11") as url:
        caller = Caller(wires(place(url)))
        link, abort_port = caller.linked()
        aborter = Caller(wires(("127.0.0.1", abort_port)), ABORT)
        caller.send(READ, words(link, 100, 60_000, 0, 0, 0))
        time.sleep(0.1)
        began = time.monotonic()
        assert aborter.call(1, words(link)).whole() == 0
        assert caller.result().whole() == 23
        assert time.monotonic() - began < 5.0
        assert aborter.call(1, words(link + 99)).whole() == 4
        assert aborter.call(1, words(link)).whole() == 0  # with nothing under way
        assert caller.write(link, b"*OPT?\n") == 0
        assert caller.read(link) == (0, 4, b'"1D2"\n')


def test_vxi11_lock_ends_with_its_link(wires):
    with served(box(), "vxi11") as url:
        one, two = Caller(wires(place(url))), Caller(wires(place(url)))
        first, _ = one.linked()
        second, _ = two.linked()
        assert one.call(LOCK, words(first, 0, 0)).whole() == 0
        assert two.write(second, b"*CLS\n") == 11
        assert two.write(second, b"*CLS\n", flags=9) == 11  # it waits 0.1 s for the lock
        assert two.call(UNLOCK, words(second)).whole() == 12
        with closing(open_transport(url)) as transport, pytest.raises(LinkError, match="locked"):
            ask(transport, "*IDN?", Deadline.after(1.0))
        assert one.call(UNLOCK, words(first)).whole() == 0
        assert two.write(second, b"*CLS\n") == 0
        assert one.call(LOCK, words(first, 0, 0)).whole() == 0
        one.wire.close()
        deadline = time.monotonic() + 5.0
        while two.write(second, b"*CLS\n") and time.monotonic() < deadline:
            time.sleep(0.02)
        assert two.write(second, b"*CLS\n") == 0
        assert two.write(first, b"*CLS\n") == 4  # a link that is gone


def test_vxi11_reports_service_requests_by_interrupt_channel(wires):
    with served(box(), "vxi11") as url, socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(5.0)
        port = listener.getsockname()[1]
        caller = Caller(wires(place(url)))
        link, _ = caller.linked()
        assert caller.call(DISCONNECT, b"").whole() == 6
        for host, program, family, error in (
            (0x08080808, 0x0607B1, 0, 6),  # another machine than the client's
            (LOCALHOST, 0x0607B1, 1, 8),  # UDP
            (LOCALHOST, 0x0607B1, 0, 0),
            (LOCALHOST, 0x0607B1, 0, 29),
        ):
            assert caller.call(CONNECT, words(host, port, program, 1, family)).whole() == error
        wire, _ = listener.accept()
        wire.settimeout(5.0)
        told = Records()
        with wire:
            assert caller.call(ENABLE, words(link + 9, 1) + opaque(b"")).whole() == 4
            assert caller.call(ENABLE, words(link, 1) + opaque(b"mine")).whole() == 0
            for _ in range(2):
                caller.write(link, b"*ESE 32;*SRE 32;*CLS;JUNK\n")
                while (record := told.take()) is None:
                    told.feed(wire.recv(4096))
                call = parse_call(record)
                assert (call.program, call.procedure) == (0x0607B1, 30)
                assert call.arguments.bytes() == b"mine"
                assert caller.call(STATUS, words(link, 0, 100, 500)).whole() == 0
            assert caller.call(ENABLE, words(link, 0) + opaque(b"")).whole() == 0
            caller.write(link, b"*CLS;JUNK\n")
            wire.settimeout(0.2)
            with pytest.raises(TimeoutError):
                wire.recv(1)
            assert caller.call(DISCONNECT, b"").whole() == 0
            wire.settimeout(5.0)
            assert wire.recv(1) == b""


def test_service_is_waited_for_over_vxi11():
    with served(box(), "vxi11") as url, closing(open_transport(url)) as transport:
        assert not transport.wait_for_service(Deadline.after(0.05))
        for _ in range(2):
            transport.write("*ESE 32;*SRE 32;*CLS;JUNK", Deadline.after(2.0))
            assert transport.wait_for_service(Deadline.after(5.0))
            assert transport.serial_poll(Deadline.after(2.0)) == 96
            assert not transport.wait_for_service(Deadline.after(0.05))
        assert "35670A" in ask(transport, "*CLS;*IDN?", Deadline.after(5.0))


class Hislip:
    """Both connections of a session, by hand."""

    def __init__(self, connect, where):
        self.sync = connect(where)
        self.sync.sendall(packed(Kind.INITIALIZE, 0, 0x0100 << 16, b"hislip0"))
        number = self.get(self.sync)[2] & 0xFFFF
        self.aside = connect(where)
        self.aside.sendall(packed(Kind.ASYNC_INITIALIZE, 0, number))
        assert self.get(self.aside)[0] == Kind.ASYNC_INITIALIZE_RESPONSE

    @staticmethod
    def get(wire):
        head = wire.recv(HEADER.size, socket.MSG_WAITALL)
        _, kind, control, parameter, length = HEADER.unpack(head)
        return kind, control, parameter, wire.recv(length, socket.MSG_WAITALL) if length else b""


def test_hislip_interrupts_requests_service_and_locks(wires):
    with served(box(), "hislip") as url:
        one = Hislip(wires, place(url))
        one.sync.sendall(packed(Kind.DATA_END, 0, 2, b"*ESE 32;*SRE 32;JUNK\n"))
        assert one.get(one.aside)[:2] == (Kind.ASYNC_SERVICE_REQUEST, 64)
        one.aside.sendall(packed(Kind.ASYNC_STATUS_QUERY, 0, 2))
        assert one.get(one.aside)[1] & 96 == 96
        one.sync.sendall(packed(Kind.DATA_END, 0, 4, b"*OPT?\n"))
        assert one.get(one.sync) == (Kind.DATA_END, 0, 4, b'"1D2"\n')
        two = Hislip(wires, place(url))
        one.aside.sendall(packed(Kind.ASYNC_LOCK, 1, 0))
        assert one.get(one.aside)[:2] == (Kind.ASYNC_LOCK_RESPONSE, 1)
        two.aside.sendall(packed(Kind.ASYNC_LOCK, 1, 100))
        assert two.get(two.aside)[:2] == (Kind.ASYNC_LOCK_RESPONSE, 0)
        two.sync.sendall(packed(Kind.DATA_END, 0, 2, b"SYST:VERS?\n"))
        two.sync.settimeout(0.3)
        with pytest.raises(TimeoutError):
            two.get(two.sync)
        two.sync.settimeout(10.0)
        one.sync.close()  # its lock goes with it
        assert two.get(two.sync)[3] == b"1992.0\n"
        two.sync.sendall(struct.pack(">2sBBIQ", b"HS", 99, 0, 0, 0))
        assert two.get(two.sync)[0] == Kind.ERROR


@pytest.mark.parametrize("wire", GATEWAYS)
@settings(max_examples=20, deadline=None)
@given(
    data=st.lists(
        st.one_of(
            st.binary(max_size=60),
            st.builds(
                lambda procedure, body: packed_call(1, CORE, procedure, body),
                st.integers(0, 30),
                st.binary(max_size=40),
            ),
            st.builds(
                lambda kind, control, number, body: packed(kind, control, number, body),
                st.integers(0, 30),
                st.integers(0, 255),
                st.integers(0, 1 << 31),
                st.binary(max_size=40),
            ),
        ),
        max_size=6,
    )
)
def test_garbage_affects_no_other_client(gateways, wire, data):
    url = gateways[wire]
    with socket.create_connection(place(url), 5.0) as noisy, suppress(ConnectionError):
        for part in data:
            noisy.sendall(part)
    transport = open_transport(url)
    assert "35670A" in ask(transport, "*IDN?", Deadline.after(5.0))
    transport.close()


@pytest.fixture(scope="module")
def gateways():
    with served(box(), "vxi11") as one, served(box(), "hislip") as two:
        yield {"vxi11": one, "hislip": two}
