"""A child process that makes the source safe when its session cannot: the session's side of it.

Owns the child's start, the words between the two, and what follows where the child dies or does
not answer: another one. What the child does is in `daq.session.watchdog_child`.
"""

from __future__ import annotations

import json
import os
import subprocess
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

from daq.errors import InputError, MeasurementError
from daq.servers.place import HistoryPlace
from daq.session.watch import Watch
from daq.untrusted.child import child_command, child_environment

__all__ = ["MARGIN_S", "Watchdog"]

MARGIN_S = 10.0
"""Added to the time that a session announces; a busy machine may keep it from its beat."""
READY_S = 30.0
"""Bound of a child's start."""
_STARTS = 4
"""Children of one session; what ends more than these will end the next one, too."""
_DEAF_S = 10.0
"""A child that does not answer for so long is taken to be dead."""
_BEAT_S = 1.0
"""A beat is said anew after so long at the latest."""
_TAKING_S = 40.0
"""How long a session that lost the bench leaves the instrument to the child."""
_SEEING_S = 60.0
"""How long a session that could not prove the source off waits for its child to."""
_DISMISSAL_S = 5.0
_PAUSE_S = 0.02


class Watchdog(Watch):
    """Started before the instrument is opened, dismissed when its source is proven off.

    Used by one thread at a time.

    Parameters
    ----------
    url
        Address of the instrument, as for `daq.drivers.open_analyser`.
    history
        Where to write what came of it.
    lock
        Descriptor of the bench's lock, held until the child is done; None for none.

    Raises
    ------
    InputError
        If no process can be started.
    """

    def __init__(self, url: str, history: HistoryPlace, lock: int | None) -> None:
        self._words, self._secrets = (url, str(history)), dict[str, str]()
        if isinstance(history, Path):
            self._words = (url, os.path.abspath(history))
        elif history.password is not None:
            # Command lines are seen by everybody on the machine.
            self._secrets = {"PGPASSWORD": history.password}
        self._lock = lock
        self._measurement = 0
        self._remarks: list[str] = []
        self._until_s: float | None = None
        self._starts = 1
        self._child: _Child | None = _Child(self._words, lock, self._secrets)

    # ------------------------------------------------------------ for the session

    def measures(self, measurement: int) -> None:
        """Say which measurement the child is to write about."""
        self._measurement = measurement
        self._say(f"of {measurement}")

    def stand_by(self, look: Callable[[], None]) -> None:
        """See `Watch.stand_by`; a child that does not start is replaced once."""
        for attempt in (1, 2):
            child = self._present()
            while child.is_alive and not child.ready and not child.is_late:
                look()
                time.sleep(_PAUSE_S)
                child.hear()
            if child.ready:
                return
            told = child.how_it_ended()
            if attempt == 1:
                self._replace()
        raise MeasurementError(
            f"the watchdog, which would switch the source off if this program died, does not start "
            f"({told}); nothing was driven"
        )

    def beat(self, within_s: float = 0.0) -> None:
        """See `Watch.beat`; said to the child only where it changes much or a second has passed."""
        now_s = time.monotonic()
        until_s = now_s + within_s + MARGIN_S
        if self._until_s is not None and until_s <= self._until_s < until_s + 2 * _BEAT_S:
            return
        self._until_s = until_s + _BEAT_S
        self._say(f"drive {self._until_s - now_s:.3f}")

    def rest(self) -> None:
        """See `Watch.rest`."""
        self._until_s = None
        self._say("rest")

    def check(self) -> None:
        """See `Watch.check`; a child that died is replaced, and so is one that does not answer."""
        child = self._present()
        child.hear()
        if child.has_taken:
            self._lost(child)
        if child.is_alive and not child.is_deaf and not child.is_late:
            return
        told = child.how_it_ended()
        if self._starts >= _STARTS:
            raise MeasurementError(
                f"the watchdog ended {self._starts} times ({told}); without one nothing is driven"
            )
        self._replace()
        self._remarks.append(f"the watchdog ended ({told}); another one was started")

    def remarks(self) -> list[str]:
        """See `Watch.remarks`."""
        told, self._remarks = self._remarks, []
        return told

    # ------------------------------------------------------------ for whoever started it

    def leave(self) -> None:
        """Let it see to the source, which could not be proven off; nobody waits for it."""
        child = self._child
        if child is None:
            return
        child.hear()
        if not child.is_alive and self._starts < _STARTS:
            self._replace()
            child = self._present()
        self._child = None
        child.let_go()

    def see_to_it(self, look: Callable[[], bool]) -> str:
        """Leave the source to the child, as `leave` does, and wait for what it proves.

        Parameters
        ----------
        look
            Called while it is waited; False ends the wait, not the child.

        Returns
        -------
        str
            State of the source; empty where the child has not said.
        """
        child = self._child
        if child is None:
            return ""
        child.hear()
        if not child.is_alive and self._starts < _STARTS:
            self._replace()
            child = self._present()
        self._child = None
        child.hang_up()
        until_s = time.monotonic() + _SEEING_S
        # It writes into the history after it has said what it proved, and ends then.
        while child.is_alive and look() and time.monotonic() < until_s:
            time.sleep(_PAUSE_S)
            child.hear()
        child.let_go()
        return child.settled

    def write_down(self, state: str, text: str) -> None:
        """Let it write into the history, which does not answer now, that the source is off."""
        self._say(f"write {json.dumps([state, text])}")
        self.leave()

    def dismiss(self) -> None:
        """Tell it that the source is off; may be called twice."""
        child, self._child = self._child, None
        if child is None:
            return
        if child.ready:
            child.say("done")
            child.end(_DISMISSAL_S)
        else:
            child.end(0.0)

    # ------------------------------------------------------------ inside

    def _present(self) -> _Child:
        if self._child is None:
            raise MeasurementError("the watchdog was dismissed; nothing is driven without one")
        return self._child

    def _say(self, word: str) -> None:
        if self._child is not None:
            self._child.say(word)

    def _replace(self) -> None:
        self._present().end(0.0)
        self._child = _Child(self._words, self._lock, self._secrets)
        self._starts += 1
        if self._measurement:
            self._say(f"of {self._measurement}")
        if self._until_s is not None:
            self._say(f"drive {max(MARGIN_S, self._until_s - time.monotonic()):.3f}")

    def _lost(self, child: _Child) -> None:
        child.say("awake")
        until_s = time.monotonic() + _TAKING_S
        while child.is_alive and not child.settled and time.monotonic() < until_s:
            time.sleep(_PAUSE_S)
            child.hear()
        came = f"source {child.settled}" if child.settled else "it did not say what came of it"
        raise MeasurementError(
            f"the session stood still while it drove, and its watchdog took over: {came}; "
            "nothing more is driven"
        )


class _Child:
    """One process, and what it said."""

    def __init__(
        self, words: tuple[str, str], lock: int | None, secrets: Mapping[str, str]
    ) -> None:
        arguments = [*words, str(os.getpid()), "" if lock is None else str(lock)]
        command = child_command("daq.session.watchdog_child", *arguments)
        try:
            # A session of its own: Ctrl-C in the terminal is not for the child. No
            # output: whoever reads ours must see its end when we end.
            self._process = subprocess.Popen(
                command,
                bufsize=0,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=child_environment(OPENBLAS_NUM_THREADS="1", **secrets),
                pass_fds=() if lock is None else (lock,),
                start_new_session=True,
            )
        except OSError as error:
            raise InputError(f"the watchdog cannot be started ({error.strerror})") from error
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._in, self._out = self._process.stdin, self._process.stdout
        # A child that is stopped takes nothing, and must not hold the session.
        os.set_blocking(self._in.fileno(), False)
        os.set_blocking(self._out.fileno(), False)
        self._heard = b""
        self._started_s = time.monotonic()
        self._asked_s: float | None = None
        self._why = ""
        self.is_alive = True
        self.ready = False
        self.has_taken = False
        self.settled = ""

    @property
    def is_late(self) -> bool:
        """Whether it should have been ready."""
        return not self.ready and time.monotonic() - self._started_s > READY_S

    @property
    def is_deaf(self) -> bool:
        """Whether it was spoken to and has not answered."""
        asked_s = self._asked_s if self.ready else None
        return asked_s is not None and time.monotonic() - asked_s > _DEAF_S

    def say(self, word: str) -> None:
        """Say one thing; nothing happens where it cannot be heard."""
        if self._asked_s is None and word.startswith("drive"):
            self._asked_s = time.monotonic()
        with suppress(OSError, ValueError):
            self._in.write(f"{word}\n".encode("ascii"))

    def hear(self) -> None:
        """Take in what it said, without waiting."""
        while self.is_alive:
            try:
                came = os.read(self._out.fileno(), 4096)
            except BlockingIOError:
                return
            if not came:
                self.is_alive = False
                return
            *lines, self._heard = (self._heard + came).split(b"\n")
            for line in lines:
                self._take(line.decode("ascii", "replace"))

    def _take(self, line: str) -> None:
        word, _, rest = line.partition(" ")
        self._asked_s = None
        if word == "ready":
            self.ready = True
        elif word == "failed":
            self._why = rest
        elif word == "taken":
            self.has_taken = True
        elif word == "settled":
            self.settled = rest

    def how_it_ended(self) -> str:
        """In words."""
        if self._why:
            return self._why
        if self.is_alive:
            return f"no sign of life within {_DEAF_S if self.ready else READY_S:g} s"
        with suppress(subprocess.TimeoutExpired):
            code = self._process.wait(1.0)
            return f"signal {-code}" if code < 0 else f"exit code {code}"
        return "it closed its pipe"

    def hang_up(self) -> None:
        """Speak no more to it, and hear what it says."""
        with suppress(OSError):
            self._in.close()

    def let_go(self) -> None:
        """Speak no more to it; it goes on by itself."""
        self._close()
        threading.Thread(target=self._process.wait, daemon=True).start()

    def end(self, patience_s: float) -> None:
        """See it end, in so long, or end it."""
        self._close()
        try:
            self._process.wait(patience_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            # One that hangs in the kernel is not waited for.
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_DISMISSAL_S)

    def _close(self) -> None:
        with suppress(OSError):
            self._in.close()
        with suppress(OSError):
            self._out.close()
