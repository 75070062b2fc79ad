"""What every driver of an analyser does alike: hooks of a wait, going safe, the end of a sweep.

Owns who may end a running sweep, and that the source is quiet at every end of one. It knows no
command of any instrument.
"""

from __future__ import annotations

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

from daq.analyser import SourceState
from daq.driving.conversation import Conversation
from daq.driving.safe_off import SafeOff
from daq.errors import LashbenchError, MeasurementError
from daq.transports.base import Transport

__all__ = ["DrivenAnalyser", "Guard"]

Guard = Callable[[], None]
"""Called between exchanges of a sweep; raises where it has to end."""

_LOCK_PATIENCE_S = 6.0
"""How long going safe waits for an exchange of another thread to end before it goes on anyway."""

_QUIET_REPLY_S = 1.0
"""Bound of a reply while a sweep that failed is made quiet; the safe-off recipe follows."""

_Talk = TypeVar("_Talk", bound=Conversation)
_SetUp = TypeVar("_SetUp")


class DrivenAnalyser(ABC, Generic[_Talk, _SetUp]):
    """The part of the `Analyser` protocol that no instrument is needed for.

    Parameters
    ----------
    transport
        Open wire to the instrument; closed with the driver.
    dialogue
        The conversation over it.
    """

    def __init__(self, transport: Transport, dialogue: _Talk) -> None:
        self.safe_off: SafeOff | None = None
        """What the last run of the safe-off recipe did, step by step."""
        self._transport = transport
        self._dialogue = dialogue
        self._setup: _SetUp | None = None
        self._times_made_safe = 0

    @property
    def on_wait(self) -> Callable[[], None] | None:
        """Called at least five times a second while an operation is waited for; may raise.

        A reply that does not come is not interrupted: it has a bound of its own.
        """
        return self._dialogue.on_wait

    @on_wait.setter
    def on_wait(self, look: Callable[[], None] | None) -> None:
        self._dialogue.on_wait = look

    @property
    def on_exchange(self) -> Callable[[float], None] | None:
        """Told before each exchange how long it may take at most, s; must not raise."""
        return self._dialogue.on_exchange

    @on_exchange.setter
    def on_exchange(self, told: Callable[[float], None] | None) -> None:
        self._dialogue.on_exchange = told

    @property
    def wire_lacks(self) -> tuple[str, ...]:
        """What the way to the instrument turned out not to have, such as a serial poll."""
        return tuple(getattr(self._transport, "lacks", ()))

    def make_safe(self) -> SourceState:
        """Run the safe-off recipe and say what could be proven; see `safe_off` for the steps.

        May be called twice and from any thread, and never raises.
        """
        self._times_made_safe += 1
        self._setup = None
        # An exchange of another thread is let finish, so that its reply is not taken for
        # ours; one that hangs longer than its own bound is not waited for.
        held = self._dialogue.lock.acquire(timeout=_LOCK_PATIENCE_S)
        try:
            self._dialogue.trusted = False
            self.safe_off = self._switch_off()
        finally:
            if held:
                self._dialogue.lock.release()
        return self.safe_off.state

    def close(self) -> None:
        """Let go of the connection; does not touch the source."""
        self._transport.close()

    @abstractmethod
    def _switch_off(self) -> SafeOff:
        """Run the recipe of the instrument; never raises."""

    @abstractmethod
    def _resynchronise(self) -> None:
        """Drop what is left of an exchange that was interrupted."""

    @abstractmethod
    def _quiet(self) -> None:
        """Stop measuring, and take level and offset to 0."""

    @contextlib.contextmanager
    def _driving(self) -> Iterator[Guard]:
        """Drive the source inside the block; it is quiet after it, however that ends.

        Gives what raises `MeasurementError` once the source was made safe from elsewhere.
        """
        times = self._times_made_safe

        def guard() -> None:
            if self._times_made_safe != times:
                raise MeasurementError("the source was made safe while the sweep ran; it ends here")
            if self.on_wait is not None:
                self.on_wait()

        try:
            yield guard
        except BaseException as error:
            # The first fault is the one to report; the session makes safe in any case.
            with contextlib.suppress(LashbenchError):
                if not isinstance(error, LashbenchError):
                    # An interrupt may have come between question and answer.
                    self._resynchronise()
                with self._dialogue.hurrying(_QUIET_REPLY_S):
                    self._quiet()
            self._dialogue.trusted = False
            raise
        self._quiet()
