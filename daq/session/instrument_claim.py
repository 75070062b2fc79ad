"""One session at a time on one instrument, whatever history it writes.

Owns a small file per instrument in a private folder: the path of the bench's lock whose holder
uses the instrument. The instrument is in use for as long as that lock is held, by the session or by
its watchdog. It opens no instrument.
"""

from __future__ import annotations

import hashlib
import os
import re
import time
from pathlib import Path

from daq.drivers import parse_instrument
from daq.errors import InputError, MeasurementError
from daq.transports.address import (
    HostedAddress,
    PrologixSerial,
    PrologixTcp,
    SerialPort,
    VisaAddress,
)
from daq.untrusted.trust import distrust, open_own

__all__ = ["claim", "own_lock", "wire_name"]

_LOOK_S = 0.1
_NOTING_S = 5.0
_MOST_BYTES = 1 << 14


def wire_name(url: str) -> str | None:
    """One name for all ways to write the address of an instrument; None where none is driven.

    Of an adapter it is the adapter: two sessions cannot share one, whatever GPIB address they
    talk to. A host is known by its name as it is written; only `localhost` is 127.0.0.1.

    Raises
    ------
    ConfigurationError
        If it is no address.
    """
    match parse_instrument(url):
        case PrologixSerial(device=device) | SerialPort(device=device):
            return f"serial {os.path.realpath(device) if os.path.exists(device) else device}"
        case PrologixTcp(host=host, port=port):
            return f"tcp {_host(host)} {port}"
        case VisaAddress(resource=resource):
            return _visa_name(resource)
        case HostedAddress(scheme=scheme, rest=rest) if scheme != "sim":
            return f"{scheme} {rest.partition('?')[0]}"
    return None


def claim(url: str, lock: Path, patience_s: float) -> None:
    """Note that whoever holds a bench's lock uses the instrument; the caller holds that lock.

    Parameters
    ----------
    url
        Address of the instrument; nothing happens where it is simulated or replayed.
    lock
        File of the lock.
    patience_s
        How long to wait where the session that used it is gone and its watchdog is at work, s.

    Raises
    ------
    MeasurementError
        If a session with another history uses the instrument.
    InputError
        If the note cannot be made.
    ConfigurationError
        If `url` is no address.
    """
    name = wire_name(url)
    if name is None or not hasattr(os, "getuid"):
        return
    file = _folder() / f"{hashlib.sha256(name.encode()).hexdigest()[:24]}.instrument"
    deadline_s = time.monotonic() + patience_s
    while True:
        other = _noted(file, lock)
        if other is None:
            return
        owner = _owner(other)
        history = str(other).removesuffix("-lock")
        if owner is not None and is_alive(owner):
            raise MeasurementError(
                f"{url}: another session (process {owner}, history {history}) is measuring on this "
                "instrument; wait for it to end, or stop it"
            )
        if time.monotonic() > deadline_s:
            raise MeasurementError(
                f"{url}: the watchdog of a session that was killed (history {history}) is still at "
                f"work after {patience_s:g} s; look at the instrument"
            )
        time.sleep(_LOOK_S)


def is_alive(process: int) -> bool:
    """Whether there is a process of that number."""
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except OSError:
        return True
    return True


def is_held(lock: Path) -> bool:
    """Whether anybody holds a lock's file."""
    import fcntl

    try:
        handle = os.open(lock, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    finally:
        os.close(handle)
    return False


def _noted(file: Path, lock: Path) -> Path | None:
    """Note our lock; the lock of whoever uses the instrument, if that one is held."""
    fault = f"{file}: the instrument's lock cannot be made"
    try:
        handle = open_own(file, os.O_RDWR | os.O_CREAT)
    except OSError as error:
        raise InputError(f"{fault} ({error.strerror}); make room, or remove it") from error
    if handle is None:
        raise InputError(f"{fault} (it is not a file of lashbench); remove it")
    try:
        _hold(handle)
        other = Path(os.fsdecode(os.read(handle, _MOST_BYTES)))
        if str(other) != "." and other != lock and is_held(other):
            return other
        os.ftruncate(handle, 0)
        os.pwrite(handle, os.fsencode(lock), 0)
    except OSError as error:
        raise InputError(f"{fault} ({error.strerror}); make room") from error
    finally:
        os.close(handle)
    return None


def _hold(handle: int) -> None:
    """Lock the note, which others do for a moment only, while they read and write it."""
    import fcntl

    until_s = time.monotonic() + _NOTING_S
    while True:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            if time.monotonic() > until_s:
                raise
            time.sleep(_LOOK_S / 10)


def own_lock(name: str) -> Path:
    """Where the lock lies of a history that is no file here."""
    digest = hashlib.sha256(name.encode("utf-8")).hexdigest()[:16]
    return _folder() / f"server-{digest}-lock"


def _folder() -> Path:
    # The same for every session of this user, from a desktop, over ssh or from a timer.
    folder = Path("/tmp") / f"lashbench-{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made ({error.strerror}); make room") from error
    fault = distrust(folder)
    if fault is not None or folder.is_symlink():
        raise InputError(f"{folder}: {fault or 'is a link'}; it holds locks, have it removed")
    return folder


def _owner(lock: Path) -> int | None:
    try:
        return int(lock.read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None


def _host(name: str) -> str:
    lower = name.lower()
    return "127.0.0.1" if lower == "localhost" else lower


def _visa_name(resource: str) -> str:
    kind, *parts = resource.split("::")
    if resource.upper().endswith("::SOCKET"):
        return f"tcp {_host(parts[0])} {int(parts[1])}"
    if parts[-1].upper() == "INSTR":
        parts.pop()
    board = re.sub(r"\D", "", kind) or "0"
    if kind.upper().startswith("GPIB"):
        return " ".join(["gpib", str(int(board)), *(str(int(part)) for part in parts)])
    if kind.upper().startswith("USB"):
        vendor, product = (int(part, 16 if "x" in part.lower() else 10) for part in parts[:2])
        return f"usb {vendor:04x} {product:04x} {parts[2]}"
    device = parts[1].lower() if len(parts) > 1 else "inst0"
    return f"vxi11 {_host(parts[0])} {device}"
