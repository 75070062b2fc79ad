"""A child process that makes the source safe when its session could not.

Owns that child: it waits for the session's last word on a pipe, and where the
pipe breaks without one, as where the session was killed outright or could not
prove the source off, it opens the instrument anew, runs the safe-off recipe and
writes into the history what it could prove. It helps only where the transport
can be opened again; the next session checks the source in any case.
While the session lives it touches nothing.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

from daq.errors import InputError, LashbenchError

__all__ = ["Watchdog", "main"]

_DONE = b"done\n"
_TRIES, _TRYING_S = 5, 25.0
"""How often the instrument is opened anew, and until when: the next session waits for this one."""
_BETWEEN_S = 1.0
_DISMISSAL_S = 5.0
_NO_WORD = "the session ended without proving the source off"


class Watchdog:
    """Started before the source drives, dismissed when it is proven off.

    Parameters
    ----------
    url
        Address of the instrument, as for `daq.transports.open.open_transport`.
    history, measurement
        Where to write what came of it.
    lock
        Descriptor of the bench's lock, held until the child is done; None for none.
    """

    def __init__(self, url: str, history: Path, measurement: int, lock: int | None) -> None:
        self._child: subprocess.Popen[bytes] | None = None
        try:
            # A session of its own: Ctrl-C in the terminal is not for the child. No
            # output: whoever reads ours must see its end when we end.
            self._child = subprocess.Popen(
                [sys.executable, "-m", "daq.watchdog", url, str(history), str(measurement)],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                pass_fds=() if lock is None else (lock,),
                start_new_session=True,
            )
        except OSError as error:
            raise InputError(f"the watchdog cannot be started ({error.strerror})") from error

    def leave(self) -> None:
        """Let it see to the source, which could not be proven off; nobody waits for it."""
        child, self._child = self._child, None
        if child is not None and child.stdin is not None:
            child.stdin.close()
            threading.Thread(target=child.wait, daemon=True).start()

    def dismiss(self) -> None:
        """Tell it that the source is off; may be called twice."""
        child, self._child = self._child, None
        if child is None or child.stdin is None:
            return
        with contextlib.suppress(BrokenPipeError):
            child.stdin.write(_DONE)
            child.stdin.close()
        try:
            child.wait(_DISMISSAL_S)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()


def main(arguments: list[str]) -> int:
    """Wait for the last word; make safe if it does not come.

    Parameters
    ----------
    arguments
        URL, history, measurement.
    """
    url, history, measurement = arguments
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            # The session is told to end by the same signal and will say so; only
            # its silence counts here.
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    if sys.stdin.buffer.read().endswith(_DONE):
        return 0
    text, state = _make_safe(url)
    with contextlib.suppress(LashbenchError):
        _write_down(Path(history), int(measurement), text, state)
    return 0


def _make_safe(url: str) -> tuple[str, str]:
    from daq.analyser import SourceState
    from daq.hp35670a import HP35670A
    from daq.transports.open import open_transport

    state, found, until_s = SourceState.UNKNOWN, "", time.monotonic() + _TRYING_S
    for _ in range(_TRIES):
        try:
            analyser = HP35670A(open_transport(url))
        except LashbenchError as error:
            found = f", and {error}"
        else:
            state = analyser.make_safe()
            analyser.close()
            found = f"; source {state.value}"
        if state is SourceState.CONFIRMED_OFF or time.monotonic() > until_s:
            break
        time.sleep(_BETWEEN_S)
    return f"{_NO_WORD}{found}", state.value


def _write_down(history: Path, measurement: int, text: str, state: str) -> None:
    from daq.analyser import SourceState
    from daq.store import Store

    with Store(history) as store:
        # The session may have ended well and died before its last word here.
        if store.measurement(measurement).source_state is not SourceState.CONFIRMED_OFF:
            store.set_source_state(measurement, SourceState(state))
        store.note(measurement, "watchdog", text)


if __name__ == "__main__":
    code = main(sys.argv[1:])
    # Nothing that is still open may hold the lock longer than this.
    os._exit(code)
