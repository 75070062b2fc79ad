"""The files that SQLite keeps beside a history: whether what lies there is SQLite's.

Owns that look, which comes before SQLite opens the history: it would write into whatever has
such a name, and remove it. It opens no history and changes nothing.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from daq.errors import InputError

__all__ = ["check_beside"]

_INDEX = 3007000
_HEADS = {
    "-wal": (b"\x37\x7f\x06\x82", b"\x37\x7f\x06\x83"),
    "-shm": (_INDEX.to_bytes(4, "little"), _INDEX.to_bytes(4, "big")),
    "-journal": (b"\xd9\xd5\x05\xf9",),
}
"""How each kind of file begins (sqlite.org/fileformat.html, walformat.html); or with zeros, as
one that was not begun, is done with, or was cut short by a power cut."""


def check_beside(history: Path) -> None:
    """Refuse a history beside which something else has the name of one of SQLite's files.

    Parameters
    ----------
    history
        The file itself, links followed.

    Raises
    ------
    InputError
        If there is a link, a second name of a file, something that is no file, or other content.
    """
    for ending, heads in _HEADS.items():
        beside = history.with_name(history.name + ending)
        what = _fault(beside, heads)
        if what is not None:
            raise InputError(
                f"{beside}: {what}, and is not SQLite's; nothing was written into it, move it away"
            )


def _fault(beside: Path, heads: tuple[bytes, ...]) -> str | None:
    flags = os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    try:
        handle = os.open(beside, flags | getattr(os, "O_CLOEXEC", 0))
    except OSError as error:
        # What cannot be opened here SQLite cannot open either, and says so.
        return "is a link" if error.errno == errno.ELOOP else None
    try:
        found = os.fstat(handle)
        if not stat.S_ISREG(found.st_mode):
            return "is not a regular file"
        if found.st_nlink > 1:
            return "has another name, too, a hard link"
        begins = os.read(handle, 4)
    except OSError:
        return None
    finally:
        os.close(handle)
    return None if begins in heads or not any(begins) else "holds something else"
