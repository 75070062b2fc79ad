"""The text of a file whose encoding nobody states.

Owns the order in which encodings are tried, and the refusal of what is no text. It finds no
columns.
"""

from __future__ import annotations

import codecs
import os
import re
from pathlib import Path

from daq.errors import FileFormatError
from daq.untrusted.bounded_text import read_bytes

__all__ = ["decoded", "text_in"]

_LIMIT_BYTES = 64 << 20
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_SHARE = 0.3
"""Of zero bytes at odd or even places, from which on a text is taken for UTF-16."""
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f]")


def text_in(path: Path) -> tuple[str, str]:
    """The text that a file holds, and the encoding that it was read in.

    Raises
    ------
    FileFormatError
        If it cannot be read, or is no text.
    """
    if os.path.isdir(path):
        raise FileFormatError(f"{path}: is a directory; give a file")
    try:
        content = read_bytes(path, _LIMIT_BYTES)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FileFormatError(f"{path}: cannot be read ({reason}); give a file") from error
    return decoded(content, path)


def decoded(content: bytes, path: Path) -> tuple[str, str]:
    """Bytes as text, and the encoding."""
    if not content.strip(b"\0 \t\r\n"):
        raise FileFormatError(f"{path}: is empty; give a file with a table")
    for encoding in _candidates(content):
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        # An old system's mark of the end of a file is none of the text.
        text = text.rstrip("\x00\x1a")
        if not _CONTROL.search(text):
            return text, {"utf-8-sig": "utf-8"}.get(encoding, encoding)
    raise FileFormatError(
        f"{path}: is not text; give a table as text, or a file whose suffix names its format"
    )


def _candidates(content: bytes) -> list[str]:
    for mark, encoding in _MARKS:
        if content.startswith(mark):
            return [encoding]
    head = content[:4096]
    even, odd = head[0::2].count(0), head[1::2].count(0)
    if odd > _SHARE * len(head) / 2 and even < odd / 4:
        return ["utf-16-le"]
    if even > _SHARE * len(head) / 2 and odd < even / 4:
        return ["utf-16-be"]
    return ["utf-8", "cp1252", "latin-1"]
