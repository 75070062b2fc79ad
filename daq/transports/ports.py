"""Where a serial adapter is now: the same port, or the name under which it came back.

Owns what tells one USB adapter from another (its lasting link, its USB serial number) and the
memory of what was seen under a name in this process. It opens nothing.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

__all__ = ["BY_ID", "PortBook", "ports"]

BY_ID = Path("/dev/serial/by-id")
"""Where udev keeps links to serial ports that follow the device and not its number."""


@dataclass(frozen=True, slots=True)
class _Seen:
    """What is known of the adapter at a port."""

    links: tuple[str, ...]
    """Names in the folder of lasting links."""
    usb: tuple[int, int, str] | None
    """Vendor, product and serial number, which may be empty."""


def _listed() -> Iterable[Any]:
    from serial.tools.list_ports import comports

    return comports()


class PortBook:
    """Remembers which adapter was at a device, and finds it again.

    A USB adapter that starts anew may come back under another number, and another one may have
    its old one.

    Parameters
    ----------
    by_id
        Folder of lasting links.
    listed
        Gives the serial ports there are, as pyserial's ``comports``.
    """

    def __init__(self, by_id: Path = BY_ID, listed: Callable[[], Iterable[Any]] = _listed) -> None:
        self._by_id, self._listed = by_id, listed
        self._seen: dict[str, _Seen] = {}

    def note(self, device: str) -> None:
        """Remember who is at that device, if anybody."""
        seen = self._look(device)
        if seen is not None:
            self._seen.setdefault(device, seen)

    def now(self, device: str) -> str:
        """Where the adapter is that was at that device; the device itself where nobody knows."""
        seen = self._seen.get(device)
        if seen is None or self._look(device) == seen:
            return device
        for link in seen.links:
            if (self._by_id / link).exists():
                return str(self._by_id / link)
        alike = [
            str(port.device)
            for port in self._listed()
            if _usb(port) == seen.usb and str(port.device) != device
        ]
        return alike[0] if seen.usb is not None and len(alike) == 1 else device

    def lasting(self, device: str) -> str | None:
        """A name of the port that follows the adapter; None if there is none, or this is one."""
        seen = self._look(device)
        if seen is None or not seen.links or Path(device).parent == self._by_id:
            return None
        return str(self._by_id / seen.links[0])

    def _look(self, device: str) -> _Seen | None:
        if "://" in device or not os.path.exists(device):
            return None
        place = os.path.realpath(device)
        links: tuple[str, ...] = ()
        if self._by_id.is_dir():
            found = sorted(self._by_id.iterdir())
            links = tuple(link.name for link in found if os.path.realpath(link) == place)
        usb = next(
            (_usb(port) for port in self._listed() if os.path.realpath(port.device) == place), None
        )
        return _Seen(links, usb)


def _usb(port: Any) -> tuple[int, int, str] | None:
    if port.vid is None or port.pid is None:
        return None
    return int(port.vid), int(port.pid), str(port.serial_number or "")


ports = PortBook()
"""Of this process."""
