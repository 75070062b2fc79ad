"""The watchdog itself: a process that makes the source safe where its session does not.

Owns what that process does. It loads all that it will need and says so; then it listens. Where the
session is gone without a last word, or silent for longer than it announced, it opens the
instrument anew, runs the safe-off recipe, and writes into the history what it could prove. It
helps only where the instrument can be opened again; the next session checks the source in any case.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import sys
import threading
import time

from daq.analyser import SourceState
from daq.errors import LashbenchError, LinkError, MeasurementError
from daq.servers.place import HistoryPlace, HistoryServer, parse_place

__all__ = ["load", "main", "make_safe", "write_down"]

_TRIES, _TRYING_S = 3, 25.0
"""How often an instrument that says nothing is asked, and until when it is opened anew while
nobody is there: an adapter that restarts comes back. The next session waits for this one."""
_BETWEEN_S = 1.0
_SLICE_S = 0.25
"""How long one wait for a word is; a longer one shows that this process itself stood still."""
_LOCKED_S = 5.0
"""How long the bench stays locked for what is to be written into its history."""
_WRITING_S = 120.0
"""How long a history that does not answer is waited for."""
_IN, _OUT = 0, 1


def main(words: list[str]) -> int:
    """Stand by for one session; does not return before its work is done.

    Parameters
    ----------
    words
        URL, history, process of the session, descriptor of the bench's lock ("" for none).
    """
    url, history, session, lock = words
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            # The session is told to end by the same signal and will say so; only
            # its silence counts here.
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    stand = _Stand(url, parse_place(history), int(session), int(lock) if lock else None)
    try:
        load(url, history)
    except Exception as error:
        stand.say(f"failed {type(error).__name__}: {' '.join(str(error).split())}")
        stand.leave(1)
    stand.say("ready")
    stand.listen()
    stand.leave(0)
    return 0


def load(url: str, history: str = "") -> None:
    """Import everything that will be needed: later there may be no file system to load it from."""
    import sqlalchemy as sa

    import daq.store  # noqa: F401
    from daq.drivers import load_all_of
    from daq.plan import SweepPlan

    load_all_of(url)
    # What a stored plan is checked with is loaded with the first plan.
    SweepPlan((1.0,), (1.0,))
    # Its dialect, and its first statement, are loaded with the first use.
    place = parse_place(history)
    if isinstance(place, HistoryServer):
        from daq.store import Store

        with Store(place) as store:
            store.count()
        return
    engine = sa.create_engine("sqlite://")
    with engine.begin() as connection:
        connection.execute(sa.select(sa.literal(1)))
    engine.dispose()


def make_safe(url: str, tries: int = _TRIES) -> tuple[SourceState, str]:
    """Open the instrument anew and switch its source off; what was proven, and that in words."""
    from daq.drivers import open_analyser

    state, found, until_s = SourceState.UNKNOWN, "", time.monotonic() + _TRYING_S
    left, waits = tries, tries > 1
    while True:
        try:
            analyser = open_analyser(url)
        except LashbenchError as error:
            found = f", and {error}"
            left -= 0 if waits and isinstance(error, LinkError) else 1
        else:
            state = analyser.make_safe()
            analyser.close()
            found = f"; source {state.value}"
            left -= 1
        if state is SourceState.CONFIRMED_OFF or left < 1 or time.monotonic() > until_s:
            return state, found
        time.sleep(_BETWEEN_S)


def write_down(history: HistoryPlace, measurement: int, text: str, state: SourceState) -> None:
    """Write into the history, again and again where it is full or held by another program."""
    from daq.store import Store

    until_s = time.monotonic() + _WRITING_S
    while True:
        try:
            with Store(history) as store:
                # The session may have ended well and died before its last word here.
                found = store.measurement(measurement)
                if found.source_state is not SourceState.CONFIRMED_OFF:
                    store.set_source_state(measurement, state)
                store.note(measurement, "watchdog", text)
            return
        except MeasurementError:
            if time.monotonic() > until_s:
                return
            time.sleep(_BETWEEN_S)
        except LashbenchError:
            return


class _Stand:
    """One session, as it is seen from here."""

    def __init__(self, url: str, history: HistoryPlace, session: int, lock: int | None) -> None:
        self._url = url
        self._history = history
        self._session = session
        self._lock = lock
        self._measurement = 0
        self._said = b""
        self._allowed_s: float | None = None
        self._silent_s = 0.0
        self._is_taken = False
        self._is_awake = False
        self._is_done = False
        self._writer: threading.Thread | None = None

    def say(self, line: str) -> None:
        """Say one thing to the session, if it still listens."""
        with contextlib.suppress(OSError):
            os.write(_OUT, f"{line}\n".encode("ascii", "replace"))

    def listen(self) -> None:
        """Hear the session to its end, and do what has to be done."""
        while not self._is_done:
            if self._hear(_SLICE_S):
                continue
            if self._allowed_s is not None and self._silent_s > self._allowed_s:
                self._take_over()

    def leave(self, code: int) -> None:
        """End; nothing that is still open may hold the lock, or the end, for longer."""
        os._exit(code)

    def _hear(self, wait_s: float) -> bool:
        """Wait for a word; whether one came."""
        began_s = time.monotonic()
        if not select.select([_IN], [], [], wait_s)[0]:
            # Time in which this process stood still, as on a machine that was halted, is no
            # silence of the session.
            self._silent_s += min(time.monotonic() - began_s, 2 * wait_s)
            return False
        came = os.read(_IN, 4096)
        if not came:
            self._is_done = True
            self._session_is_gone()
            return True
        *lines, self._said = (self._said + came).split(b"\n")
        for line in lines:
            self._take(line.decode("ascii"))
        return True

    def _take(self, line: str) -> None:
        word, _, rest = line.partition(" ")
        self._silent_s = 0.0
        if word == "done":
            self._is_done = True
            self.leave(0)
        elif word == "of":
            self._measurement = int(rest)
        elif word == "drive":
            # What was taken stays taken: the session learns it when it looks.
            self._allowed_s = None if self._is_taken else float(rest)
            self.say("here")
        elif word == "rest":
            self._allowed_s = None
        elif word == "awake":
            self._is_awake = True
        elif word == "write":
            state, text = json.loads(rest)
            self._is_done = True
            self._write(text, SourceState(state))

    def _session_is_gone(self) -> None:
        state, found = make_safe(self._url)
        self.say(f"settled {state.value}")
        self._write(f"the session ended without proving the source off{found}", state)

    def _take_over(self) -> None:
        """The session is silent: it lost the bench, which it learns when it looks."""
        self._is_taken, self._allowed_s = True, None
        self.say("taken")
        silent = f"the session stood still for {self._silent_s:.0f} s while it drove"
        state, found = make_safe(self._url, tries=1)
        if state is SourceState.UNKNOWN and not self._hear(0.0) and self._end_session():
            # It may hold the instrument, and is of no use to anybody any more.
            silent += f", kept process {self._session} from the instrument and was ended"
            state, found = make_safe(self._url)
        elif state is SourceState.UNKNOWN and not self._is_done:
            state, found = make_safe(self._url)
        self.say(f"settled {state.value}")
        text = f"{silent}; the watchdog took over{found}"
        self._write(text, state)

    def _end_session(self) -> bool:
        """Kill it, as nothing else ends a process that stands still; whether it was there."""
        if os.getppid() != self._session:
            return False
        with contextlib.suppress(OSError):
            os.kill(self._session, signal.SIGKILL)
            time.sleep(_BETWEEN_S)
            return True
        return False

    def _write(self, text: str, state: SourceState) -> None:
        words = (self._history, self._measurement, text, state)
        earlier = self._writer

        def write() -> None:
            # In the order in which it came about, however long the history keeps quiet.
            if earlier is not None:
                earlier.join()
            write_down(*words)

        self._writer = writer = threading.Thread(target=write, daemon=True)
        writer.start()
        if not self._is_done:
            return
        writer.join(_LOCKED_S)
        if self._lock is not None:
            # The source is seen to; the next session need not wait for a file system.
            with contextlib.suppress(OSError):
                os.close(self._lock)
        writer.join(_WRITING_S)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
