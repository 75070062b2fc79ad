"""Calls that may never return, made in a thread beside and waited for with a bound.

Owns that thread: one call at a time, in order. A call that was given up goes on there; nothing
can end it. It knows nothing of what is called.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any, Generic, TypeVar

__all__ = ["Aside", "NoReturn"]

_Result = TypeVar("_Result")
_LOOK_S = 0.1


class NoReturn(Exception):
    """A call did not return in time; it goes on."""


class _Call(Generic[_Result]):
    def __init__(self, function: Callable[[], _Result]) -> None:
        self.function = function
        self.over = threading.Event()
        self.result: _Result | None = None
        self.error: BaseException | None = None

    def make(self) -> None:
        try:
            self.result = self.function()
        except BaseException as error:  # it is raised where the call is waited for
            self.error = error
        finally:
            self.over.set()


class Aside:
    """Makes calls one after the other; its thread starts with the first.

    Used by one thread at a time.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._calls: SimpleQueue[_Call[Any] | None] = SimpleQueue()
        self._thread: threading.Thread | None = None
        self._given_up: _Call[Any] | None = None

    @property
    def is_stuck(self) -> bool:
        """Whether a call that was given up has still not returned."""
        return self._given_up is not None and not self._given_up.over.is_set()

    def call(
        self,
        function: Callable[[], _Result],
        bound_s: float,
        look: Callable[[], None] | None = None,
    ) -> _Result:
        """Make a call and wait for it, and for one that was given up before.

        Parameters
        ----------
        bound_s
            How long to wait, s.
        look
            Called while it is waited, every tenth of a second; may raise, which gives the call up.

        Raises
        ------
        NoReturn
            If it did not return in time; from then on it may return at any moment.
        BaseException
            What the call raised.
        """
        until_s = time.monotonic() + bound_s
        if self._given_up is not None:
            # Nothing is begun behind a call that hangs: it would be done when nobody expects it.
            self._wait(self._given_up, until_s, look)
            self._given_up = None
        call: _Call[_Result] = _Call(function)
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name=self._name, daemon=True)
            self._thread.start()
        self._calls.put(call)
        self._wait(call, until_s, look)
        if call.error is not None:
            raise call.error
        return call.result  # type: ignore[return-value]

    def end(self) -> None:
        """Let the thread end when it is free."""
        if self._thread is not None:
            self._calls.put(None)
            self._thread = None

    def _wait(self, call: _Call[Any], until_s: float, look: Callable[[], None] | None) -> None:
        try:
            while not call.over.wait(max(0.0, min(_LOOK_S, until_s - time.monotonic()))):
                if look is not None:
                    look()
                if time.monotonic() >= until_s:
                    raise NoReturn(f"no return in {self._name}")
        except BaseException:
            self._given_up = call
            raise

    def _work(self) -> None:
        while (call := self._calls.get()) is not None:
            call.make()
