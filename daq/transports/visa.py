"""An instrument named by a VISA resource: VXI-11, or GPIB where a back end exists.

Owns messages that carry their own end, and the faults of the Python back end that
would break the promise of bounded waits. A bare TCP stream is not for it: the back
end waits there as long as bytes come (`daq.transports.stream`). It speaks no SCPI.
"""

from __future__ import annotations

import time
from contextlib import suppress
from typing import Any

from daq.errors import BenchTimeout, LinkError, ProtocolError
from daq.transports.base import KEPT_LIMIT_BYTES, Deadline, block_of, checked_line

__all__ = ["VisaTransport", "load_backend", "open_visa"]

_LEAST_MS = 1
"""VISA takes 0 for "do not wait at all"."""

_CHUNK_BYTES = 20 * 1024


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

    backend = _backend_of(resource_name)
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


def load_backend(resource_name: str) -> None:
    """Import what opening that resource will need, as far as it is there; nothing is opened."""
    import pyvisa

    with suppress(Exception):  # what is not there is told when it is opened
        pyvisa.ResourceManager(_backend_of(resource_name))
    _rpc_errors()


def _backend_of(resource_name: str) -> str:
    return "@py" if resource_name.upper().startswith("TCPIP") else ""


class VisaTransport:
    """Messages over an open PyVISA resource; see `Transport`."""

    def __init__(self, resource: Any, address: str) -> None:
        from pyvisa import constants, errors

        self.address = address
        self._resource = resource
        self._waiting = "nothing"
        self._timed_out = constants.StatusCode.error_timeout
        self._goes_on = constants.StatusCode.success_max_count_read
        self._harmless = (self._goes_on, constants.StatusCode.success_device_not_present)
        self._visa_error = errors.VisaIOError
        self._faults: tuple[type[Exception], ...] = (
            errors.VisaIOError,
            errors.InvalidSession,
            OSError,
            EOFError,
            *_rpc_errors(),
        )

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
        message = self._message(deadline)
        return block_of(message, f"{self.address}: the block that answers {self._waiting!r}")

    def read_bytes(self, count: int, deadline: Deadline) -> bytes:
        """A reply of so many bytes, which is a whole message."""
        message = self._message(deadline)
        if len(message) != count:
            raise ProtocolError(
                f"{self.address}: the reply to {self._waiting!r} has {len(message)} bytes, "
                f"{count} were due"
            )
        return message

    def serial_poll(self, deadline: Deadline) -> int:
        """The status byte."""
        self._waiting = "serial poll"
        try:
            self._bound(deadline)
            return int(self._resource.read_stb())
        except self._faults as error:
            raise self._fault(error, deadline) from error

    def device_clear(self, deadline: Deadline) -> bool:
        """Clear the instrument."""
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
        self._resource.close()

    # Reading

    def _message(self, deadline: Deadline) -> bytes:
        """One message, up to its own end; one without an end is refused."""
        message, status = bytearray(), self._goes_on
        try:
            with self._resource.ignore_warning(*self._harmless):
                while status == self._goes_on:
                    self._bound(deadline)
                    part, status = self._resource.visalib.read(self._resource.session, _CHUNK_BYTES)
                    message += part
                    if len(message) > KEPT_LIMIT_BYTES:
                        raise ProtocolError(
                            f"{self.address}: the reply to {self._waiting!r} has more than "
                            f"{KEPT_LIMIT_BYTES} bytes and no end"
                        )
        except self._faults as error:
            raise self._fault(error, deadline) from error
        return bytes(message)

    def _bound(self, deadline: Deadline) -> None:
        self._resource.timeout = max(_LEAST_MS, int(deadline.remaining_s * 1000))

    def _fault(self, error: Exception, deadline: Deadline) -> Exception:
        if isinstance(error, TimeoutError) or (
            isinstance(error, self._visa_error) and error.error_code == self._timed_out
        ):
            return BenchTimeout(
                f"{self.address}: {self._waiting!r} got no answer within {deadline.span_s:g} s; "
                "is the instrument switched on and at this address?"
            )
        return LinkError(
            f"{self.address}: the connection was lost at {self._waiting!r} "
            f"({' '.join(str(error).split()) or type(error).__name__})"
        )


def _rpc_errors() -> tuple[type[Exception], ...]:
    # The Python back end lets its own RPC errors through; a maker's VISA has none.
    try:
        from pyvisa_py.protocols.rpc import RPCError
    except ImportError:
        return ()
    return (RPCError,)
