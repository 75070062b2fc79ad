"""What is pending, and who waits for it: the no-operation-pending flag, `*OPC`, `*OPC?`, `*WAI`.

Owns the set of overlapped commands under way. It does not know what they do.
"""

from __future__ import annotations

from collections.abc import Callable

from sim.analyser35670a.status import Event, StatusModel

__all__ = ["Operations"]


class Operations:
    """Overlapped commands under way."""

    def __init__(self, status: StatusModel) -> None:
        self._status = status
        self._tokens: set[object] = set()
        self._wanted = False
        self._query: object | None = None

    @property
    def pending(self) -> bool:
        """Whether any is still at work."""
        return bool(self._tokens)

    def begin(self) -> object:
        """Something overlapped begins; the token ends it."""
        token = object()
        self._tokens.add(token)
        return token

    def end(self, token: object) -> None:
        """Something overlapped has ended."""
        self._tokens.discard(token)
        if not self._tokens and self._wanted:
            self._wanted = False
            self._status.raise_event(Event.OPERATION_COMPLETE)

    def forget(self) -> None:
        """Nothing is pending any more, and nobody is told."""
        self._tokens.clear()

    def request(self) -> None:
        """``*OPC``: set the bit once nothing is pending."""
        if self._tokens:
            self._wanted = True
        else:
            self._status.raise_event(Event.OPERATION_COMPLETE)

    def query(self) -> Callable[[], str | None]:
        """``*OPC?``: a function that gives the reply once nothing is pending."""
        token = self._query = object()

        def ready() -> str | None:
            return "+1" if self._query is token and not self._tokens else None

        return ready

    def cancel(self) -> bool:
        """Forget `*OPC` and `*OPC?`; whether a query was waiting."""
        waiting = self._query is not None
        self._wanted, self._query = False, None
        return waiting
