"""Files that appear whole or not at all.

Owns the way a result reaches its name: written beside it, flushed to the
disk, then renamed. It knows nothing of what is inside and never touches the
old file before the new one is complete.
"""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from daq.errors import InputError, LashbenchError

__all__ = [
    "append_line",
    "checked_target",
    "file_stem",
    "keeping",
    "new_target",
    "replacing",
    "write_text",
]

_PIECE = 1 << 16


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """Give a new file to write to; it becomes `path` when the block ends well.

    It lies in the same directory under a name that was free, and is never opened by
    that name again. On any failure it is removed and `path` is as it was.

    Raises
    ------
    InputError
        If no file can be made at `path`.
    LashbenchError
        If the disk refuses the data.
    """
    target = checked_target(path)
    partial = _partial(target)
    try:
        with partial.open("xb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(partial, target)
        _flush(target.parent)
    except PermissionError as error:
        raise InputError(f"{path}: may not be written ({error.strerror})") from error
    except OSError as error:
        raise LashbenchError(f"{path}: could not be written ({error.strerror or error})") from error
    finally:
        with suppress(OSError):
            partial.unlink()


@contextmanager
def keeping(path: Path) -> Iterator[BinaryIO]:
    """Give a file to write to what can be made again; it becomes `path` when the block ends well.

    Where that fails nothing is left, and nothing is said: it costs time later.
    """
    partial = _partial(path)
    with suppress(OSError):
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    try:
        stream: BinaryIO = partial.open("xb")
    except OSError:
        yield BytesIO()
        return
    with suppress(OSError):
        try:
            with stream:
                yield stream
            os.replace(partial, path)
        finally:
            partial.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 text file whole or not at all; raises as `replacing` does."""
    with replacing(path) as stream:
        stream.write(text.encode("utf-8"))


def append_line(path: Path, text: str) -> None:
    """Add a line to a UTF-8 text file; the disk has it when this returns.

    The file is made if it is not there. What a cut has left of a last line is taken away first,
    and a line that finds no room leaves the file as it was.

    Raises
    ------
    InputError
        If no file can be made at `path`, or something else is there.
    LashbenchError
        If the disk refuses the data.
    """
    target, line = checked_target(path), f"{text}\n".encode()
    try:
        flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_NOFOLLOW", 0)
        handle = os.open(target, flags, 0o644)
    except OSError as error:
        raise InputError(f"{path}: may not be written ({error.strerror})") from error
    try:
        _lock(handle)
        end = _end_of_lines(handle)
        os.ftruncate(handle, end)
        try:
            if os.write(handle, line) != len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            os.fsync(handle)
        except OSError:
            os.ftruncate(handle, end)
            raise
        if end == 0:
            _flush(target.parent)
    except OSError as error:
        raise LashbenchError(f"{path}: could not be written ({error.strerror or error})") from error
    finally:
        os.close(handle)


def _lock(handle: int) -> None:
    """Wait until nobody else adds a line; the system lets go when the file is closed."""
    with suppress(ImportError):
        import fcntl

        fcntl.flock(handle, fcntl.LOCK_EX)


def _end_of_lines(handle: int) -> int:
    """Bytes up to the end of the last whole line."""
    end = os.lseek(handle, 0, os.SEEK_END)
    while end > 0:
        start = max(0, end - _PIECE)
        piece = os.pread(handle, end - start, start)
        if (found := piece.rfind(b"\n")) >= 0:
            return start + found + 1
        end = start
    return 0


def file_stem(name: str) -> str:
    """A name that others chose, as a part of a file's name: it leads into no other folder."""
    kept = "".join(letter if letter.isalnum() or letter in "-_" else "-" for letter in name)
    return kept.strip("-").lower() or "unnamed"


def checked_target(path: Path, *reads: str | Path) -> Path:
    """The file that `path` stands for, links followed, once a file can be made there.

    Parameters
    ----------
    reads
        What the same work reads or writes otherwise, as files or as names of something else: none
        of these files is written over. A `Path` is meant also where its file is not there yet.

    Raises
    ------
    InputError
        If its directory does not exist, something that is not a file is there, a link
        that another user made, who would choose what is overwritten, or one of `reads`.
    """
    try:
        if path.is_symlink() and hasattr(os, "getuid") and not _is_own(path):
            raise InputError(f"{path}: is a link that another user made; give the file itself")
        target = path.resolve()
        if target.exists() and not target.is_file():
            what = "a directory" if target.is_dir() else "not a regular file"
            raise InputError(f"{path}: is {what}; give the name of a file")
        if not target.parent.is_dir():
            raise InputError(f"{path}: there is no directory {target.parent}; make it first")
        for one in reads:
            if _is_same(target, one):
                raise InputError(f"{path}: is the file that is read; give another name")
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"{path}: is not a usable file name ({error})") from error
    if not os.access(target.parent, os.W_OK):
        raise InputError(f"{path}: the directory {target.parent} may not be written")
    return target


def new_target(path: Path) -> Path:
    """As `checked_target`, of a file that is not there yet.

    Raises
    ------
    InputError
        If it is there, or as `checked_target`.
    """
    target = checked_target(path)
    if target.exists():
        raise InputError(f"{path}: is there already and is left as it is; give another name")
    return target


def _is_same(target: Path, one: str | Path) -> bool:
    if target.exists() and os.path.exists(one):
        return os.path.samefile(one, target)
    return isinstance(one, Path) and one.resolve() == target


def _is_own(link: Path) -> bool:
    return link.lstat().st_uid in (0, os.getuid())


def _partial(target: Path) -> Path:
    """A name beside a file that is short, whatever the file's own is."""
    return target.with_name(f".lashbench-{secrets.token_hex(8)}.partial")


def _flush(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
