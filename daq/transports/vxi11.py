"""An instrument behind a VXI-11 gateway: messages, status byte, clear, abort, service requests.

Owns links and calls of VXI-11 (revision 1.0). The Python back end of VISA has such a client, which
cannot abort and takes a gateway that hung up for an instrument that is silent. It speaks no SCPI.
"""

from __future__ import annotations

import time
from contextlib import suppress

from daq.errors import BenchTimeout, LashbenchError, LinkError, ProtocolError
from daq.transports.base import KEPT_LIMIT_BYTES, Deadline, checked_line
from daq.transports.links import TcpLink
from daq.transports.messages import MessageReader
from daq.transports.rpc import (
    PORT_MAPPER,
    Arguments,
    Records,
    opaque,
    packed_call,
    parse_reply,
    words,
)
from daq.transports.vxi11_interrupts import PROGRAM, InterruptServer

__all__ = ["Vxi11Transport", "open_vxi11"]

_CORE, _ABORT_PROGRAM = 0x0607AF, 0x0607B0
_ABORT = 1
_CREATE, _WRITE, _READ, _STATUS, _CLEAR, _DESTROY = 10, 11, 12, 13, 15, 23
_ENABLE_REQUESTS, _CONNECT_BACK = 20, 25
_OVER_TCP, _HANDLE = 0, b"lashbench"
_NOT_ESTABLISHED, _NOT_SUPPORTED, _LOCKED, _IO_TIMEOUT, _ABORTED = 6, 8, 11, 15, 23
_END, _ENDED = 8, 4
_PORT_MAPPER_PORT, _GET_PORT, _TCP = 111, 3, 6
_GRACE_S = 1.0
"""How much longer than the bound a gateway is waited for: it says itself that time is over."""
_ABORT_S = 1.0
_CHUNK_BYTES = 20 * 1024
_LEAST_CHUNK = 64
_POLL_WORDS, _CLEAR_WORDS, _REQUEST_WORDS = "serial poll", "device clear", "service requests"


_OPTIONAL = {
    _STATUS: (_NOT_SUPPORTED,),
    _CLEAR: (_NOT_SUPPORTED,),
    _CONNECT_BACK: (_NOT_SUPPORTED, _NOT_ESTABLISHED),
    _ENABLE_REQUESTS: (_NOT_SUPPORTED,),
}
"""Errors that say that a gateway lacks an operation, by the operation."""


class _Silent(Exception):
    """The gateway says nothing."""


class _Channel:
    """One connection, on which calls are made one after the other."""

    def __init__(self, host: str, port: int, deadline: Deadline) -> None:
        self.link = TcpLink(host, port, deadline)
        self._records = Records()
        self._number = 0

    def call(self, program: int, procedure: int, arguments: bytes, bound: Deadline) -> Arguments:
        """The result of a call; answers to calls that were given up are dropped."""
        self._number += 1
        self.link.send(packed_call(self._number, program, procedure, arguments), bound)
        while True:
            try:
                while (record := self._records.take()) is not None:
                    number, result = parse_reply(record)
                    if number == self._number:
                        return result
            except ValueError as error:
                raise LinkError(f"{self.link.name}: no VXI-11 gateway answers ({error})") from error
            data = self.link.receive(bound)
            if not data:
                raise _Silent
            self._records.feed(data)


def open_vxi11(resource: str, deadline: Deadline) -> Vxi11Transport:
    """Open ``TCPIP::HOST[,PORT][::DEVICE]::INSTR``; the port mapper is asked where none is given.

    Raises
    ------
    LinkError
        If no gateway answers there, or it has no such device.
    """
    parts = resource.split("::")
    host, _, port = parts[1].partition(",")
    device = parts[2] if len(parts) > 3 else "inst0"
    channel = None
    try:
        number = int(port) if port else _mapped_port(host, deadline)
        channel = _Channel(host, number, deadline)
        call = words(0, 0, 0) + opaque(device.encode("ascii", "replace"))
        result = channel.call(_CORE, _CREATE, call, deadline)
        error, link, abort_port, longest = (result.whole() for _ in range(4))
        if error:
            raise LinkError(f"it refuses device {device!r} with VXI-11 error {error}")
        return Vxi11Transport(channel, resource, host, link, abort_port, longest)
    except BaseException as error:
        if channel is not None:
            channel.link.close()
        if isinstance(error, LashbenchError | _Silent | ValueError):
            reason = str(error) or f"nothing was said within {deadline.span_s:g} s"
            raise LinkError(
                f"{resource}: cannot be opened ({reason}); check address, power and cable"
            ) from error
        raise


def _mapped_port(host: str, deadline: Deadline) -> int:
    mapper = _Channel(host, _PORT_MAPPER_PORT, deadline)
    try:
        port = mapper.call(PORT_MAPPER, _GET_PORT, words(_CORE, 1, _TCP, 0), deadline).whole()
    finally:
        mapper.link.close()
    if not 0 < port < 65536:
        raise LinkError("its port mapper knows no VXI-11 server")
    return port


class Vxi11Transport(MessageReader):
    """Messages to one instrument over VXI-11; see `Transport`.

    Parameters
    ----------
    channel
        The core channel.
    address
        Resource name, for messages.
    host, abort_port
        Where the abort channel is; it is opened when it is needed.
    link, longest
        What the gateway said to `create_link`.
    """

    def __init__(
        self, channel: _Channel, address: str, host: str, link: int, abort_port: int, longest: int
    ) -> None:
        super().__init__(address)
        self._channel, self._host, self._link = channel, host, link
        self._abort_port = abort_port
        self._longest = max(_LEAST_CHUNK, min(longest, _CHUNK_BYTES))
        self.lacks: list[str] = []
        """What this gateway turned out not to have, in words."""
        self._interrupts: InterruptServer | None = None

    def write(self, line: str, deadline: Deadline) -> None:
        """Send one message, line feed and end included."""
        data = checked_line(line) + b"\n"
        self._waiting = line
        while data:
            part = data[: self._longest]
            end = _END if len(part) == len(data) else 0
            call = words(self._link, _ms(deadline), 0, end) + opaque(part)
            result = self._done(_WRITE, call, deadline)
            taken = result.whole()
            if not 0 < taken <= len(part):
                raise self._lost(f"it says that it took {taken} of {len(part)} bytes")
            data = data[taken:]

    def serial_poll(self, deadline: Deadline) -> int | None:
        """The status byte; None where the gateway has no serial poll."""
        found = self._if_there_is(_POLL_WORDS, _STATUS, deadline)
        return None if found is None else found.whole() & 255

    def device_clear(self, deadline: Deadline) -> bool:
        """Clear the instrument; False where the gateway cannot.

        Nothing is read then: what the instrument still has to say is lost with the next message,
        and a reply that the gateway keeps is told by its content.
        """
        return self._if_there_is(_CLEAR_WORDS, _CLEAR, deadline) is not None

    def wait_for_service(self, deadline: Deadline) -> bool:
        """Wait until the instrument requests service; False if it did not by the deadline.

        The first call makes the interrupt channel. A gateway without one is noted in `lacks`, and
        the answer is False at once; poll then.
        """
        if self._interrupts is None and _REQUEST_WORDS not in self.lacks:
            self._call_back(deadline)
        if self._interrupts is None:
            return False
        try:
            return self._interrupts.wait(deadline) is not None
        except LinkError as error:
            self._waiting = _REQUEST_WORDS
            raise self._lost(str(error)) from error

    def pause(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(seconds)

    def close(self) -> None:
        """Give the link back and hang up; may be called twice."""
        with suppress(LashbenchError, _Silent, ValueError):
            self._channel.call(_CORE, _DESTROY, words(self._link), Deadline.after(_ABORT_S))
        self._channel.link.close()
        if self._interrupts is not None:
            self._interrupts.close()

    # Inside

    def _call_back(self, deadline: Deadline) -> None:
        """Let the gateway connect to this machine and tell it of service requests."""
        self._waiting = _REQUEST_WORDS
        here, there = self._channel.link.ends
        server = InterruptServer(here, there)
        try:
            host, port = server.place
            call = words(host, port, PROGRAM, 1, _OVER_TCP)
            self._done(_CONNECT_BACK, call, deadline)
            self._done(_ENABLE_REQUESTS, words(self._link, 1) + opaque(_HANDLE), deadline)
        except _Refused:
            server.close()
            self.lacks.append(_REQUEST_WORDS)
            return
        except BaseException:
            server.close()
            raise
        self._interrupts = server

    def _message(self, deadline: Deadline) -> bytes:
        """One message, up to its own end."""
        message, reason = b"", 0
        while not reason & _ENDED:
            call = words(self._link, _CHUNK_BYTES, _ms(deadline), 0, 0, 0)
            try:
                result = self._done(_READ, call, deadline)
            except BenchTimeout as error:
                if not message:
                    raise
                raise ProtocolError(
                    f"{self.address}: the reply to {self._waiting!r} began and was cut short, "
                    f"{len(message)} bytes came within {deadline.span_s:g} s"
                ) from error
            reason = result.whole()
            part = result.bytes()
            message += part
            if len(message) > KEPT_LIMIT_BYTES or not (part or reason):
                raise ProtocolError(
                    f"{self.address}: the reply to {self._waiting!r} has {len(message)} bytes and "
                    "no end"
                )
        return message

    def _if_there_is(self, what: str, procedure: int, deadline: Deadline) -> Arguments | None:
        """Do what not every gateway can; None, from then on at once, where it cannot."""
        if what in self.lacks:
            return None
        self._waiting = what
        call = words(self._link, 0, 0, _ms(deadline))
        try:
            return self._done(procedure, call, deadline)
        except _Refused:
            self.lacks.append(what)
        return None

    def _done(self, procedure: int, arguments: bytes, deadline: Deadline) -> Arguments:
        """The result of a call behind its error, which is raised."""
        bound = Deadline.after(deadline.remaining_s + _GRACE_S)
        try:
            result = self._channel.call(_CORE, procedure, arguments, bound)
            error = result.whole()
        except _Silent as silent:
            raise self._aborted(deadline) from silent
        except ValueError as fault:
            raise self._lost(str(fault)) from fault
        except LinkError as fault:
            raise self._lost(str(fault)) from fault
        if error == 0:
            return result
        if error in _OPTIONAL.get(procedure, ()):
            raise _Refused
        if error == _LOCKED:
            raise LinkError(
                f"{self.address}: another client has locked the instrument, {self._waiting!r} was "
                "refused; let that one go, or restart the gateway"
            )
        if error in (_IO_TIMEOUT, _ABORTED):
            raise self._timed_out(deadline)
        raise self._lost(f"VXI-11 error {error}")

    def _aborted(self, deadline: Deadline) -> BenchTimeout | LinkError:
        """End a call that the gateway does not end itself, so that it lets go of the bus."""
        try:
            patience = Deadline.after(_ABORT_S)
            side = _Channel(self._host, self._abort_port, patience)
            try:
                error = side.call(_ABORT_PROGRAM, _ABORT, words(self._link), patience).whole()
            finally:
                side.link.close()
        except (LashbenchError, _Silent, ValueError):
            return self._lost(
                f"the gateway says nothing within {deadline.span_s + _GRACE_S:g} s, nor that it "
                "has no answer, and takes no abort"
            )
        if error:
            return self._lost(f"the gateway says nothing, and refuses an abort with error {error}")
        return self._timed_out(deadline)

    def _timed_out(self, deadline: Deadline) -> BenchTimeout:
        return BenchTimeout(
            f"{self.address}: {self._waiting!r} got no answer within {deadline.span_s:g} s; "
            "is the instrument switched on and at this address?"
        )

    def _lost(self, why: str) -> LinkError:
        return LinkError(f"{self.address}: the connection was lost at {self._waiting!r} ({why})")


class _Refused(Exception):
    """The gateway has no such operation."""


def _ms(deadline: Deadline) -> int:
    return max(1, int(deadline.remaining_s * 1000))
