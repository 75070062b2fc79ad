"""Serial numbers as a scanner or a keyboard types them.

Owns how a stream of bytes becomes lines, and what is taken off a line. It waits for nobody but
the stream, and it knows no unit.
"""

from __future__ import annotations

import os
import re
from typing import TextIO

from daq.errors import InputError

__all__ = ["Scanner", "clean_serial"]

_ENDS = re.compile(rb"\r\n|[\r\n]")
_SYMBOLOGY = re.compile(r"\][A-Za-z][0-9A-Za-z]")
"""Prefix by which a scanner names the kind of code, ISO/IEC 15424."""
_PIECE = 4096
_LONGEST = 200


class Scanner:
    """Lines of a stream; a line ends with Enter, as carriage return, line feed or both."""

    def __init__(self, stream: TextIO) -> None:
        self._file = stream.fileno()
        self._bytes = b""
        self._ended = False
        self._was_return = False

    def line(self) -> str | None:
        """The next line without its end; None where nothing more comes."""
        while not (found := _ENDS.search(self._bytes)):
            if self._ended:
                rest, self._bytes = self._bytes, b""
                return rest.decode("utf-8", "replace") if rest.strip() else None
            piece = os.read(self._file, _PIECE)
            self._ended = not piece
            if self._was_return and piece.startswith(b"\n"):
                piece = piece[1:]
            self._was_return = False
            self._bytes += piece
        # The line feed of a pair may come later.
        self._was_return = found.group() == b"\r" and found.end() == len(self._bytes)
        line, self._bytes = self._bytes[: found.start()], self._bytes[found.end() :]
        return line.decode("utf-8", "replace")


def clean_serial(text: str) -> str:
    """A serial number without what a scanner adds: control characters, blanks, a code's prefix.

    Raises
    ------
    InputError
        If what is left is too long or holds characters that are not printable.
    """
    start, end = 0, len(text)
    while start < end and _is_added(text[start]):
        start += 1
    while end > start and _is_added(text[end - 1]):
        end -= 1
    serial = text[start:end]
    if len(serial) > 3 and _SYMBOLOGY.match(serial):
        serial = serial[3:]
    if not serial.isprintable() or "\ufffd" in serial:
        raise InputError(f"serial number {serial!r} is not one line of text; scan it again")
    if len(serial) > _LONGEST:
        raise InputError(
            f"serial number {serial[:20]!r}... has {len(serial)} characters, more than {_LONGEST}; "
            "scan it again"
        )
    return serial


def _is_added(sign: str) -> bool:
    return sign.isspace() or not sign.isprintable()
