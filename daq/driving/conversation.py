"""A conversation with one instrument: bounded questions, one at a time, and a clean recovery.

Owns the rules that hold for every exchange whatever the instrument's language: each has a
deadline and is announced, and a time-out or damaged reply is followed at once by a recovery. How
an instrument is recovered is the language's matter.
"""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from daq.driving.replies import parse_integer, parse_number
from daq.errors import BenchTimeout, LashbenchError, LinkError, ProtocolError
from daq.transports.base import Deadline, Transport, ask

__all__ = ["Conversation"]

RECOVERY_S = 2.0
"""Bound of each step of a recovery: what follows it may be making the source safe."""
_RECOVERY_IN_ALL_S = 20.0
"""Announced for all its steps."""
_LOOK_S = 0.1
"""Longest pause without a look at whether anybody wants it to end."""

_Result = TypeVar("_Result")


class Conversation(ABC):
    """Questions and commands over one transport, one at a time.

    Parameters
    ----------
    transport
        The wire.
    reply_s
        Bound of one ordinary reply, s.
    block_s
        Bound of one block of data, s; a slow serial line needs some.

    Notes
    -----
    After any `BenchTimeout` or `ProtocolError` the attribute `trusted` is
    False: the state of the instrument is unknown until it is set up anew.
    """

    def __init__(self, transport: Transport, reply_s: float = 5.0, block_s: float = 10.0) -> None:
        self.transport = transport
        self.reply_s = reply_s
        self.block_s = block_s
        self.trusted = False
        self.on_wait: Callable[[], None] | None = None
        """Called between the polls of a wait; may raise to end it."""
        self.on_exchange: Callable[[float], None] | None = None
        """Told before each exchange how long it may take at most, s; must not raise."""
        self.lock = threading.RLock()
        """Held for each exchange; whoever needs several in a row may hold it longer."""

    @abstractmethod
    def recover(self) -> str:
        """Get both sides in step again after a fault; what was found, in words or empty.

        Raises
        ------
        LashbenchError
            If the instrument does not come back.
        """

    def send(self, line: str) -> None:
        """Send a command that is not answered."""
        self.guarded(lambda: self.transport.write(line, Deadline.after(self.reply_s)), self.reply_s)

    def ask(self, line: str, within_s: float | None = None) -> str:
        """Send a query and read its reply."""
        bound_s = self.reply_s if within_s is None else within_s
        deadline = Deadline.after(bound_s)
        return self.guarded(lambda: ask(self.transport, line, deadline), bound_s)

    def ask_integer(self, line: str, within_s: float | None = None) -> int:
        """Send a query that is answered by an integer."""
        return self.parsed(line, parse_integer, within_s)

    def ask_number(self, line: str, within_s: float | None = None) -> float:
        """Send a query that is answered by a number."""
        return self.parsed(line, parse_number, within_s)

    def poll(self) -> int | None:
        """Serial poll; None where the wire has none."""
        return self.guarded(
            lambda: self.transport.serial_poll(Deadline.after(self.reply_s)), self.reply_s
        )

    def pause(self, seconds: float) -> None:
        """Let time pass, with a look at `on_wait` at least every `_LOOK_S`."""
        left_s = seconds
        while True:
            if self.on_wait is not None:
                self.on_wait()
            if left_s <= 0:
                return
            self.transport.pause(min(left_s, _LOOK_S))
            left_s -= _LOOK_S

    def guarded(self, exchange: Callable[[], _Result], bound_s: float) -> _Result:
        """Do one exchange, announced, with the recovery that a fault calls for."""
        if self.on_exchange is not None:
            self.on_exchange(bound_s)
        with self.lock:
            try:
                return exchange()
            except (BenchTimeout, ProtocolError) as error:
                raise self.failure(error) from error
            except LinkError:
                self.trusted = False
                raise

    def parsed(
        self, line: str, parse: Callable[[str], _Result], within_s: float | None = None
    ) -> _Result:
        """Send a query and read its reply with a strict parser."""
        text = self.ask(line, within_s)
        try:
            return parse(text)
        except ProtocolError as error:
            complete = ProtocolError(f"{self.transport.address}: {line!r}: {error}")
            raise self.failure(complete) from error

    def failure(self, error: BenchTimeout | ProtocolError) -> LashbenchError:
        """Recover from a time-out or a damaged reply; the error to raise, with what was found."""
        if self.on_exchange is not None:
            self.on_exchange(_RECOVERY_IN_ALL_S)
        try:
            found = self.recover()
        except LashbenchError as failure:
            return type(error)(f"{error}; no recovery: {failure}; its state is unknown")
        return type(error)(f"{error}; after a device clear{found}; its state is unknown")

    @contextmanager
    def hurrying(self, reply_s: float) -> Iterator[None]:
        """Give each ordinary reply at most so long inside the block."""
        before_s, self.reply_s = self.reply_s, min(self.reply_s, reply_s)
        try:
            yield
        finally:
            self.reply_s = before_s

    def soon(self) -> Deadline:
        """Bound of one step of a recovery."""
        return Deadline.after(min(self.reply_s, RECOVERY_S))
