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
from pathlib import Path

from daq.errors import InputError, LashbenchError

__all__ = ["checked_target", "file_stem", "keeping", "replacing", "write_text"]


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a name to write to; it becomes `path` when the block ends well.

    The temporary name lies in the same directory and has the same suffix. On
    any failure it is removed and `path` is as it was.

    Raises
    ------
    InputError
        If no file can be made at `path`.
    LashbenchError
        If the disk refuses the data.
    """
    target = checked_target(path)
    token = secrets.token_hex(4)
    partial = target.with_name(f".{target.stem[:64]}.{token}.partial{target.suffix}")
    try:
        yield partial
        _flush(partial)
        os.replace(partial, target)
        _flush(target.parent)
    except PermissionError as error:
        raise InputError(f"{path}: may not be written ({error.strerror})") from error
    except OSError as error:
        raise LashbenchError(f"{path}: could not be written ({error.strerror or error})") from error
    finally:
        with suppress(FileNotFoundError):
            partial.unlink()


@contextmanager
def keeping(path: Path) -> Iterator[Path]:
    """Give a name to write to what can be made again; it becomes `path` when the block ends well.

    Where that fails nothing is left, and nothing is said: it costs time later.
    """
    partial = path.with_suffix(f".{os.getpid()}.part")
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
    with suppress(OSError):
        try:
            yield partial
            os.replace(partial, path)
        finally:
            partial.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a UTF-8 text file whole or not at all; raises as `replacing` does."""
    with replacing(path) as partial:
        partial.write_text(text, encoding="utf-8", newline="")


def file_stem(name: str) -> str:
    """A name that others chose, as a part of a file's name: it leads into no other folder."""
    kept = "".join(letter if letter.isalnum() or letter in "-_" else "-" for letter in name)
    return kept.strip("-").lower() or "unnamed"


def checked_target(path: Path) -> Path:
    """The file that `path` stands for, links followed, once a file can be made there.

    Raises
    ------
    InputError
        If its directory does not exist, or something that is not a file is there.
    """
    try:
        target = path.resolve()
        if target.exists() and not target.is_file():
            what = "a directory" if target.is_dir() else "not a regular file"
            raise InputError(f"{path}: is {what}; give the name of a file")
        if not target.parent.is_dir():
            raise InputError(f"{path}: there is no directory {target.parent}; make it first")
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"{path}: is not a usable file name ({error})") from error
    if not os.access(target.parent, os.W_OK):
        raise InputError(f"{path}: the directory {target.parent} may not be written")
    return target


def _flush(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
