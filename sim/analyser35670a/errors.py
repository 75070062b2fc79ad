"""The error queue of the simulated analyser, and the error that a command raises.

Owns the numbers and general texts of the instrument's error list and the
queue of five. It decides nothing about when an error is due and sets no
status bit.
"""

from __future__ import annotations

from collections import deque

__all__ = ["QUEUE_DEPTH", "TOO_MANY", "ErrorQueue", "ScpiError"]

QUEUE_DEPTH = 5
TOO_MANY = -350
"""[S] Number of the last entry after an overflow; the maker's list has none."""

_TEXTS = {
    -100: "Command error",
    -104: "Parameter not allowed",
    -109: "Missing parameter",
    -113: "Undefined header",
    -120: "Illegal parameter",
    -131: "Invalid suffix",
    -141: "Invalid character data",
    -151: "Invalid string data",
    -161: "Invalid block data",
    -200: "Execution error",
    -211: "Trigger ignored",
    -212: "Arm ignored",
    -220: "Parameter error",
    -221: "Settings conflict",
    -222: "Data out of range",
    -224: "Illegal parameter value",
    -230: "Data corrupt or stale",
    -240: "Hardware error",
    -241: "Configuration error",
    -252: "Missing media",
    -280: "Program error",
    -310: "System error",
    -311: "Memory error",
    -350: "Queue overflow",
    -400: "Query error",
    -410: "Query interrupted",
    -420: "Query unterminated",
    -430: "Query deadlocked",
    -440: "Query unterminated after indefinite response",
}


class ScpiError(Exception):
    """A command was refused; `number` goes into the error queue.

    Parameters
    ----------
    number
        Negative number of the instrument's error list.
    detail
        Cause, appended to the general text after a semicolon.
    """

    def __init__(self, number: int, detail: str = "") -> None:
        super().__init__(number, detail)
        self.number = number
        self.detail = detail


class ErrorQueue:
    """First in, first out, five deep; on overflow the oldest stay and the last says so."""

    def __init__(self) -> None:
        self._entries: deque[tuple[int, str]] = deque()

    def __len__(self) -> int:
        return len(self._entries)

    def push(self, number: int, detail: str = "") -> None:
        """Add an entry, or mark the overflow."""
        if len(self._entries) == QUEUE_DEPTH:
            self._entries[-1] = (TOO_MANY, "Too many errors")
            return
        self._entries.append((number, detail))

    def pop(self) -> str:
        """The oldest entry as ``SYST:ERR?`` returns it; removes it."""
        if not self._entries:
            return '+0,"No error"'
        number, detail = self._entries.popleft()
        text = _TEXTS.get(number, "Device-specific error")
        # A quote inside a quoted string is doubled, or the reply could not be read.
        shown = (f"{text}; {detail}" if detail else text).replace('"', '""')
        return f'{number:+d},"{shown}"'

    def clear(self) -> None:
        """Empty the queue."""
        self._entries.clear()
