"""The served analyser, met as other people's programs meet it: sockets, terminals, PyVISA."""

from __future__ import annotations

import contextlib
import os
import socket
import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from instruments.known_device import known_answer

from daq.analyser import PointSettings
from daq.errors import BenchTimeout, LinkError
from daq.hp35670a import HP35670A
from daq.transports.open import open_transport
from sim.analyser35670a import Analyser35670A, Choices, LinearPlant
from sim.faults import FaultBoard, parse_fault
from sim.loopback import Loopback
from sim.serve import Server

BUSY_S = 10.0
"""What a busy machine may add to a time."""
IDENTITY = "HEWLETT-PACKARD,35670A,LASHSIM001,A.01.11"


def instrument(*faults: str, **choices: Any) -> Analyser35670A:
    board = FaultBoard([parse_fault(text) for text in faults])
    return Analyser35670A(LinearPlant(known_answer), Choices(**choices), board)


@contextlib.contextmanager
def served(*faults: str, realtime: bool = False, dialect: str = "prologix", **choices: Any):
    """A server on all wires, turning in a thread."""
    server = Server(
        instrument(*faults, **choices), realtime=realtime, tcp=0, prologix_tcp=0,
        prologix_pty=True, dialect=dialect,
    )  # fmt: skip
    with server:
        thread = threading.Thread(target=server.run)
        thread.start()
        try:
            yield server
        finally:
            server.stop()
            thread.join(10.0)
            assert not thread.is_alive()


def urls(server: Server) -> dict[str, str]:
    host, port = server.addresses["tcp"].split(":")
    return {
        "tcp": f"TCPIP::{host}::{port}::SOCKET",
        "prologix-tcp": f"prologix-tcp:{server.addresses['prologix_tcp']}",
        "prologix": f"prologix:{server.addresses['prologix_pty']}",
    }


@contextlib.contextmanager
def raw(server: Server) -> Iterator[socket.socket]:
    host, port = server.addresses["tcp"].split(":")
    with socket.create_connection((host, int(port)), timeout=5.0) as wire:
        yield wire


def line(wire: socket.socket) -> bytes:
    data = b""
    while not data.endswith(b"\n"):
        part = wire.recv(1)
        if not part:
            break
        data += part
    return data


# Raw TCP


def test_raw_tcp_speaks_lines():
    with served() as server, raw(server) as wire:
        wire.sendall(b"*IDN?\n")
        assert line(wire) == IDENTITY.encode() + b"\n"
        wire.sendall(b"*ID")
        time.sleep(0.05)
        wire.sendall(b"N?\r\n*OPT?\n")
        assert line(wire) == IDENTITY.encode() + b"\n"
        assert line(wire) == b'"1D2"\n'
        wire.sendall(b"JUNK\nSYST:ERR?\n")
        assert line(wire) == b'-113,"Undefined header"\n'


def test_server_listens_on_local_host_only():
    with served() as server:
        for name in ("tcp", "prologix_tcp"):
            assert server.addresses[name].startswith("127.0.0.1:")
            port = int(server.addresses[name].split(":")[1])
            # Another address of the same machine.
            with pytest.raises(OSError):
                socket.create_connection(("127.0.0.2", port), timeout=5.0)


def test_port_in_use_is_a_link_error():
    with served() as server:
        port = int(server.addresses["tcp"].split(":")[1])
        with pytest.raises(LinkError, match=str(port)):
            Server(instrument(), tcp=port)


def test_instrument_survives_its_clients():
    with served() as server:
        with raw(server) as wire:
            wire.sendall(b"FREQ:STEP 77\n*IDN?\n")
            line(wire)
            wire.sendall(b"*IDN?\nFREQ:ST")
        with raw(server) as wire:
            wire.sendall(b"FREQ:STEP?\n")
            assert line(wire) == b"+7.70000000000E+001\n"


def test_two_clients_get_their_own_replies():
    with served() as server, raw(server) as one, raw(server) as two:
        for _ in range(20):
            one.sendall(b"*OPT?\n")
            assert line(one) == b'"1D2"\n'
            two.sendall(b"SYST:VERS?\n")
            assert line(two) == b"1992.0\n"


def test_client_that_never_reads_is_disconnected(monkeypatch):
    monkeypatch.setattr("sim.instrument.server_endpoints._MOST_UNHEARD", 10_000)

    def ask_on(wire):
        # A connection that stays holds no more than the buffers of both its ends.
        for _ in range(500):
            wire.sendall(b"*IDN?\n" * 10_000)

    with served() as server, raw(server) as deaf, raw(server) as other:
        deaf.settimeout(30.0)
        with pytest.raises(ConnectionError):
            ask_on(deaf)
        other.sendall(b"*IDN?\n")
        assert b"35670A" in other.recv(100)


def test_sleeping_script_finds_the_sweep_done():
    with served() as server, raw(server) as wire:
        wire.sendall(
            b"*RST;*CLS\nINST:SEL SINE\nFREQ:RES:AUTO OFF\nFREQ:STAR 100;STOP 200;RES 51 PNT/SWP\n"
            b"SOUR:VOLT 1 VPK\nABOR;:INIT\n"
        )
        for pause_s in (0.5, 5.0, 30.0):  # the later ones only where the machine is busy
            time.sleep(pause_s)
            wire.sendall(b"STAT:OPER:COND?\nSYST:ERR?\n")
            condition, error = line(wire), line(wire)
            assert error == b'+0,"No error"\n'
            if condition == b"+0\n":
                break
        assert condition == b"+0\n"


def test_realtime_has_real_duration():
    with served(realtime=True) as server, raw(server) as wire:
        begin = time.monotonic()
        wire.sendall(b"*RST\n*OPC?\n")
        assert line(wire) == b"+1\n"
        assert 0.4 < time.monotonic() - begin < 1.5 + BUSY_S
        wire.sendall(
            b"INST:SEL SINE\nFREQ:RES:AUTO OFF\nFREQ:STAR 100;STOP 200;RES 3 PNT/SWP\n"
            b"VOLT1:RANG 2 VPK\nVOLT2:RANG 2 VPK\nSOUR:VOLT 1 VPK\nABOR;:INIT;*OPC?\n"
        )
        begin = time.monotonic()
        assert line(wire) == b"+1\n"
        expected = sum(10 / hz + 0.5 for hz in (100, 133.33, 166.67))
        assert -0.4 < time.monotonic() - begin - expected < 0.4 + BUSY_S


@pytest.mark.parametrize("seed", range(5))
def test_noise_on_wires_crashes_nothing(seed):
    rng = np.random.default_rng(seed)
    alphabet = np.frombuffer(b"+\x1b\r\n;:#'\"? *0129ABORINITFREQSYST\x00\xff", dtype=np.uint8)
    with served() as server:
        wires = [server.addresses["tcp"], server.addresses["prologix_tcp"]]
        for place in wires * 3:
            host, port = place.split(":")
            with socket.create_connection((host, int(port)), timeout=5.0) as wire:
                for _ in range(20):
                    wire.sendall(rng.choice(alphabet, rng.integers(1, 200)).tobytes())
        with raw(server) as wire:
            wire.sendall(b"*CLS\n*OPT?\n")
            assert line(wire).endswith(b'"1D2"\n')


# PyVISA, as a script uses it that knows nothing of this project


@pytest.fixture
def manager():
    pyvisa = pytest.importorskip("pyvisa")
    manager = pyvisa.ResourceManager("@py")
    yield manager
    manager.close()


def plain_script(analyser: Any) -> tuple[np.ndarray, np.ndarray]:
    """A sweep by the book of somebody else."""
    analyser.write("*RST")
    analyser.write("*CLS")
    analyser.write("INST:SEL SINE")
    analyser.write("FREQ:RES:AUTO OFF")
    analyser.write("FREQ:STAR 100 HZ")
    analyser.write("FREQ:STOP 180 HZ")
    analyser.write("FREQ:RES 401 PNT/SWP")
    analyser.write("CALC1:FEED 'XFR:POW:RAT 2,1'")
    analyser.write("CALC1:FORM MLIN")
    analyser.write("SOUR:VOLT 2 VPK")
    analyser.write("FORM REAL,64")
    analyser.write("ABOR;:INIT")
    while int(analyser.query("STAT:OPER:COND?")) & 16:
        time.sleep(0.01)
    x = analyser.query_binary_values("CALC1:X:DATA?", datatype="d", is_big_endian=True)
    y = analyser.query_binary_values("CALC1:DATA?", datatype="d", is_big_endian=True)
    assert analyser.query("SYST:ERR?").strip() == '+0,"No error"'
    return np.array(x), np.array(y)


def test_pyvisa_over_a_socket(manager):
    with served() as server:
        host, port = server.addresses["tcp"].split(":")
        analyser = manager.open_resource(
            f"TCPIP::{host}::{port}::SOCKET", read_termination="\n", write_termination="\n"
        )
        analyser.timeout = 5000
        assert analyser.query("*IDN?") == IDENTITY
        x, y = plain_script(analyser)
        assert y == pytest.approx([abs(known_answer(hz)) for hz in x], rel=0.02)
        analyser.close()


@pytest.mark.parametrize("wire", ["PRLGX-TCPIP", "PRLGX-ASRL"])
def test_pyvisa_through_an_adapter(manager, wire):
    with served() as server:
        host, port = server.addresses["prologix_tcp"].split(":")
        place = {
            "PRLGX-TCPIP": f"PRLGX-TCPIP0::{host}::{port}::INTFC",
            "PRLGX-ASRL": f"PRLGX-ASRL0::{server.addresses['prologix_pty']}::INTFC",
        }[wire]
        interface = manager.open_resource(place)
        interface.timeout = 5000
        analyser = manager.open_resource("GPIB0::11::INSTR")
        assert analyser.query("*IDN?").strip() == IDENTITY
        x, y = plain_script(analyser)
        assert y == pytest.approx([abs(known_answer(hz)) for hz in x], rel=0.02)
        analyser.write("*ESE 32;*SRE 32")
        analyser.write("JUNK")
        assert analyser.read_stb() == 96
        analyser.clear()
        assert "-113" in analyser.query("SYST:ERR?")
        analyser.close()
        interface.close()


# Our own driver over every wire


def measured(transport: Any) -> list[complex]:
    analyser = HP35670A(transport)
    try:
        assert analyser.identify().simulated
        analyser.prepare(100.0, 200.0, PointSettings(2.5, 5, 8))
        return [point.gain for point in analyser.sweep([100.0, 150.0, 123.5, 200.0])]
    finally:
        assert str(analyser.make_safe()) == "confirmed-off"
        analyser.close()


def test_seed_gives_same_points_on_every_wire():
    expected = measured(Loopback(instrument(seed=7)))
    assert expected == pytest.approx(
        [known_answer(hz) for hz in (100.0, 150.0, 123.5, 200.0)], rel=0.02
    )
    for wire in ("tcp", "prologix-tcp", "prologix"):
        with served(seed=7) as server:
            assert measured(open_transport(urls(server)[wire])) == expected, wire
    with served(seed=7, dialect="ar488") as server:
        assert measured(open_transport(urls(server)["prologix"])) == expected
    assert measured(Loopback(instrument(seed=8))) != expected


@pytest.mark.parametrize("wire", ["tcp", "prologix-tcp", "prologix"])
def test_dropped_connection_leaves_source_on(wire):
    """The instrument can be connected to again."""
    with served("dropped-connection:point=2") as server:
        transport = open_transport(urls(server)[wire])
        analyser = HP35670A(transport)
        analyser.prepare(100.0, 200.0, PointSettings(2.5, 5, 8))
        with pytest.raises((LinkError, BenchTimeout)):
            list(analyser.sweep([100.0, 150.0, 200.0]))
        analyser.close()
        assert server.instrument.output_vpk == 2.5
        time.sleep(1.0)
        again = HP35670A(open_transport(urls(server)[wire]))
        assert str(again.make_safe()) == "confirmed-off"
        again.close()
        assert server.instrument.output_vpk == 0


def test_terminal_name_survives_a_dropped_connection():
    with served("dropped-connection:phase=prepare") as server:
        path = server.addresses["prologix_pty"]
        assert os.path.realpath(path).startswith("/dev/")
        with raw(server) as wire:
            wire.sendall(b"*CLS\n")
            with pytest.raises(ConnectionError):
                wire.recv(1)
        # Every wire is dropped, one after the other; the name is away for half a second.
        deadline = time.monotonic() + 5.0
        while os.path.lexists(path):
            assert time.monotonic() < deadline
            time.sleep(0.005)
        while not os.path.exists(path):
            assert time.monotonic() < deadline
            time.sleep(0.01)
    assert not os.path.lexists(path)


def test_ar488_on_terminal_restarts_when_opened():
    import serial

    with served(dialect="ar488") as server:
        path = server.addresses["prologix_pty"]
        with serial.Serial(path, timeout=2.0) as port:
            assert port.read_until(b"\n") == b"AR488 starting\r\n"
            port.write(b"++addr 11\n++addr\n")
            assert port.read_until(b"\n") == b"11\r\n"
        time.sleep(0.1)
        with serial.Serial(path, timeout=2.0) as port:
            port.read_until(b"\n")
            port.write(b"++addr\n")
            assert port.read_until(b"\n") == b"1\r\n"
