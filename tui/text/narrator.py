"""Narration from a thread of its own, for work that must not wait for whoever reads it.

Owns that thread and the order of what it writes. A terminal that takes no more output (a frozen
ssh, a multiplexer that was halted) holds whoever writes to it for as long as it likes, and a
measurement would stand still there, its source driving.
"""

from __future__ import annotations

import os
import threading
from contextlib import suppress
from queue import SimpleQueue
from typing import TextIO

__all__ = ["Narrator"]

_AHEAD = 50
"""Pieces that may wait before what is drawn for a moment only is left out."""


class Narrator:
    """Writes to a stream while somebody takes it, and never makes who speaks wait.

    Parameters
    ----------
    stream
        With a file behind it. Whoever uses it beside this must see that nothing waits first.
    """

    def __init__(self, stream: TextIO) -> None:
        self._file = stream.fileno()
        self._encoding = stream.encoding or "utf-8"
        # Nothing else may be put into by a signal handler at any moment.
        self._waiting: SimpleQueue[bytes | threading.Event | None] = SimpleQueue()
        # Not the stream's own writing: that holds a lock which the end of the program asks for.
        self._writer = threading.Thread(target=self._write, name="narrator", daemon=True)
        self._writer.start()

    def say(self, text: str, fleeting: bool = False) -> bool:
        """Have something written, `fleeting` only while little else waits; whether it will be."""
        if fleeting and self._waiting.qsize() >= _AHEAD:
            return False
        self._waiting.put(text.encode(self._encoding, "replace"))
        return True

    @property
    def is_behind(self) -> bool:
        """Whether something waits to be written."""
        return not self._waiting.empty()

    def has_said_all(self, patience_s: float) -> bool:
        """Whether all was written, in so long at most."""
        said = threading.Event()
        self._waiting.put(said)
        return said.wait(patience_s)

    def end(self) -> None:
        """Nothing more will be said."""
        self._waiting.put(None)

    def _write(self) -> None:
        while (piece := self._waiting.get()) is not None:
            if isinstance(piece, threading.Event):
                piece.set()
                continue
            # Whoever stopped listening does not stop the work.
            with suppress(OSError):
                while piece:
                    piece = piece[os.write(self._file, piece) :]
