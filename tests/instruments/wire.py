"""Fakes for the tests of transports and drivers: a scripted wire and a small GPIB adapter.

The scripted wire is exact in both directions: it fails on anything that the
script does not have next, and on anything of the script that was not used.
The adapter is written from the adapters' manuals, apart from the simulated
one, so that the two check each other.
"""

from __future__ import annotations

import os
import re
import select
import socket
import struct
import threading
import tty
from collections.abc import Callable
from dataclasses import dataclass, field

from daq.transports.base import Deadline, checked_line


class Script:
    """A transport that plays a written dialogue.

    One act a line: ``> message``, ``< reply``, ``# numbers of a REAL,64 block``,
    ``= status byte of a poll`` (``= none``), ``! clear`` or ``! clear (drops only)``.
    Blank lines and lines that start with ``;`` are notes.
    """

    address = "script:"

    def __init__(self, text: str) -> None:
        self.acts = [
            line.strip()
            for line in text.splitlines()
            if line.strip() and not line.strip().startswith(";")
        ]
        self.at = 0
        self.closed = False
        self.paused_s = 0.0

    def _next(self, kind: str, detail: str = "") -> str:
        assert self.at < len(self.acts), f"the script is over, but: {kind} {detail}"
        act = self.acts[self.at]
        assert act[0] == kind, f"act {self.at}: the script has {act!r}, the driver {kind} {detail}"
        self.at += 1
        return act[1:].strip()

    def write(self, line: str, deadline: Deadline) -> None:
        checked_line(line)
        assert not deadline.expired
        expected = self._next(">", line)
        assert line == expected, f"act {self.at - 1}: the script has {expected!r}"

    def read(self, deadline: Deadline) -> str:
        return self._next("<")

    def read_block(self, deadline: Deadline) -> bytes:
        numbers = [float(number) for number in self._next("#").split()]
        return struct.pack(f">{len(numbers)}d", *numbers)

    def serial_poll(self, deadline: Deadline) -> int | None:
        status = self._next("=", "poll")
        return None if status == "none" else int(status)

    def device_clear(self, deadline: Deadline) -> bool:
        return self._next("!", "clear") == "clear"

    def pause(self, seconds: float) -> None:
        self.paused_s += seconds

    def close(self) -> None:
        self.closed = True

    def finish(self) -> None:
        """Fail if any of the script is left."""
        assert self.acts[self.at :] == []


@dataclass
class TinyAdapter:
    """A Prologix-like adapter with an instrument behind it, as bytes in and bytes out.

    `instrument` takes a message and gives the reply that it queues, or None.
    """

    instrument: Callable[[bytes], bytes | None]
    version: str = "Prologix GPIB-USB Controller version 6.107"
    settings: dict[str, str] = field(
        default_factory=lambda: {"mode": "0", "auto": "1", "eoi": "0", "eos": "0", "addr": "5",
                                 "eot_enable": "1", "read_tmo_ms": "1200", "savecfg": "1",
                                 "idn": "1"}
    )  # fmt: skip
    status_byte: int | None = 0
    late_reads: int = 0
    """How many ``++read`` find the reply not ready yet."""
    piece: int = 0
    """Bytes that one ``++read`` gives before the instrument stalls; 0: all."""
    verbose: bool = False
    silent: bool = False
    queued: bytes = b""
    lines: list[bytes] = field(default_factory=list)
    messages: list[bytes] = field(default_factory=list)
    empty_reads: int = 0
    cleared: int = 0
    eeprom_writes: int = 0
    _pending: bytearray = field(default_factory=bytearray)
    _escaped: bool = False

    def feed(self, data: bytes) -> bytes:
        out = b""
        for byte in data:
            if self._escaped:
                self._pending += bytes([27, byte])
                self._escaped = False
            elif byte == 27:
                self._escaped = True
            elif byte in (10, 13):
                line, self._pending = bytes(self._pending), bytearray()
                if line and not self.silent:
                    out += self._line(line)
            else:
                self._pending.append(byte)
        return out

    def _line(self, line: bytes) -> bytes:
        self.lines.append(line)
        echo = line + b"\r\n> " if self.verbose else b""
        if line.startswith(b"++"):
            return echo + self._command(*line[2:].decode().split(" ", 1))
        # An unescaped + or ESC inside a line is dropped.
        message = re.sub(rb"\x1b(.)|\+", lambda m: m.group(1) or b"", line, flags=re.DOTALL)
        self.messages.append(message)
        reply = self.instrument(message)
        if reply is not None:
            self.queued += reply
        if self.settings["auto"] == "1":
            return echo + self._read()
        return echo

    def _command(self, name: str, value: str | None = None) -> bytes:
        if name == "ver":
            real = "AR488" if value == "real" and "idn" in self.settings else None
            return (
                (real and "AR488 GPIB controller, ver. 0.53") or self.version
            ).encode() + b"\r\n"
        if name == "read":
            return self._read()
        if name == "spoll":
            return b"" if self.status_byte is None else b"%d\r\n" % self.status_byte
        if name == "clr":
            self.cleared += 1
            self.queued = b""
            return b""
        if name == "verbose":
            self.verbose = not self.verbose
            return b"Verbose: ON\r\n" if self.verbose else b"Verbose: OFF\r\n"
        if name == "savecfg" and value is not None and "AR488" in self.version:
            self.eeprom_writes += 1
            return b""
        if name in self.settings:
            if value is None:
                return self.settings[name].encode() + b"\r\n"
            self.settings[name] = value
            return b""
        return b"Unrecognized command\r\n"

    def _read(self) -> bytes:
        if not self.queued:
            self.empty_reads += 1
            return b""
        if self.late_reads:
            self.late_reads -= 1
            return b""
        cut = self.piece or len(self.queued)
        out, self.queued = self.queued[:cut], self.queued[cut:]
        return out


class MemoryLink:
    """A link whose other end is a `TinyAdapter`; nothing ever waits."""

    name = "memory"

    def __init__(self, adapter: TinyAdapter) -> None:
        self.adapter = adapter
        self.buffer = b""
        self.closed = False

    def send(self, data: bytes, deadline: Deadline) -> None:
        self.buffer += self.adapter.feed(data)

    def receive(self, deadline: Deadline) -> bytes:
        data, self.buffer = self.buffer, b""
        return data

    def close(self) -> None:
        self.closed = True


class ByteServer:
    """One TCP connection at a time, answered by a function of the bytes that come."""

    def __init__(self, answer: Callable[[bytes], bytes | None]) -> None:
        self._answer = answer
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._stop_out, self._stop_in = os.pipe()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        while True:
            ready, _, _ = select.select([self._listener, self._stop_out], [], [])
            if self._stop_out in ready:
                return
            connection, _ = self._listener.accept()
            with connection:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                while True:
                    ready, _, _ = select.select([connection, self._stop_out], [], [])
                    if self._stop_out in ready:
                        return
                    try:
                        data = connection.recv(4096)
                        reply = self._answer(data) if data else None
                        if reply is None:  # hang up
                            break
                        connection.sendall(reply)
                    except OSError:  # the client went away with bytes unread
                        break

    def __enter__(self) -> ByteServer:
        return self

    def __exit__(self, *_: object) -> None:
        os.write(self._stop_in, b"x")
        self._thread.join()
        self._listener.close()
        os.close(self._stop_in)
        os.close(self._stop_out)


class Pty:
    """A pseudo-terminal whose far end is answered by a function of the bytes that come."""

    def __init__(self, answer: Callable[[bytes], bytes]) -> None:
        self._answer = answer
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self.device = os.ttyname(slave)
        self._slave = slave
        self._stop_out, self._stop_in = os.pipe()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def _serve(self) -> None:
        while True:
            ready, _, _ = select.select([self._master, self._stop_out], [], [])
            if self._stop_out in ready:
                return
            os.write(self._master, self._answer(os.read(self._master, 4096)))

    def __enter__(self) -> Pty:
        return self

    def unplug(self) -> None:
        """Pull the cable."""
        os.write(self._stop_in, b"x")
        self._thread.join()
        os.close(self._slave)
        os.close(self._master)
        self._master = -1

    def __exit__(self, *_: object) -> None:
        if self._master >= 0:
            self.unplug()
        os.close(self._stop_in)
        os.close(self._stop_out)


def lines_of(reply_to: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
    """From an answer per line to an answer per piece of bytes, as a raw socket server needs."""
    kept = bytearray()

    def answer(data: bytes) -> bytes:
        kept.extend(data)
        out = b""
        while b"\n" in kept:
            line, _, rest = bytes(kept).partition(b"\n")
            kept[:] = rest
            out += reply_to(line)
        return out

    return answer
