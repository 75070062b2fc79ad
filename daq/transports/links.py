"""Byte pipes: a serial port or a TCP connection, with bounded reads and one report of loss.

Owns opening, reading up to a deadline, and turning every way in which a port
can die into `LinkError`. It knows nothing of messages or adapters.
"""

from __future__ import annotations

import contextlib
import os
import select
import socket
from typing import Any, Protocol

from daq.errors import BenchTimeout, LinkError
from daq.transports.base import Deadline

__all__ = ["Link", "SerialLink", "TcpLink"]

_SLICE_S = 0.05
"""How long a serial read sleeps at most before it looks at the clock and the port again."""


class Link(Protocol):
    """A pipe of bytes to an adapter."""

    @property
    def name(self) -> str:
        """What it leads to, for messages."""
        ...

    def send(self, data: bytes, deadline: Deadline) -> None:
        """Send all bytes, or raise `LinkError` or `BenchTimeout`."""
        ...

    def receive(self, deadline: Deadline) -> bytes:
        """Whatever is there, waiting for at least one byte; empty if the deadline passes."""
        ...

    def close(self) -> None:
        """Let go; may be called twice."""
        ...


class TcpLink:
    """A TCP connection.

    Raises
    ------
    LinkError
        On opening, if nobody listens there.
    """

    def __init__(self, host: str, port: int, deadline: Deadline) -> None:
        self.name = f"{host}:{port}"
        self._socket: socket.socket | None = None
        try:
            opened = socket.create_connection((host, port), timeout=deadline.remaining_s)
        except OSError as error:
            raise LinkError(
                f"{self.name}: no connection ({_reason(error)}); check host, port and power"
            ) from error
        # Small messages must not wait for the acknowledgement of the one before.
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket = opened

    @property
    def ends(self) -> tuple[str, str]:
        """Numeric addresses of this machine and of the other side."""
        connection = self._open()
        try:
            return str(connection.getsockname()[0]), str(connection.getpeername()[0])
        except OSError as error:
            raise self._lost(error) from error

    def send(self, data: bytes, deadline: Deadline) -> None:
        """Send all bytes, or raise `LinkError` or `BenchTimeout`."""
        connection = self._open()
        try:
            connection.settimeout(max(deadline.remaining_s, 1e-3))
            connection.sendall(data)
        except TimeoutError as error:
            raise BenchTimeout(
                f"{self.name}: {data!r} was not taken within {deadline.span_s:g} s"
            ) from error
        except OSError as error:
            raise self._lost(error) from error

    def receive(self, deadline: Deadline) -> bytes:
        """Whatever is there, waiting for at least one byte; empty if the deadline passes."""
        connection = self._open()
        try:
            ready, _, _ = select.select([connection], [], [], deadline.remaining_s)
            if not ready:
                return b""
            data = connection.recv(65536)
        except (OSError, ValueError) as error:
            raise self._lost(error) from error
        if not data:
            raise LinkError(f"{self.name}: the other side closed the connection")
        return data

    def close(self) -> None:
        """Let go; may be called twice."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _open(self) -> socket.socket:
        if self._socket is None:
            raise LinkError(f"{self.name}: the connection is closed")
        return self._socket

    def _lost(self, error: Exception) -> LinkError:
        return LinkError(f"{self.name}: the connection was lost ({_reason(error)})")


class SerialLink:
    """A serial port, held exclusively; also a pyserial URL such as ``socket://host:port``.

    An adapter pulled out may make the port raise, return nothing or vanish
    from the file system; all three are the same `LinkError`.

    Raises
    ------
    LinkError
        On opening, if the port does not exist or another program has it.
    """

    def __init__(self, device: str, baud: int = 115200, flow: str = "none") -> None:
        import serial

        self.name = device
        self._is_file = "://" not in device
        # pyserial reports a dying port with any of these, TypeError among them.
        self._faults: tuple[type[Exception], ...] = (serial.SerialException, OSError, TypeError)
        self._port: Any = None
        options: dict[str, Any] = {"baudrate": baud, "timeout": _SLICE_S, "write_timeout": 2.0}
        if self._is_file:
            options["exclusive"] = True
            # A pyserial URL stands for another machine's port, which has its own flow control.
            options |= {"rtscts": flow == "hardware", "xonxoff": flow == "software"}
        try:
            self._port = serial.serial_for_url(device, **options)
        except (*self._faults, ValueError) as error:
            raise LinkError(
                f"{device}: cannot be opened ({_reason(error)}); is it plugged in, is it used by "
                "another program (ModemManager, brltty, a second lashbench), may you read it?"
            ) from error

    def send(self, data: bytes, deadline: Deadline) -> None:
        """Send all bytes, or raise `LinkError` or `BenchTimeout`."""
        import serial

        port = self._open()
        try:
            port.write(data)
        except serial.SerialTimeoutException as error:
            raise BenchTimeout(f"{self.name}: {data!r} was not taken; is the adapter stuck?") from (
                error
            )
        except self._faults as error:
            raise self._lost(error) from error

    def receive(self, deadline: Deadline) -> bytes:
        """Whatever is there, waiting for at least one byte; empty if the deadline passes."""
        port = self._open()
        try:
            while True:
                if waiting := port.in_waiting:
                    return bytes(port.read(waiting))
                if deadline.expired:
                    return b""
                if first := bytes(port.read(1)):
                    return first
                if self._is_file and not os.path.exists(self.name):
                    raise LinkError(f"{self.name}: the port is gone; was the adapter unplugged?")
        except self._faults as error:
            raise self._lost(error) from error

    def close(self) -> None:
        """Let go; may be called twice."""
        port, self._port = self._port, None
        if port is not None:
            # A port that is already lost has nothing left that could be let go.
            with contextlib.suppress(*self._faults):
                port.close()

    def _open(self) -> Any:
        if self._port is None:
            raise LinkError(f"{self.name}: the port is closed")
        return self._port

    def _lost(self, error: Exception) -> LinkError:
        return LinkError(f"{self.name}: the port was lost ({_reason(error)}); was it unplugged?")


def _reason(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
