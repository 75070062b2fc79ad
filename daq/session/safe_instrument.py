"""The instrument as a session holds it: made safe whatever happens, over a new wire if need be.

Owns the promise that the safe-off recipe runs to its end, and the second
connection where the first is dead. It measures nothing and knows no store.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress

from daq.analyser import Analyser, SourceState
from daq.control import SessionControl
from daq.errors import LinkError
from daq.session.watch import Watch

__all__ = ["HeldInstrument"]

_SAFE_TRIES = 10
"""How often the safe-off recipe is begun again when a key press breaks it."""
_SAFE_S = 8.0
"""Announced for the beginning of the safe-off recipe, which may wait for another thread."""
_OPENING_S = 12.0
"""Announced for opening a connection anew."""
_RECONNECT_S = 0.3
"""Pause before a dead connection is opened anew; a gateway must see first that it is gone."""
_RECONNECTING_S = 6.0
"""How long it is tried while nobody is there: an adapter that restarts comes back."""


class HeldInstrument:
    """An analyser for the length of a session.

    Parameters
    ----------
    analyser
        Connected, and closed by whoever gave it.
    control
        Told of key presses that came as exceptions.
    reopen
        Connects once more; None where there is no such way.
    watch
        Told that the session lives, and asked whether it still has the instrument.
    """

    def __init__(
        self,
        analyser: Analyser,
        control: SessionControl,
        reopen: Callable[[], Analyser] | None,
        watch: Watch,
    ) -> None:
        self.analyser = analyser
        """The connection in use."""
        self._given = analyser
        self._control = control
        self._reopen = reopen
        self._watch = watch

    @property
    def is_new_connection(self) -> bool:
        """Whether the connection in use is one that was opened here."""
        return self.analyser is not self._given

    def listen(self) -> None:
        """Let waits be ended by the control, and by a watchdog that took the instrument."""
        self.analyser.on_wait = self._look
        self.analyser.on_exchange = self._watch.beat

    def make_safe(self) -> SourceState:
        """Run the safe-off recipe to its end, over a new connection if the old one is dead."""
        state = self._off()
        if (
            state is SourceState.UNKNOWN
            and self._reopen is not None
            and self._connect(self._reopen)
        ):
            state = self._off()
        return state

    def let_go(self) -> None:
        """Close a connection that was opened here."""
        if self.is_new_connection:
            self.analyser.close()
            self.analyser = self._given

    def _look(self) -> None:
        self._control.check()
        self._watch.check()
        self._watch.beat()

    def _off(self) -> SourceState:
        """The recipe, begun again when a key press breaks it."""
        self.analyser.on_wait = None
        for _ in range(_SAFE_TRIES):
            self._watch.beat(_SAFE_S)
            with suppress(KeyboardInterrupt):
                try:
                    return self.analyser.make_safe()
                except Exception:
                    # It promises not to raise; one that does has proven nothing.
                    return SourceState.UNKNOWN
            self._control.interrupt("interrupted from the keyboard")
        return SourceState.UNKNOWN

    def _connect(self, reopen: Callable[[], Analyser]) -> bool:
        # Whatever a dead connection has to say at its end is no reason not to try another.
        with suppress(Exception):
            self.analyser.close()
        until_s = time.monotonic() + _RECONNECTING_S
        while True:
            try:
                self._watch.beat(_OPENING_S)
                time.sleep(_RECONNECT_S)
                self.analyser = reopen()
                self.analyser.on_exchange = self._watch.beat
            except LinkError:
                if time.monotonic() > until_s:
                    return False
            except Exception:
                return False
            except KeyboardInterrupt:
                self._control.interrupt("interrupted from the keyboard")
                return False
            else:
                return True
