"""A VXI-11 gateway as its specification (VXI-11, revision 1.0) describes the server.

Owns links, locks, time-outs, the abort channel and service requests. A read or write that the bus
does not finish is waited for as long as the client allowed, and ended by an abort. An interrupt
channel goes to the machine of the client alone, over TCP; any other is not established.
"""

from __future__ import annotations

import socket
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass

from daq.transports.rpc import (
    GARBAGE_ARGUMENTS,
    PROCEDURE_UNAVAILABLE,
    PROGRAM_UNAVAILABLE,
    Arguments,
    Call,
    Records,
    accepted,
    opaque,
    parse_call,
    refused,
)
from daq.transports.rpc import words as packed
from sim.gateways.interrupts import NOT_ESTABLISHED, InterruptChannel, channel_to
from sim.instrument.bus import Instrument, TalkState
from sim.instrument.server_endpoints import Client

__all__ = ["AbortClient", "CoreClient", "Vxi11Gateway"]

CORE, ABORT = 0x0607AF, 0x0607B0
_NO_ERROR, _INVALID_LINK, _NOT_SUPPORTED = 0, 4, 8
_LOCKED, _NO_LOCK, _IO_TIMEOUT, _ABORTED, _ESTABLISHED_BEFORE = 11, 12, 15, 23, 29
_LONGEST_HANDLE = 40
_WAIT_LOCK, _END, _TERMCHAR = 1, 8, 128
_REQUEST_COUNT, _CHARACTER, _ENDED = 1, 2, 4
_LONGEST_WRITE = 4096


@dataclass(slots=True, eq=False)
class Link:
    """One client's way to the instrument."""

    number: int
    aborted: bool = False
    handle: bytes | None = None
    """What the client wants to be told with a service request; None where it wants none."""
    requested: bool = False
    """Whether it has been told of the request that is pending."""


_Work = Iterator[bytes | None]
"""A call under way: None while it has to wait, then its result."""
_Wait = Generator[None, None, int]
"""A wait for a lock; it returns the error that ended it, or 0."""


class Vxi11Gateway:
    """What all connections to one gateway share."""

    def __init__(self, instrument: Instrument) -> None:
        self.instrument = instrument
        self.links: dict[int, Link] = {}
        self.holder: Link | None = None
        """The link that has locked the instrument."""
        self.abort_port = 0
        self._last = 0

    def core(self, wire: socket.socket) -> CoreClient:
        """A connection to the core channel."""
        return CoreClient(wire, self)

    def abort(self, wire: socket.socket) -> AbortClient:
        """A connection to the abort channel."""
        return AbortClient(wire, self)

    def new_link(self) -> Link:
        """A further link."""
        self._last += 1
        link = self.links[self._last] = Link(self._last)
        return link

    def drop(self, link: Link) -> None:
        """A link is gone, and with it its lock."""
        self.links.pop(link.number, None)
        if self.holder is link:
            self.holder = None


class _RpcClient(Client):
    """Calls in, replies out, one after the other."""

    program = 0

    def __init__(self, wire: socket.socket, gateway: Vxi11Gateway) -> None:
        super().__init__(wire)
        self._gateway = gateway
        self._records = Records()
        self._call: Call | None = None
        self._under_way: _Work | None = None
        self._now_s = 0.0

    def work(self, now_s: float) -> None:
        """Go on with the call under way, and with those behind it."""
        self._now_s = now_s
        self._records.feed(bytes(self._in))
        self._in.clear()
        try:
            while self._under_way is not None or self._next():
                result = None if self._under_way is None else next(self._under_way)
                if result is None or self._call is None:
                    break
                self._out += accepted(self._call, result)
                self._under_way = None
        except ValueError:
            self.closed = True  # what speaks no RPC is hung up on
        self._flush()

    @property
    def waiting(self) -> bool:
        """Whether a call is under way, or a reply is left."""
        return self._under_way is not None or super().waiting

    def _next(self) -> bool:
        """Begin the next call that can be made."""
        while (record := self._records.take()) is not None:
            call = parse_call(record)
            make = self._procedure(call.procedure)
            if call.program != self.program:
                self._out += refused(call, PROGRAM_UNAVAILABLE)
            elif make is None:
                self._out += refused(call, PROCEDURE_UNAVAILABLE)
            else:
                try:
                    self._under_way = make(call.arguments)
                except ValueError:
                    self._out += refused(call, GARBAGE_ARGUMENTS)
                    continue
                self._call = call
                return True
        return False

    def _procedure(self, number: int) -> Callable[[Arguments], _Work] | None:
        raise NotImplementedError


class AbortClient(_RpcClient):
    """The abort channel: ends what another connection's link is waiting for."""

    program = ABORT

    def _procedure(self, number: int) -> Callable[[Arguments], _Work] | None:
        return self._abort if number == 1 else None

    def _abort(self, given: Arguments) -> _Work:
        link = self._gateway.links.get(given.whole())
        if link is not None:
            link.aborted = True
        return iter([packed(_INVALID_LINK if link is None else _NO_ERROR)])


class CoreClient(_RpcClient):
    """The core channel."""

    program = CORE

    def __init__(self, wire: socket.socket, gateway: Vxi11Gateway) -> None:
        super().__init__(wire, gateway)
        self._own: list[Link] = []
        self._interrupts: InterruptChannel | None = None

    def work(self, now_s: float) -> None:
        """Go on with the calls, and tell of a service request, once."""
        super().work(now_s)
        asks = self._gateway.instrument.service_request
        for link in self._own:
            if self._interrupts is not None and link.handle is not None:
                if asks and not link.requested:
                    self._interrupts.request_service(link.handle)
                link.requested = asks
        if self._interrupts is not None:
            self._interrupts.flush()

    def close(self) -> None:
        """Let go of the connection, of its links and of its interrupt channel."""
        for link in self._own:
            self._gateway.drop(link)
        if self._interrupts is not None:
            self._interrupts.close()
        super().close()

    def _procedure(self, number: int) -> Callable[[Arguments], _Work] | None:
        bus = self._gateway.instrument
        simple = {
            14: lambda: bus.trigger(),
            15: lambda: bus.device_clear(),
            16: lambda: setattr(bus, "remote", True),
            17: lambda: setattr(bus, "remote", False),
        }
        if number in simple:
            return lambda given: self._generic(given, lambda: simple[number]() or b"")
        return {
            10: self._create, 11: self._write, 12: self._read, 13: self._status, 18: self._lock,
            19: self._unlock, 20: self._enable, 22: self._command, 23: self._destroy,
            25: self._connect, 26: self._disconnect,
        }.get(number)  # fmt: skip

    # ------------------------------------------------------------ links and locks

    def _create(self, given: Arguments) -> _Work:
        _client, locks, patience_ms, _device = (
            given.whole(), given.whole(), given.whole(), given.bytes(),
        )  # fmt: skip
        return self._created(bool(locks), patience_ms)

    def _created(self, locks: bool, patience_ms: int) -> _Work:
        link = self._gateway.new_link()
        self._own.append(link)
        error = _NO_ERROR
        if locks:
            error = yield from self._locking(link, _WAIT_LOCK, patience_ms)
        if error:
            self._gateway.drop(link)
        yield packed(error, link.number, self._gateway.abort_port, _LONGEST_WRITE)

    def _destroy(self, given: Arguments) -> _Work:
        link = self._gateway.links.get(given.whole())
        if link is not None:
            self._gateway.drop(link)
        return iter([packed(_INVALID_LINK if link is None else _NO_ERROR)])

    def _lock(self, given: Arguments) -> _Work:
        link, flags, patience_ms = self._link(given), given.whole(), given.whole()

        def locked() -> _Work:
            yield packed(
                _INVALID_LINK
                if link is None
                else (yield from self._locking(link, flags, patience_ms))
            )

        return locked()

    def _locking(self, link: Link, flags: int, patience_ms: int) -> _Wait:
        error = yield from self._allowed(link, flags, patience_ms)
        if not error:
            self._gateway.holder = link
        return error

    def _unlock(self, given: Arguments) -> _Work:
        link, gateway = self._link(given), self._gateway
        if link is None:
            return iter([packed(_INVALID_LINK)])
        if gateway.holder is not link:
            return iter([packed(_NO_LOCK)])
        gateway.holder = None
        return iter([packed(_NO_ERROR)])

    def _link(self, given: Arguments) -> Link | None:
        link = self._gateway.links.get(given.whole())
        if link is not None:
            link.aborted = False  # an abort ends what is under way, and nothing later
        return link

    def _allowed(self, link: Link, flags: int, patience_ms: int) -> _Wait:
        """Wait for a lock of another link, as the flags say; the error, or 0."""
        latest_s = self._now_s + patience_ms / 1000.0
        while self._gateway.holder not in (None, link):
            if link.aborted:
                return _ABORTED
            if not flags & _WAIT_LOCK or self._now_s >= latest_s:
                return _LOCKED
            yield None
        return _NO_ERROR

    # ------------------------------------------------------------ the bus

    def _write(self, given: Arguments) -> _Work:
        link, patience_ms, lock_ms, flags, data = (
            self._link(given), given.whole(), given.whole(), given.whole(), given.bytes(),
        )  # fmt: skip
        if link is None:
            return iter([packed(_INVALID_LINK, 0)])
        return self._written(link, patience_ms, lock_ms, flags, data)

    def _written(
        self, link: Link, patience_ms: int, lock_ms: int, flags: int, data: bytes
    ) -> _Work:
        error = yield from self._allowed(link, flags, lock_ms)
        sent, latest_s = 0, self._now_s + patience_ms / 1000.0
        while not error and sent < len(data):
            taken = self._gateway.instrument.listen(data[sent:], bool(flags & _END))
            sent += taken
            if taken:
                latest_s = self._now_s + patience_ms / 1000.0
            elif error := self._over(link, latest_s):
                break
            else:
                yield None
        yield packed(error, sent)

    def _read(self, given: Arguments) -> _Work:
        link, size, patience_ms, lock_ms, flags, character = (
            self._link(given), *(given.whole() for _ in range(5)),
        )  # fmt: skip
        if link is None:
            return iter([packed(_INVALID_LINK, 0) + opaque(b"")])
        return self._taken(link, size, patience_ms, lock_ms, flags, character)

    def _taken(
        self, link: Link, size: int, patience_ms: int, lock_ms: int, flags: int, character: int
    ) -> _Work:
        error = yield from self._allowed(link, flags, lock_ms)
        latest_s, data, reason, silent = self._now_s + patience_ms / 1000.0, b"", 0, False
        by_character = bool(flags & _TERMCHAR)
        while not error and not reason:
            if not silent:
                talk = self._gateway.instrument.talk(1 if by_character else size - len(data))
                data += talk.data
                # Who has nothing to say has complained once, and is not asked again.
                silent = talk.state is TalkState.NOTHING
                reason |= _ENDED if talk.end else 0
                reason |= _REQUEST_COUNT if len(data) >= size else 0
                if by_character and talk.data == bytes([character & 255]):
                    reason |= _CHARACTER
                if talk.data:
                    latest_s = self._now_s + patience_ms / 1000.0
                    continue
            error = self._over(link, latest_s)
            if not error:
                yield None
        yield packed(error, reason) + opaque(data)

    def _status(self, given: Arguments) -> _Work:
        def poll() -> bytes | None:
            byte = self._gateway.instrument.serial_poll()
            return None if byte is None else packed(byte)

        return self._generic(given, poll, packed(0))

    def _generic(
        self, given: Arguments, act: Callable[[], bytes | None], nothing: bytes = b""
    ) -> _Work:
        """Wait for the lock, then act until there is a result; `nothing` goes with an error."""
        link, flags, lock_ms, patience_ms = (
            self._link(given), given.whole(), given.whole(), given.whole(),
        )  # fmt: skip
        if link is None:
            return iter([packed(_INVALID_LINK) + nothing])

        def done() -> _Work:
            error = yield from self._allowed(link, flags, lock_ms)
            latest_s, result = self._now_s + patience_ms / 1000.0, None
            while not error and (result := act()) is None:
                error = self._over(link, latest_s)
                if not error:
                    yield None
            yield packed(error) + (nothing if result is None else result)

        return done()

    def _over(self, link: Link, latest_s: float) -> int:
        """The error that ends a wait, or 0."""
        if link.aborted:
            return _ABORTED
        return _IO_TIMEOUT if self._now_s >= latest_s else _NO_ERROR

    def _command(self, given: Arguments) -> _Work:
        return iter([packed(_NOT_SUPPORTED) + opaque(b"")])

    # ------------------------------------------------------------ service requests

    def _enable(self, given: Arguments) -> _Work:
        link, enabled, handle = self._link(given), given.whole(), given.bytes()
        if len(handle) > _LONGEST_HANDLE:
            raise ValueError("a handle has 40 bytes at most")
        if link is None:
            return iter([packed(_INVALID_LINK)])
        link.handle, link.requested = handle if enabled else None, False
        return iter([packed(_NO_ERROR)])

    def _connect(self, given: Arguments) -> _Work:
        if self._interrupts is not None and not self._interrupts.closed:
            return iter([packed(_ESTABLISHED_BEFORE)])
        self._interrupts, error = channel_to(self.wire.getpeername()[0], given)
        return iter([packed(error)])

    def _disconnect(self, given: Arguments) -> _Work:
        channel, self._interrupts = self._interrupts, None
        if channel is None:
            return iter([packed(NOT_ESTABLISHED)])
        channel.close()
        return iter([packed(_NO_ERROR)])
