"""Whether a file or folder can be changed by this user and root alone, as OpenSSH asks of keys.

Owns that rule, and the private folders that stand in where it does not hold. What is executed or
believed unseen (compiled code, kept runs, locks) comes from such places alone. It prints nothing:
what is passed over goes to the log `lashbench.trust`.
"""

from __future__ import annotations

import atexit
import logging
import os
import shutil
import stat
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path

__all__ = ["distrust", "fresh_folder", "open_own", "own_folder", "pass_over", "read_own"]

_LOG = logging.getLogger("lashbench.trust")
_TOLD: set[str] = set()


def distrust(path: Path) -> str | None:
    """Why others could have changed what lies at a path; None where only this user and root can.

    Each folder above counts as well. A folder like /tmp, where only the owner of a name may
    rename it, is enough above, but not as the place itself. A group of the user's own name,
    which many systems give to each user, is the user. A system without owners gives None.
    """
    if not hasattr(os, "getuid"):
        return None
    place = Path(os.path.realpath(path))
    for one in (place, *place.parents):
        try:
            found = one.lstat()
        except OSError as error:
            return f"{one} cannot be examined ({error.strerror})"
        if found.st_uid not in (0, os.getuid()):
            return f"{one} belongs to another user"
        guarded = one != place and found.st_mode & stat.S_ISVTX
        if _others_may_write(found) and not guarded:
            return f"{one} can be written by others"
    return None


def read_own(file: Path) -> bytes | None:
    """What a file holds that this user or root made and nobody else can change; else None."""
    with suppress(OSError):
        handle = open_own(file, os.O_RDONLY)
        if handle is not None:
            with os.fdopen(handle, "rb") as stream:
                return stream.read() if distrust(file.parent) is None else None
    return None


def open_own(file: Path, flags: int, mode: int = 0o600) -> int | None:
    """Descriptor of a regular file that is this user's or root's alone; None for any other.

    Links are not followed, also not hard ones, and nothing is waited for.

    Raises
    ------
    OSError
        If it cannot be opened at all.
    """
    flags |= os.O_CLOEXEC | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    handle = os.open(file, flags, mode)
    found = os.fstat(handle)
    plain = stat.S_ISREG(found.st_mode) and found.st_nlink == 1
    owned = not hasattr(os, "getuid") or found.st_uid in (0, os.getuid())
    if plain and owned and not _others_may_write(found):
        return handle
    os.close(handle)
    return None


def own_folder(folder: Path) -> Path:
    """The folder, made if it is not there; a fresh one if others may write there."""
    with suppress(OSError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not os.path.exists(folder):
        return folder
    fault = distrust(folder)
    if fault is None:
        return folder
    pass_over(fault)
    return fresh_folder() / folder.name


def pass_over(fault: str) -> None:
    """Log, once, that what is kept at a place is not used, and why."""
    if fault not in _TOLD:
        _TOLD.add(fault)
        _LOG.warning(
            "%s; what is kept there is not used but made anew in this run; to use it, let only "
            "yourself write there (chmod go-w)",
            fault,
        )


@cache
def fresh_folder() -> Path:
    """A new folder of this process, which nobody else may enter; removed at its end."""
    folder = Path(tempfile.mkdtemp(prefix="lashbench-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _others_may_write(found: os.stat_result) -> bool:
    if stat.S_ISLNK(found.st_mode) or not hasattr(os, "getuid"):
        return False
    if found.st_mode & stat.S_IWOTH:
        return True
    return bool(found.st_mode & stat.S_IWGRP) and not _is_own_group(found.st_gid)


@cache
def _is_own_group(number: int) -> bool:
    """Whether a group is that of this user alone, by its name and members."""
    import grp
    import pwd

    try:
        group, user = grp.getgrgid(number), pwd.getpwuid(os.getuid())
    except KeyError:
        return False
    return group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name}
