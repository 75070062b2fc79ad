"""A peer that talks without end, or takes nothing: every wait ends, and little of it is kept."""

import socket
import threading
import time
import tracemalloc
from contextlib import contextmanager, suppress

import pytest
from instruments.wire import MemoryLink, TinyAdapter

from daq.errors import LashbenchError
from daq.transports.base import Deadline
from daq.transports.open import open_transport
from daq.transports.prologix import PrologixTransport
from daq.transports.prologix_adapter import Adapter

TALK = {"no line feed": b"x" * 4096, "line after line": b"x\n" * 2000, "a byte at a time": b"x"}
LONGEST_S = 30.0
"""Every act below is given half a second; a starved machine takes its time."""
MOST_BYTES = 32 << 20
ACTS = {
    "write": lambda wire: wire.write("A?", Deadline.after(0.5)),
    "read": lambda wire: wire.read(Deadline.after(0.5)),
    "block": lambda wire: wire.read_block(Deadline.after(0.5)),
    "poll": lambda wire: wire.serial_poll(Deadline.after(0.5)),
    "clear": lambda wire: wire.device_clear(Deadline.after(0.5)),
}


@contextmanager
def talking(piece, *, listens=True):
    """A port at which somebody says the same over and over, or says and takes nothing."""
    over = threading.Event()

    def talk(peer):
        with peer, suppress(OSError):
            while not over.is_set():
                if listens:
                    peer.sendall(piece)
                over.wait(0.002 if len(piece) == 1 or not listens else 0.0)

    with socket.create_server(("127.0.0.1", 0)) as server:
        # What is accepted has it, too: a small buffer is soon full.
        server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)

        def accept():
            with suppress(OSError):
                while True:
                    peer, _ = server.accept()
                    threading.Thread(target=talk, args=(peer,), daemon=True).start()

        threading.Thread(target=accept, daemon=True).start()
        try:
            yield server.getsockname()[1]
        finally:
            over.set()
            server.shutdown(socket.SHUT_RDWR)


def ends(act):
    """Do it in bounded time and memory; what it raised, which is an error of ours or nothing."""
    found = []

    def run():
        try:
            act()
        except BaseException as error:
            found.append(error)

    thread = threading.Thread(target=run, daemon=True)
    tracemalloc.start()
    try:
        thread.start()
        thread.join(LONGEST_S)
        assert not thread.is_alive(), "it does not end"
        assert tracemalloc.get_traced_memory()[1] < MOST_BYTES
    finally:
        tracemalloc.stop()
    for error in found:
        if not isinstance(error, LashbenchError):
            raise error
    return found


@pytest.mark.parametrize("talk", TALK)
def test_on_a_bare_socket_every_act_ends(talk):
    with talking(TALK[talk]) as port:
        wire = open_transport(f"TCPIP::127.0.0.1::{port}::SOCKET")
        for act in ACTS.values():
            ends(lambda act=act: act(wire))
        wire.close()


@pytest.mark.parametrize("talk", TALK)
def test_endless_talker_is_no_adapter(talk):
    with talking(TALK[talk]) as port:
        (error,) = ends(
            lambda: open_transport(f"prologix-tcp:127.0.0.1:{port}?addr=11", opening_s=1.0)
        )
        assert error.exit_code == 3


@pytest.mark.parametrize("talk", TALK)
@pytest.mark.parametrize("act", ACTS)
def test_endless_adapter_talk_ends_every_act(talk, act):
    link = MemoryLink(TinyAdapter(lambda _: None))
    wire = PrologixTransport(Adapter(link, 11, Deadline.after(5.0)), "prologix:")

    def receive(deadline):
        time.sleep(0.002 if len(TALK[talk]) == 1 and not deadline.expired else 0.0)
        return b"" if len(TALK[talk]) == 1 and deadline.expired else TALK[talk]

    link.receive = receive
    ends(lambda: ACTS[act](wire))


def test_full_peer_bounds_wait_on_bare_socket():
    with talking(b"", listens=False) as port:
        wire = open_transport(f"TCPIP::127.0.0.1::{port}::SOCKET")

        def fill():
            until = time.monotonic() + LONGEST_S / 2
            while time.monotonic() < until:
                for _ in range(2000):
                    wire.write("X" * 100, Deadline.after(0.2))

        (error,) = ends(fill)
        assert "was not taken" in str(error)
        wire.close()
