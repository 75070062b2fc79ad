"""An instrument on HiSLIP (IVI-6.1): messages with ends, status byte, service request, clear.

Owns both connections of one session and their headers. The Python back end of VISA has such a
client, which takes a service request for the answer to its poll and a late reply for the
acknowledgement of a clear. It speaks no SCPI and takes no lock.
"""

from __future__ import annotations

import struct
import time
from dataclasses import dataclass
from enum import IntEnum

from daq.errors import BenchTimeout, LashbenchError, LinkError, ProtocolError
from daq.transports.base import KEPT_LIMIT_BYTES, Deadline, checked_line
from daq.transports.inbox import Inbox
from daq.transports.links import Link, TcpLink
from daq.transports.messages import MessageReader

__all__ = ["HEADER", "PORT", "HislipTransport", "Kind", "open_hislip", "packed"]

PORT = 4880
HEADER = struct.Struct(">2sBBIQ")
"""Mark, kind, control code, parameter, length of what follows."""
_MARK = b"HS"
_VERSION = 0x0100
_VENDOR = 0x4C42
_FIRST_ID = 0xFFFF_FF00
_ANY_ID = 0xFFFF_FFFF
_CLEAR_PAUSE_S = 0.02
_LOCKS_S = 0.5
"""How long a server is asked, after a time-out, who holds a lock."""


class Kind(IntEnum):
    """Kinds of messages, those of encryption left out."""

    INITIALIZE = 0
    INITIALIZE_RESPONSE = 1
    FATAL_ERROR = 2
    ERROR = 3
    ASYNC_LOCK = 4
    ASYNC_LOCK_RESPONSE = 5
    DATA = 6
    DATA_END = 7
    DEVICE_CLEAR_COMPLETE = 8
    DEVICE_CLEAR_ACKNOWLEDGE = 9
    ASYNC_REMOTE_LOCAL_CONTROL = 10
    ASYNC_REMOTE_LOCAL_RESPONSE = 11
    TRIGGER = 12
    INTERRUPTED = 13
    ASYNC_INTERRUPTED = 14
    ASYNC_MAXIMUM_MESSAGE_SIZE = 15
    ASYNC_MAXIMUM_MESSAGE_SIZE_RESPONSE = 16
    ASYNC_INITIALIZE = 17
    ASYNC_INITIALIZE_RESPONSE = 18
    ASYNC_DEVICE_CLEAR = 19
    ASYNC_SERVICE_REQUEST = 20
    ASYNC_STATUS_QUERY = 21
    ASYNC_STATUS_RESPONSE = 22
    ASYNC_DEVICE_CLEAR_ACKNOWLEDGE = 23
    ASYNC_LOCK_INFO = 24
    ASYNC_LOCK_INFO_RESPONSE = 25


@dataclass(frozen=True, slots=True)
class _Message:
    kind: int
    control: int
    parameter: int
    payload: bytes


def packed(kind: Kind, control: int = 0, parameter: int = 0, payload: bytes = b"") -> bytes:
    """One message as it crosses the wire."""
    return HEADER.pack(_MARK, kind, control, parameter, len(payload)) + payload


class _Channel:
    """One of the two connections: whole messages in, whole messages out."""

    def __init__(self, link: Link) -> None:
        self.link = link
        self._inbox = Inbox(link, "a HiSLIP server")
        self._header: tuple[int, int, int, int] | None = None

    def send(self, data: bytes, deadline: Deadline) -> None:
        self.link.send(data, deadline)

    def receive(self, deadline: Deadline) -> _Message | None:
        """The next message; None if it was not all there by the deadline, when it is kept."""
        if self._header is None:
            start = self._taken(HEADER.size, deadline)
            if start is None:
                return None
            mark, kind, control, parameter, length = HEADER.unpack(start)
            if mark != _MARK or length > KEPT_LIMIT_BYTES:
                raise self.lost(f"it sent {start[:8]!r}, which begins no message")
            self._header = kind, control, parameter, length
        payload = self._taken(self._header[3], deadline)
        if payload is None:
            return None
        kind, control, parameter, _ = self._header
        self._header = None
        if kind in (Kind.FATAL_ERROR, Kind.ERROR):
            said = payload.decode("ascii", "replace").strip() or f"error {control}"
            raise self.lost(f"it reports {said!r}")
        return _Message(kind, control, parameter, payload)

    def _taken(self, count: int, deadline: Deadline) -> bytes | None:
        while (part := self._inbox.taken(count)) is None:
            if not self._inbox.gather(deadline):
                return None
        return part

    def lost(self, why: str) -> LinkError:
        """The connection is of no use any more."""
        return LinkError(f"{self.link.name}: the connection to the HiSLIP server is lost: {why}")


def open_hislip(resource: str, deadline: Deadline) -> HislipTransport:
    """Open ``TCPIP::HOST::hislip0[,PORT]::INSTR``.

    Raises
    ------
    LinkError
        If nobody answers there as a HiSLIP server does.
    """
    _, host, device, *_ = resource.split("::")
    name, _, port = device.partition(",")
    number = int(port or PORT)
    opened = [TcpLink(host, number, deadline)]
    try:
        sync = _Channel(opened[0])
        start = packed(
            Kind.INITIALIZE, 0, _VERSION << 16 | _VENDOR, name.lower().encode("ascii", "replace")
        )
        sync.send(start, deadline)
        hello = _answer(sync, Kind.INITIALIZE_RESPONSE, deadline)
        opened.append(TcpLink(host, number, deadline))
        aside = _Channel(opened[1])
        aside.send(packed(Kind.ASYNC_INITIALIZE, 0, hello.parameter & 0xFFFF), deadline)
        _answer(aside, Kind.ASYNC_INITIALIZE_RESPONSE, deadline)
        size = struct.pack(">Q", KEPT_LIMIT_BYTES)
        aside.send(packed(Kind.ASYNC_MAXIMUM_MESSAGE_SIZE, 0, 0, size), deadline)
        _answer(aside, Kind.ASYNC_MAXIMUM_MESSAGE_SIZE_RESPONSE, deadline)
    except BaseException as error:
        # A key press must not leave a connection open either.
        for link in opened:
            link.close()
        if isinstance(error, LashbenchError) and not isinstance(error, LinkError):
            raise LinkError(f"{resource}: no HiSLIP server answers there ({error})") from error
        raise
    return HislipTransport(sync, aside, resource)


def _answer(channel: _Channel, kind: Kind, deadline: Deadline) -> _Message:
    while (message := channel.receive(deadline)) is not None:
        if message.kind == kind:
            return message
    raise channel.lost(f"no {kind.name} within {deadline.span_s:g} s; check address and power")


class HislipTransport(MessageReader):
    """Messages to one instrument over HiSLIP, synchronised mode; see `Transport`.

    Parameters
    ----------
    sync, aside
        The synchronous and the asynchronous connection, initialised.
    address
        Resource name, for messages.
    """

    def __init__(self, sync: _Channel, aside: _Channel, address: str) -> None:
        super().__init__(address)
        self._sync, self._aside = sync, aside
        self._next_id = _FIRST_ID
        self._last_id = _FIRST_ID
        self._delivered = 0
        self._requests: list[int] = []
        self._part = bytearray()

    def write(self, line: str, deadline: Deadline) -> None:
        """Send one message, with its end; what is left of an older reply is not taken for its."""
        data = checked_line(line) + b"\n"
        self._waiting = line
        self._part.clear()
        self._sync.send(packed(Kind.DATA_END, self._delivered, self._next_id, data), deadline)
        self._delivered = 0
        self._last_id, self._next_id = self._next_id, (self._next_id + 2) & 0xFFFF_FFFF

    def serial_poll(self, deadline: Deadline) -> int:
        """The status byte."""
        query = packed(Kind.ASYNC_STATUS_QUERY, self._delivered, self._last_id)
        self._aside.send(query, deadline)
        self._delivered = 0
        found = self._from_aside(Kind.ASYNC_STATUS_RESPONSE, deadline)
        if found is None:
            raise self._timed_out("serial poll", deadline)
        return found.control

    def device_clear(self, deadline: Deadline) -> bool:
        """Clear the instrument, and drop every reply that is on its way."""
        self._aside.send(packed(Kind.ASYNC_DEVICE_CLEAR), deadline)
        found = self._from_aside(Kind.ASYNC_DEVICE_CLEAR_ACKNOWLEDGE, deadline)
        if found is None:
            raise self._timed_out("device clear", deadline)
        self._sync.send(packed(Kind.DEVICE_CLEAR_COMPLETE, found.control), deadline)
        while True:
            message = self._sync.receive(deadline)
            if message is None:
                raise self._timed_out("device clear", deadline)
            if message.kind == Kind.DEVICE_CLEAR_ACKNOWLEDGE:
                break
        self._part.clear()
        self._requests.clear()
        self._delivered = 0
        self._next_id = self._last_id = _FIRST_ID
        return True

    def wait_for_service(self, deadline: Deadline) -> bool:
        """Wait until the instrument requests service; False if it did not by the deadline."""
        if not self._requests:
            message = self._aside.receive(deadline)
            if message is not None:
                self._take_aside(message)
        return bool(self._requests) and self._requests.pop() >= 0

    def pause(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(seconds)

    def close(self) -> None:
        """Close both connections."""
        self._sync.link.close()
        self._aside.link.close()

    # Inside

    def _message(self, deadline: Deadline) -> bytes:
        """The whole reply to the last message; parts of older ones are dropped."""
        while True:
            found = self._sync.receive(deadline)
            if found is None:
                begun = len(self._part)
                self._part.clear()
                if begun:
                    raise ProtocolError(
                        f"{self.address}: the reply to {self._waiting!r} began and was cut short, "
                        f"{begun} bytes came within {deadline.span_s:g} s"
                    )
                raise self._timed_out(self._waiting, deadline)
            if found.kind not in (Kind.DATA, Kind.DATA_END):
                continue
            if found.parameter not in (self._last_id, _ANY_ID):
                continue
            self._part += found.payload
            if len(self._part) > KEPT_LIMIT_BYTES:
                self._part.clear()
                raise ProtocolError(
                    f"{self.address}: the reply to {self._waiting!r} has more than "
                    f"{KEPT_LIMIT_BYTES} bytes and no end"
                )
            if found.kind == Kind.DATA_END:
                whole = bytes(self._part)
                self._part.clear()
                self._delivered = 1
                return whole

    def _from_aside(self, kind: Kind, deadline: Deadline) -> _Message | None:
        while (message := self._aside.receive(deadline)) is not None:
            if message.kind == kind:
                return message
            self._take_aside(message)
        return None

    def _take_aside(self, message: _Message) -> None:
        """A service request may come at any time, before an answer as well."""
        if message.kind == Kind.ASYNC_SERVICE_REQUEST:
            self._requests.append(message.control)

    def _timed_out(self, what: str, deadline: Deadline) -> BenchTimeout:
        return BenchTimeout(
            f"{self.address}: {what!r} got no answer within {deadline.span_s:g} s; "
            f"{self._why_silent()}"
        )

    def _why_silent(self) -> str:
        """A server leaves the messages of others lying while one client holds a lock."""
        patience = Deadline.after(_LOCKS_S)
        self._aside.send(packed(Kind.ASYNC_LOCK_INFO), patience)
        found = self._from_aside(Kind.ASYNC_LOCK_INFO_RESPONSE, patience)
        if found is not None and found.control:
            return "another client has locked the instrument; let that one go"
        return "is the instrument switched on and at this address?"
