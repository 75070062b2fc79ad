"""An instrument named by a VISA resource: TCP socket, VXI-11, or GPIB where a back end exists.

Owns the differences between messages that carry their own end (GPIB, VXI-11)
and a bare TCP stream, and the faults of the Python back end that would break
the promise of bounded waits. It speaks no SCPI.
"""

from __future__ import annotations

import os
import select
import socket
import time
from typing import Any

from daq.errors import BenchTimeout, LinkError, ProtocolError
from daq.transports.base import Deadline, block_of, checked_line, take_block

__all__ = ["VisaTransport", "open_visa"]

_LEAST_MS = 1
"""VISA takes 0 for "do not wait at all"."""


def open_visa(resource_name: str, deadline: Deadline) -> VisaTransport:
    """Open a VISA resource.

    The Python back end serves TCPIP; for GPIB a maker's VISA is taken where
    one is installed, else the Python back end, which needs linux-gpib.

    Raises
    ------
    LinkError
        If there is no back end for it, or nothing answers there.
    """
    import pyvisa

    backend = "@py" if resource_name.upper().startswith("TCPIP") else ""
    try:
        manager = pyvisa.ResourceManager(backend)
        resource = manager.open_resource(
            resource_name, open_timeout=max(_LEAST_MS, int(deadline.remaining_s * 1000))
        )
    except Exception as error:  # the Python back end raises bare Exception, ValueError, OSError
        advice = "check address, power and cable"
        if not backend:
            advice += "; a GPIB card needs its maker's VISA, or linux-gpib with gpib-ctypes"
        reason = " ".join(str(error).split()) or type(error).__name__
        raise LinkError(f"{resource_name}: cannot be opened ({reason}); {advice}") from error
    try:
        return VisaTransport(resource, resource_name)
    except LinkError:
        resource.close()
        raise


class VisaTransport:
    """Messages over an open PyVISA resource; see `Transport`."""

    def __init__(self, resource: Any, address: str) -> None:
        from pyvisa import constants, errors

        self.address = address
        self._resource = resource
        self._waiting = "nothing"
        self._timed_out = constants.StatusCode.error_timeout
        self._visa_error = errors.VisaIOError
        self._faults: tuple[type[Exception], ...] = (
            errors.VisaIOError,
            errors.InvalidSession,
            OSError,
            EOFError,
            *_rpc_errors(),
        )
        self._stream = _Stream(resource, address) if address.upper().endswith("SOCKET") else None

    def write(self, line: str, deadline: Deadline) -> None:
        """Send one message, line feed and end included."""
        data = checked_line(line) + b"\n"
        self._waiting = line
        try:
            self._bound(deadline)
            self._resource.write_raw(data)
        except self._faults as error:
            raise self._fault(error, deadline) from error

    def read(self, deadline: Deadline) -> str:
        """One text reply, without terminator."""
        message = self._message(deadline)
        try:
            return message.decode("ascii").strip()
        except UnicodeDecodeError as error:
            raise ProtocolError(
                f"{self.address}: the reply to {self._waiting!r} is not text: {message[:60]!r}"
            ) from error

    def read_block(self, deadline: Deadline) -> bytes:
        """The payload of one definite-length block."""
        if self._stream is not None:
            self._first_byte(deadline)
            return take_block(lambda count: self._exactly(count, deadline))
        message = self._message(deadline)
        return block_of(message, f"{self.address}: the block that answers {self._waiting!r}")

    def serial_poll(self, deadline: Deadline) -> int | None:
        """The status byte; None on a bare socket, which has no such thing."""
        if self._stream is not None:
            return None
        self._waiting = "serial poll"
        try:
            self._bound(deadline)
            return int(self._resource.read_stb())
        except self._faults as error:
            raise self._fault(error, deadline) from error

    def device_clear(self, deadline: Deadline) -> bool:
        """Clear the instrument; on a bare socket drop what lies unread and return False."""
        if self._stream is not None:
            self._stream.drop_unread()
            return False
        self._waiting = "device clear"
        try:
            self._bound(deadline)
            self._resource.clear()
        except self._faults as error:
            raise self._fault(error, deadline) from error
        return True

    def pause(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(seconds)

    def close(self) -> None:
        """Close the resource; the resource manager is shared and stays open."""
        if self._stream is not None:
            self._stream.close()
        self._resource.close()

    # Reading

    def _message(self, deadline: Deadline) -> bytes:
        if self._stream is not None:
            self._first_byte(deadline)
        try:
            self._bound(deadline)
            return bytes(self._resource.read_raw())
        except self._faults as error:
            raise self._fault(error, deadline, begun=self._stream is not None) from error

    def _exactly(self, count: int, deadline: Deadline) -> bytes:
        try:
            self._bound(deadline)
            return bytes(self._resource.read_bytes(count))
        except self._faults as error:
            raise self._fault(error, deadline, begun=True) from error

    def _first_byte(self, deadline: Deadline) -> None:
        if self._stream is not None and not self._stream.wait(deadline):
            raise self._silent(deadline)

    def _bound(self, deadline: Deadline) -> None:
        self._resource.timeout = max(_LEAST_MS, int(deadline.remaining_s * 1000))

    def _silent(self, deadline: Deadline) -> BenchTimeout:
        return BenchTimeout(
            f"{self.address}: {self._waiting!r} got no answer within {deadline.span_s:g} s; "
            "is the instrument switched on and at this address?"
        )

    def _fault(self, error: Exception, deadline: Deadline, begun: bool = False) -> Exception:
        late = isinstance(error, TimeoutError) or (
            isinstance(error, self._visa_error) and error.error_code == self._timed_out
        )
        if late and begun:
            return ProtocolError(
                f"{self.address}: the reply to {self._waiting!r} began and was cut short; "
                f"its end did not come within {deadline.span_s:g} s"
            )
        if late:
            return self._silent(deadline)
        return LinkError(
            f"{self.address}: the connection was lost at {self._waiting!r} "
            f"({' '.join(str(error).split()) or type(error).__name__})"
        )


class _Stream:
    """What the Python back end leaves out for a bare TCP socket.

    It reports a port on which nobody listens as open, spins on a connection
    that the other side has closed until the time-out and then calls it one,
    and its `clear` does not return then. So the socket beneath is asked first.
    """

    def __init__(self, resource: Any, address: str) -> None:
        self._address = address
        self._session = resource.visalib.sessions[resource.session]
        wire: socket.socket = self._session.interface
        self._socket: socket.socket | None = wire
        reason = wire.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if reason:
            raise LinkError(
                f"{address}: no connection ({os.strerror(reason)}); check host, port and power"
            )
        # Small messages must not wait for the acknowledgement of the one before; the
        # back end knows the attribute but cannot set it.
        wire.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        resource.read_termination = "\n"

    def wait(self, deadline: Deadline) -> bool:
        """Wait for a first byte; False if the deadline passes; `LinkError` if the peer is gone."""
        if self._socket is None:
            raise LinkError(f"{self._address}: the connection is closed")
        if self._session._pending_buffer:
            return True
        try:
            ready, _, _ = select.select([self._socket], [], [], deadline.remaining_s)
            if ready and not self._socket.recv(1, socket.MSG_PEEK):
                raise LinkError(f"{self._address}: the other side closed the connection")
        except OSError as error:
            raise LinkError(f"{self._address}: the connection was lost ({error})") from error
        return bool(ready)

    def drop_unread(self) -> None:
        """Forget every byte that has come so far, without waiting for more."""
        self._session._pending_buffer.clear()
        while self._socket is not None and self.wait(Deadline.after(0.0)):
            self._socket.recv(65536)

    def close(self) -> None:
        """Let go of the borrowed socket; the session closes it."""
        self._socket = None


def _rpc_errors() -> tuple[type[Exception], ...]:
    # The Python back end lets its own RPC errors through; a maker's VISA has none.
    try:
        from pyvisa_py.protocols.rpc import RPCError
    except ImportError:
        return ()
    return (RPCError,)
