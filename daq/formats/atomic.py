"""Files that appear whole or not at all.

Owns the way a result reaches its name: written beside it, flushed to the
disk, then renamed. It knows nothing of what is inside and never touches the
old file before the new one is complete.
"""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from daq.errors import InputError, LashbenchError

__all__ = ["checked_target", "file_stem", "keeping", "replacing", "write_text"]


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


def file_stem(name: str) -> str:
    """A name that others chose, as a part of a file's name: it leads into no other folder."""
    kept = "".join(letter if letter.isalnum() or letter in "-_" else "-" for letter in name)
    return kept.strip("-").lower() or "unnamed"


def checked_target(path: Path, *reads: str | Path) -> Path:
    """The file that `path` stands for, links followed, once a file can be made there.

    Parameters
    ----------
    reads
        What the same work reads, as files or as names of something else: none of these files is
        written over.

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
            if target.exists() and os.path.exists(one) and os.path.samefile(one, target):
                raise InputError(f"{path}: is the file that is read; give another name")
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"{path}: is not a usable file name ({error})") from error
    if not os.access(target.parent, os.W_OK):
        raise InputError(f"{path}: the directory {target.parent} may not be written")
    return target


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
