"""Checks of the ways to an instrument: serial ports and their permission, VISA and its back ends.

Owns what each missing way would be needed for. It opens no port and sends
nothing.
"""

from __future__ import annotations

import getpass
import importlib.util
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from tui.checkup.finding import Finding, failed, noted, passed
from tui.text.shell_quote import pip_install

__all__ = ["check_serial_ports", "check_visa"]

_USUAL_GROUP = "dialout"


def check_serial_ports() -> Iterator[Finding]:
    """Which serial ports there are, and which of them this user may open."""
    from serial.tools import list_ports

    ports = sorted(port.device for port in list_ports.comports())
    if not ports:
        yield noted(
            "serial ports",
            "none",
            "plug the GPIB adapter in where you have one; LAN and sim: need none",
        )
    for port in ports:
        name = f"serial port {port}"
        if sys.platform == "win32" or os.access(port, os.R_OK | os.W_OK):
            yield passed(name, f"can be opened: --instrument 'prologix:{port}?addr=11'")
        else:
            yield _forbidden(name, Path(port))


def _forbidden(name: str, port: Path) -> Finding:
    """A port that may not be opened, and the group that would help."""
    import grp
    import pwd

    user, group = _user(), _group(port)
    try:
        entry = grp.getgrnam(group)
        home = pwd.getpwnam(user).pw_gid
    except KeyError:
        listed = False
    else:
        listed = user in entry.gr_mem or home == entry.gr_gid
    found = f"{user} may not open it"
    if listed and entry.gr_gid not in os.getgroups():
        remedy = f"log out and in again: you joined group {group} after this log-in"
    elif listed:
        remedy = f"sudo chmod g+rw {port}; its group {group}, which you are in, is shut out"
    else:
        remedy = f"sudo usermod -aG {group} {user}, then log out and in again"
    return noted(name, found, remedy)


def _group(port: Path) -> str:
    """The group of a port; never root's own, which nobody should join for a cable."""
    try:
        group = port.group()
    except (KeyError, OSError):
        return _USUAL_GROUP
    return _USUAL_GROUP if group in ("root", "wheel") else group


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return str(os.getuid())


def check_visa() -> Iterator[Finding]:
    """Whether VISA serves a LAN, and whether anything serves a GPIB card."""
    import pyvisa
    from pyvisa.ctwrapper.highlevel import IVIVisaLibrary

    try:
        pyvisa.ResourceManager("@py").close()
    # PyVISA raises ValueError, OSError or what a broken library raises.
    except Exception as error:
        remedy = pip_install("--force-reinstall", "pyvisa-py")
        yield failed("VISA on a LAN", f"no back end: {' '.join(str(error).split())}", remedy)
    else:
        yield passed("VISA on a LAN", f"PyVISA {pyvisa.__version__} with pyvisa-py")
    makers = [str(path) for path in IVIVisaLibrary.get_library_paths()]
    if makers:
        yield passed("VISA for GPIB cards", f"a maker's library at {makers[0]}")
    elif importlib.util.find_spec("gpib_ctypes") or importlib.util.find_spec("gpib"):
        yield passed("VISA for GPIB cards", "pyvisa-py with linux-gpib")
    else:
        yield noted(
            "VISA for GPIB cards",
            "none",
            "only for a GPIB card in this computer: install its maker's VISA, or linux-gpib "
            "with gpib-ctypes",
        )
