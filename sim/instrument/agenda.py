"""The instrument's own time: what happens when, as a list of events.

Owns the agenda and the processes on it. It never looks at a clock: whoever
paces the instrument says how far time has come, or asks for the next event.
That makes fast operation exact and repeatable.
"""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable, Generator
from dataclasses import dataclass, field

__all__ = ["HOLD", "Agenda", "Entry", "Process", "Steps"]

HOLD: float = -1.0
"""Yielded by a process that waits to be woken."""

Steps = Generator[float, None, None]
"""A process: it yields how many seconds pass before it goes on, or `HOLD`."""


@dataclass(order=True, slots=True)
class Entry:
    """One event; `work` is False for those that nobody waits for."""

    due_s: float
    order: int
    action: Callable[[], None] = field(compare=False)
    work: bool = field(compare=False)
    cancelled: bool = field(compare=False, default=False)


class Agenda:
    """Events in order of time."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self._heap: list[Entry] = []
        self._order = itertools.count()

    def after(self, delay_s: float, action: Callable[[], None], *, work: bool = True) -> Entry:
        """Do something `delay_s` from now."""
        entry = Entry(self.now_s + delay_s, next(self._order), action, work)
        heapq.heappush(self._heap, entry)
        return entry

    @property
    def has_work(self) -> bool:
        """Whether any event is left that somebody may wait for."""
        return any(entry.work and not entry.cancelled for entry in self._heap)

    @property
    def next_s(self) -> float | None:
        """When the next event is due, None if there is none."""
        while self._heap and self._heap[0].cancelled:
            heapq.heappop(self._heap)
        return self._heap[0].due_s if self._heap else None

    def run_until(self, time_s: float) -> None:
        """Do all that is due up to `time_s` and let time come to it."""
        while (due := self.next_s) is not None and due <= time_s:
            self._do_first()
        self.now_s = max(self.now_s, time_s)

    def run_next(self) -> bool:
        """Jump to the next event; False, without any jump, when there is no work."""
        if not self.has_work or self.next_s is None:
            return False
        self._do_first()
        return True

    def _do_first(self) -> None:
        entry = heapq.heappop(self._heap)
        self.now_s = max(self.now_s, entry.due_s)
        entry.action()

    def start(self, steps: Steps, done: Callable[[], None] | None = None) -> Process:
        """Run a process, its first step at once."""
        process = Process(self, steps, done)
        process.wake()
        return process


class Process:
    """A running generator of delays."""

    def __init__(self, agenda: Agenda, steps: Steps, done: Callable[[], None] | None) -> None:
        self._agenda = agenda
        self._steps = steps
        self._done = done
        self._entry: Entry | None = None
        self._inside = False
        self.alive = True

    def wake(self) -> None:
        """Go on now, whatever delay is running."""
        if not self.alive or self._inside:
            return
        if self._entry is not None:
            self._entry.cancelled = True
        self._entry = None
        self._inside = True
        try:
            delay_s = next(self._steps)
        except StopIteration:
            self.alive = False
            if self._done is not None:
                self._done()
            return
        finally:
            self._inside = False
        if self.alive and delay_s >= 0:
            self._entry = self._agenda.after(delay_s, self.wake)

    def resume(self) -> None:
        """Go on if it holds; a delay that is running is left to run out."""
        if self._entry is None:
            self.wake()

    def stop(self) -> None:
        """End without finishing; `done` is not called."""
        self.alive = False
        if self._entry is not None:
            self._entry.cancelled = True
        if not self._inside:
            self._steps.close()
