"""An instrument named by a VISA resource: VXI-11, or GPIB or USB where a back end exists.

Owns messages that carry their own end, and the faults of the Python back end that
would break the promise of bounded waits. A bare TCP stream is not for it: the back
end waits there as long as bytes come (`daq.transports.stream`). It speaks no SCPI.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar

from daq.errors import BenchTimeout, LinkError, ProtocolError
from daq.transports.base import KEPT_LIMIT_BYTES, Deadline, checked_line
from daq.transports.messages import MessageReader

__all__ = ["VisaTransport", "load_backend", "open_visa"]

_GRACE_S = 1.0
"""How much longer than the bound the Python back end waits for what a gateway says."""
_LEAST_MS = 1
"""VISA takes 0 for "do not wait at all"."""

_CHUNK_BYTES = 20 * 1024
_POLL, _CLEAR = "serial poll", "device clear"

_NEEDS = {
    "GPI": "; a GPIB card needs its maker's VISA, or linux-gpib with gpib-ctypes",
    "USB": "; USB needs a maker's VISA, or pyusb with libusb, and the right to open the device",
}
"""What is needed beside pyvisa-py, by the beginning of a resource's name."""

_Result = TypeVar("_Result")


def open_visa(resource_name: str, deadline: Deadline) -> VisaTransport:
    """Open a VISA resource.

    The Python back end serves TCPIP; for GPIB and USB a maker's VISA is taken where
    one is installed, else the Python back end, which needs linux-gpib or pyusb.

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
        advice += _NEEDS.get(resource_name.upper()[:3], "")
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


class VisaTransport(MessageReader):
    """Messages over an open PyVISA resource; see `Transport`."""

    def __init__(self, resource: Any, address: str) -> None:
        from pyvisa import constants, errors

        super().__init__(address)
        self._resource = resource
        self._timed_out = constants.StatusCode.error_timeout
        self._refused = (
            constants.StatusCode.error_nonsupported_operation,
            constants.StatusCode.error_nonimplemented_operation,
        )
        self._io_error = constants.StatusCode.error_io
        self._locked = constants.StatusCode.error_resource_locked
        self.lacks: list[str] = []
        """What this way to the instrument turned out not to have, in words."""
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

    def serial_poll(self, deadline: Deadline) -> int | None:
        """The status byte; None where the gateway or adapter has no serial poll."""
        return self._if_there_is(_POLL, lambda: int(self._resource.read_stb()), deadline)

    def device_clear(self, deadline: Deadline) -> bool:
        """Clear the instrument; False where the gateway or adapter cannot.

        Nothing is read then: what the instrument still has to say is lost with the next message,
        and a reply that the gateway keeps is told by its content.
        """
        return self._if_there_is(_CLEAR, self._cleared, deadline) is not None

    def _cleared(self) -> bool:
        self._resource.clear()
        return True

    def _if_there_is(
        self, what: str, action: Callable[[], _Result], deadline: Deadline
    ) -> _Result | None:
        """Do what not every gateway can; None, from then on at once, where it cannot."""
        if what in self.lacks:
            return None
        self._waiting = what
        try:
            self._bound(deadline)
            return action()
        except NotImplementedError:
            self.lacks.append(what)
        except self._faults as error:
            if getattr(error, "error_code", None) not in self._refused:
                raise self._fault(error, deadline) from error
            self.lacks.append(what)
        return None

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
        if isinstance(error, TimeoutError):
            # A gateway says itself when the instrument has no answer. The Python back end waits a
            # second longer for that, and takes one that hung up in a poll or clear for silent.
            return LinkError(
                f"{self.address}: the connection was lost at {self._waiting!r} (the gateway says "
                f"nothing within {deadline.span_s + _GRACE_S:g} s, nor that it has no answer)"
            )
        if isinstance(error, self._visa_error) and error.error_code == self._timed_out:
            return BenchTimeout(
                f"{self.address}: {self._waiting!r} got no answer within {deadline.span_s:g} s; "
                "is the instrument switched on and at this address?"
            )
        if self._is_locked(error):
            return LinkError(
                f"{self.address}: another client has locked the instrument, {self._waiting!r} was "
                "refused; let that one go, or restart the gateway"
            )
        return LinkError(
            f"{self.address}: the connection was lost at {self._waiting!r} "
            f"({' '.join(str(error).split()) or type(error).__name__})"
        )

    def _is_locked(self, error: Exception) -> bool:
        code = getattr(error, "error_code", None)
        if code == self._io_error:
            # The Python back end calls a write that is refused by a lock an I/O error; a poll
            # is refused by its name.
            try:
                self._resource.read_stb()
            except self._faults as again:
                code = getattr(again, "error_code", None)
            except NotImplementedError:
                return False
        return bool(code == self._locked)


def _rpc_errors() -> tuple[type[Exception], ...]:
    # The Python back end lets its own RPC errors through; a maker's VISA has none.
    try:
        from pyvisa_py.protocols.rpc import RPCError
    except ImportError:
        return ()
    return (RPCError,)
