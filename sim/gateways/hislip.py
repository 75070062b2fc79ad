"""A HiSLIP server as IVI-6.1 (revision 1.1) describes it, in synchronised mode.

Owns sessions, each of two connections, their locks, clears and service requests. A reply goes out
in parts no longer than the client takes; a message that comes before the last reply has gone
interrupts it.
"""

from __future__ import annotations

import socket
import struct
from dataclasses import dataclass, field

from daq.transports.hislip import HEADER, Kind, packed
from sim.instrument.bus import Instrument, TalkState
from sim.instrument.server_endpoints import Client

__all__ = ["HislipClient", "HislipGateway"]

_LONGEST = 1 << 16
_LEAST = 64
_UNRECOGNISED, _BAD_HEADER, _NO_SESSION = 1, 1, 3
_VERSION = 0x0100
_VENDOR = 0x4C42
_RELEASE, _LOCK_FAILED, _LOCK_DONE, _LOCK_ERROR = 0, 0, 1, 3


@dataclass(slots=True, eq=False)
class Session:
    """One client: two connections and what is under way."""

    number: int
    sync: HislipClient | None = None
    aside: HislipClient | None = None
    longest: int = _LONGEST
    inbound: list[tuple[int, bytes, bool]] = field(default_factory=list)
    """Messages, or the rest of them, that the bus has not taken: identity, bytes, end."""
    replies_to: int | None = None
    """Identity of the message that the reply is to."""
    clearing: bool = False


class HislipGateway:
    """What all connections share."""

    def __init__(self, instrument: Instrument) -> None:
        self.instrument = instrument
        self.sessions: dict[int, Session] = {}
        self.holder: Session | None = None
        self._last = 0
        self._asked = False

    def client(self, wire: socket.socket) -> HislipClient:
        """A connection, of which nobody knows yet which of the two it is."""
        return HislipClient(wire, self)

    def new_session(self) -> Session:
        """A further session."""
        self._last = self._last % 0xFFFF + 1
        session = self.sessions[self._last] = Session(self._last)
        return session

    def drop(self, session: Session) -> None:
        """A session is over: both its connections go, and its lock."""
        self.sessions.pop(session.number, None)
        if self.holder is session:
            self.holder = None
        for client in (session.sync, session.aside):
            if client is not None:
                client.closed = True

    def tell_requests(self) -> None:
        """Tell every session of a service request, once."""
        asks = self.instrument.service_request
        if asks and not self._asked:
            for session in self.sessions.values():
                if session.aside is not None:
                    session.aside.say(Kind.ASYNC_SERVICE_REQUEST, 64)
        self._asked = asks


class HislipClient(Client):
    """One connection."""

    def __init__(self, wire: socket.socket, gateway: HislipGateway) -> None:
        super().__init__(wire)
        self._gateway = gateway
        self._session: Session | None = None
        self._waits_for_lock_until_s: float | None = None
        self._now_s = 0.0

    def say(self, kind: Kind, control: int = 0, parameter: int = 0, payload: bytes = b"") -> None:
        """Send one message."""
        self._out += packed(kind, control, parameter, payload)

    def work(self, now_s: float) -> None:
        """Take what has come, and go on with what is under way."""
        self._now_s = now_s
        while not self.closed and len(self._in) >= HEADER.size:
            mark, kind, control, parameter, length = HEADER.unpack(self._in[: HEADER.size])
            if mark != b"HS" or length > 4 * _LONGEST:
                self._fail(_BAD_HEADER)
                break
            if len(self._in) < HEADER.size + length:
                break
            payload = bytes(self._in[HEADER.size : HEADER.size + length])
            del self._in[: HEADER.size + length]
            self._take(kind, control, parameter, payload)
        self._wait_for_lock()
        session = self._session
        if session is not None and session.sync is self:
            self._go_on(session)
        self._gateway.tell_requests()
        self._flush()

    @property
    def waiting(self) -> bool:
        """Whether a message, a reply or a lock is under way."""
        session = self._session
        busy = False
        if session is not None and session.sync is self:
            busy = bool(session.inbound) or self._gateway.instrument.reply_due
        return busy or self._waits_for_lock_until_s is not None or bool(self._out)

    def close(self) -> None:
        """Let go; the other connection of the session goes, too."""
        if self._session is not None:
            self._gateway.drop(self._session)
        super().close()

    # ------------------------------------------------------------ messages

    def _take(self, kind: int, control: int, parameter: int, payload: bytes) -> None:
        session = self._session
        if kind == Kind.INITIALIZE and session is None:
            self._session = session = self._gateway.new_session()
            session.sync = self
            self.say(Kind.INITIALIZE_RESPONSE, 0, _VERSION << 16 | session.number)
        elif kind == Kind.ASYNC_INITIALIZE and session is None:
            session = self._gateway.sessions.get(parameter)
            if session is None or session.aside is not None:
                self._fail(_NO_SESSION)
                return
            self._session, session.aside = session, self
            self.say(Kind.ASYNC_INITIALIZE_RESPONSE, 0, _VENDOR)
        elif session is None:
            self._fail(_NO_SESSION)
        elif session.sync is self:
            self._take_sync(session, kind, parameter, payload)
        else:
            self._take_aside(session, kind, control, parameter, payload)

    def _take_sync(self, session: Session, kind: int, parameter: int, payload: bytes) -> None:
        bus = self._gateway.instrument
        if kind in (Kind.DATA, Kind.DATA_END):
            if session.clearing:
                return  # what was on its way when it was cleared
            if session.replies_to is not None and not session.inbound and bus.reply_due:
                self.say(Kind.INTERRUPTED, 0, parameter)
                if session.aside is not None:
                    session.aside.say(Kind.ASYNC_INTERRUPTED, 0, parameter)
            session.replies_to = None
            session.inbound.append((parameter, payload, kind == Kind.DATA_END))
        elif kind == Kind.TRIGGER:
            bus.trigger()
        elif kind == Kind.DEVICE_CLEAR_COMPLETE:
            session.clearing = False
            self.say(Kind.DEVICE_CLEAR_ACKNOWLEDGE)
        else:
            self.say(Kind.ERROR, _UNRECOGNISED)

    def _take_aside(
        self, session: Session, kind: int, control: int, parameter: int, payload: bytes
    ) -> None:
        gateway, bus = self._gateway, self._gateway.instrument
        if kind == Kind.ASYNC_MAXIMUM_MESSAGE_SIZE:
            asked = struct.unpack(">Q", payload)[0] if len(payload) == 8 else _LONGEST
            session.longest = max(_LEAST, min(asked, _LONGEST))
            self.say(Kind.ASYNC_MAXIMUM_MESSAGE_SIZE_RESPONSE, 0, 0, struct.pack(">Q", _LONGEST))
        elif kind == Kind.ASYNC_STATUS_QUERY:
            status = bus.serial_poll()
            if status is not None:  # an instrument that is gone does not answer a poll
                self.say(Kind.ASYNC_STATUS_RESPONSE, status)
        elif kind == Kind.ASYNC_DEVICE_CLEAR:
            session.clearing = True
            session.inbound.clear()
            session.replies_to = None
            bus.device_clear()
            self.say(Kind.ASYNC_DEVICE_CLEAR_ACKNOWLEDGE)
        elif kind == Kind.ASYNC_REMOTE_LOCAL_CONTROL:
            bus.remote = control in (1, 3, 4)
            bus.local_lockout = control in (4, 5)
            self.say(Kind.ASYNC_REMOTE_LOCAL_RESPONSE)
        elif kind == Kind.ASYNC_LOCK_INFO:
            self.say(Kind.ASYNC_LOCK_INFO_RESPONSE, int(gateway.holder is not None), 1)
        elif kind == Kind.ASYNC_LOCK and control == _RELEASE:
            holds = gateway.holder is session
            gateway.holder = None if holds else gateway.holder
            self.say(Kind.ASYNC_LOCK_RESPONSE, _LOCK_DONE if holds else _LOCK_ERROR)
        elif kind == Kind.ASYNC_LOCK:
            self._waits_for_lock_until_s = self._now_s + parameter / 1000.0
        else:
            self.say(Kind.ERROR, _UNRECOGNISED)

    def _fail(self, why: int) -> None:
        self.say(Kind.FATAL_ERROR, why)
        self._flush()
        self.closed = True

    def _wait_for_lock(self) -> None:
        latest_s, gateway = self._waits_for_lock_until_s, self._gateway
        if latest_s is None:
            return
        if gateway.holder in (None, self._session):
            gateway.holder = self._session
            self.say(Kind.ASYNC_LOCK_RESPONSE, _LOCK_DONE)
        elif self._now_s >= latest_s:
            self.say(Kind.ASYNC_LOCK_RESPONSE, _LOCK_FAILED)
        else:
            return
        self._waits_for_lock_until_s = None

    # ------------------------------------------------------------ the bus

    def _go_on(self, session: Session) -> None:
        if self._gateway.holder not in (None, session):
            return
        while session.inbound:
            number, data, end = session.inbound[0]
            taken = self._gateway.instrument.listen(data, end)
            if taken < len(data):
                session.inbound[0] = (number, data[taken:], end)
                return
            session.inbound.pop(0)
            if end:
                session.replies_to = number
        if session.replies_to is None:
            return
        # Only what is there is fetched: to be told to talk with nothing to say is an error.
        while session.replies_to is not None and self._gateway.instrument.reply_ready:
            talk = self._gateway.instrument.talk(session.longest)
            if talk.state is not TalkState.DATA:
                return
            kind = Kind.DATA_END if talk.end else Kind.DATA
            self.say(kind, 0, session.replies_to, talk.data)
            if talk.end:
                session.replies_to = None
