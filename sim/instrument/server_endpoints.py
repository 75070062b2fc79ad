"""The server's ends of its wires: a raw socket, an adapter behind a socket, a pseudo-terminal.

Owns what is particular to each. The loop that turns them is `sim.serve`'s.
"""

from __future__ import annotations

import errno
import os
import select
import shutil
import socket
import struct
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from daq.errors import LinkError
from sim.instrument.bus import Instrument, TalkState
from sim.instrument.gpib_adapter import FakeAdapter

__all__ = ["AdapterClient", "Cable", "Client", "Listener", "RawClient", "Terminal"]

_CHUNK = 65536
_LONGEST_LINE = 4_000_000
_MOST_UNHEARD = 4_000_000
_LIVELY_S = 0.2
_REPLUG_S = 0.5
"""How long a pulled pseudo-terminal stays away."""


class Listener:
    """A listening socket; `meet` makes a client of each connection."""

    def __init__(
        self, wire: socket.socket, meet: Callable[[socket.socket, Listener], Client]
    ) -> None:
        self.wire = wire
        self.owner: RawClient | None = None
        """Who spoke last on a raw socket: the reply is his."""
        self._meet = meet
        self._place = wire.getsockname()

    def leave(self) -> None:
        """Be nobody that could be connected to."""
        self.wire.close()

    def come_back(self) -> None:
        """Listen again, at the same port."""
        self.wire = socket.create_server(self._place)
        self.wire.setblocking(False)

    def accept(self) -> Client | None:
        """A new client, None if it has gone already."""
        try:
            wire, _address = self.wire.accept()
        except OSError:
            return None
        wire.setblocking(False)
        wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return self._meet(wire, self)


class Client:
    """Bytes in and out of one connection."""

    def __init__(self, wire: socket.socket) -> None:
        self.wire = wire
        self.closed = False
        self._in = bytearray()
        self._out = bytearray()

    def work(self, now_s: float) -> None:
        """Go on with what has come."""
        raise NotImplementedError

    def gather(self) -> None:
        """Take what has come."""
        try:
            data = self.wire.recv(_CHUNK)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        self._in += data
        self.closed = self.closed or not data

    def _flush(self) -> None:
        try:
            while self._out:
                del self._out[: self.wire.send(self._out)]
        except BlockingIOError:
            # Who asks and asks and never listens is hung up on before the memory is full.
            self.closed = self.closed or len(self._out) > _MOST_UNHEARD
        except OSError:
            self.closed = True

    @property
    def waiting(self) -> bool:
        """Whether something is left to do that no arriving byte will call for."""
        return bool(self._in or self._out)

    def close(self) -> None:
        """Let go of the connection."""
        self.wire.close()

    def reset(self) -> None:
        """Break the connection the hard way, so that the other side gets an error."""
        linger = struct.pack("ii", 1, 0)
        try:
            self.wire.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
        except OSError:
            self.closed = True


class RawClient(Client):
    """SCPI over a bare socket: lines in, replies out as soon as they are there.

    There is no way to be told to talk here, so -420 cannot arise; a query
    whose reply is still due is interrupted (-410) by the next line.
    """

    def __init__(self, wire: socket.socket, instrument: Instrument, listener: Listener) -> None:
        super().__init__(wire)
        self._instrument = instrument
        self._listener = listener
        self._held = bytearray()

    def work(self, now_s: float) -> None:
        """Feed the instrument line by line, each reply first."""
        self._take_reply()
        while self._held or b"\n" in self._in:
            if not self._held:
                # Whole lines only, so that two clients' messages never mix.
                end = self._in.find(b"\n") + 1
                self._held += self._in[:end]
                del self._in[:end]
            self._listener.owner = self
            del self._held[: self._instrument.listen(bytes(self._held))]
            self._take_reply()
            if self._held:
                break
        if len(self._in) > _LONGEST_LINE:
            self.closed = True
        self._flush()

    @property
    def _owns(self) -> bool:
        return self._listener.owner is self

    def _take_reply(self) -> None:
        while self._owns and self._instrument.reply_ready:
            talk = self._instrument.talk()
            if talk.state is not TalkState.DATA:
                return
            self._out += talk.data

    @property
    def waiting(self) -> bool:
        """Whether bytes are held back, or a reply is due."""
        return bool(self._held or self._out) or (self._owns and self._instrument.reply_due)

    def close(self) -> None:
        """[S] A gateway that loses its client clears the instrument's queues."""
        if self._owns:
            self._listener.owner = None
            self._instrument.device_clear()
        super().close()


class AdapterClient(Client):
    """A connection to an adapter; the adapter outlives it."""

    def __init__(self, wire: socket.socket, adapter: FakeAdapter) -> None:
        super().__init__(wire)
        self._adapter = adapter
        self._spoke = False

    def work(self, now_s: float) -> None:
        """Pass bytes both ways."""
        if self._in:
            self._spoke = True
            self._adapter.receive(bytes(self._in), now_s)
            self._in.clear()
        if self._spoke:
            self._out += self._adapter.take_output(now_s)
        self._flush()


class Cable(Protocol):
    """What may be behind a pseudo-terminal: an adapter, or the instrument's own interface."""

    name: str
    """Of the terminal."""

    def opened(self, now_s: float) -> None:
        """Somebody opened the port."""
        ...

    def receive(self, data: bytes, now_s: float) -> None:
        """Bytes from the host."""
        ...

    def take_output(self, now_s: float) -> bytes:
        """Bytes for the host."""
        ...

    @property
    def busy(self) -> bool:
        """Whether something is under way that time alone may end."""
        ...

    def pump(self, now_s: float) -> None:
        """Go on with what is under way."""
        ...


class Terminal:
    """A pseudo-terminal with a cable behind it, under a name that stays.

    The name is a link, as udev makes them, because a cable that is pulled and
    plugged in again comes back as another terminal.
    """

    def __init__(self, cable: Cable) -> None:
        self._cable = cable
        self._folder = Path(tempfile.mkdtemp(prefix="lashbench-"))
        self.path = str(self._folder / cable.name)
        self._master = -1
        self._open_here = False
        self._away_until = 0.0
        self._heard_s = -1.0
        self._out = bytearray()
        self._plug()

    def _plug(self) -> None:
        """Make the terminal; Linux and macOS only."""
        if not hasattr(os, "openpty"):
            raise LinkError("this system has no pseudo-terminals; serve --prologix-tcp instead")
        import tty

        master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(master, False)
        link = Path(self.path)
        link.unlink(missing_ok=True)
        link.symlink_to(os.ttyname(slave))
        # With our own end of it closed we see when the client opens and closes his.
        os.close(slave)
        self._master = master
        self._open_here = False

    def gather(self, now_s: float) -> bool:
        """Take what has come; whether anything did."""
        if self._master < 0:
            if now_s >= self._away_until:
                self._plug()
            return False
        poller = select.poll()
        poller.register(self._master, select.POLLIN)
        events = dict(poller.poll(0)).get(self._master, 0)
        if events & select.POLLHUP and not events & select.POLLIN:
            self._open_here = False
            return False
        if not self._open_here:
            self._open_here = True
            self._cable.opened(now_s)
        if not events & select.POLLIN:
            return False
        data = self._read()
        self._cable.receive(data, now_s)
        self._heard_s = now_s
        return bool(data)

    def lively(self, now_s: float) -> bool:
        """Whether a conversation is going on, so that it is worth looking often."""
        return now_s - self._heard_s < _LIVELY_S

    def _read(self) -> bytes:
        try:
            return os.read(self._master, _CHUNK)
        except BlockingIOError:
            return b""
        except OSError as error:
            if error.errno == errno.EIO:
                return b""
            raise

    def flush(self, now_s: float) -> None:
        """Send what comes from the cable, if anybody has the terminal open."""
        self._out += self._cable.take_output(now_s)
        if self._master < 0 or not self._open_here:
            self._out.clear()
            return
        try:
            while self._out:
                del self._out[: os.write(self._master, self._out)]
        except BlockingIOError:
            return
        except OSError:
            self._out.clear()

    def unplug(self, now_s: float, away_s: float = _REPLUG_S) -> None:
        """Pull the cable; it is plugged in again a little later, and is another device then."""
        # The name goes first: who hears the hang-up must not find the old device by it,
        # which the system may give to somebody else.
        Path(self.path).unlink(missing_ok=True)
        self.close_terminal()
        self._away_until = now_s + away_s

    def close_terminal(self) -> None:
        """Hang up."""
        if self._master >= 0:
            os.close(self._master)
            self._master = -1

    def close(self) -> None:
        """Hang up and remove the name."""
        self.close_terminal()
        shutil.rmtree(self._folder, ignore_errors=True)
