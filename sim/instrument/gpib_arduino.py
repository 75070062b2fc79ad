"""Commands that only an AR488 has: polling all, finding listeners, its identity, its flags.

Owns their replies, taken from the firmware's source (0.53.04). It keeps no state: that is the
adapter's.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from sim.instrument.bus import Instrument

__all__ = ["ARDUINO_COMMANDS", "READ_FLAG", "SEND_FLAG"]

READ_FLAG, SEND_FLAG = 2, 4
"""Bits of ``++flags``: say ``Read^OK`` after a read, ``Send^OK`` after a line for the bus."""
_REQUESTS = 0x40
_ADDRESSES = range(31)


class Adapter(Protocol):
    """What these commands ask of an adapter, and change in it."""

    instrument: Instrument
    own_address: int
    identity: dict[str, str]
    verbose: bool

    def say(self, text: str) -> None:
        """Answer one line."""


def _poll_all(adapter: Adapter, values: list[str]) -> None:
    """``++allspoll``: the first that requests service, then an empty line."""
    byte = adapter.instrument.serial_poll() if adapter.own_address < 30 else None
    if byte is not None and byte & _REQUESTS:
        adapter.say(f"SRQ:{adapter.own_address},{byte}")
    adapter.say("")


def _find_listeners(adapter: Adapter, values: list[str]) -> None:
    """``++fndl all``, ``++fndl 3-12`` or ``++fndl 5 11``: those that answer, with commas."""
    if not values:
        adapter.say("Missing parameter")
        return
    wanted = _addresses(values)
    if wanted is None:
        adapter.say("Invalid parameter")
        return
    listens = adapter.own_address in wanted and not adapter.instrument.damage.dead
    adapter.say(str(adapter.own_address) if listens else "")


def _addresses(values: list[str]) -> set[int] | None:
    if values[0].lower() == "all":
        return set(_ADDRESSES)
    first, dash, last = values[0].partition("-")
    if dash and first.isdigit() and last.isdigit():
        low, high = int(first), int(last)
        return set(range(low, high + 1)) if low < high <= _ADDRESSES[-1] else None
    if all(value.isdigit() and int(value) in _ADDRESSES for value in values):
        return {int(value) for value in values}
    return None


def _identity(adapter: Adapter, values: list[str]) -> None:
    """``++id name|serial|verstr [VALUE]`` and ``++id fwver``."""
    name, text = (values[0].lower(), " ".join(values[1:])) if values else ("", "")
    longest = {"name": 15, "serial": 9, "verstr": 47}
    if not text:
        shown = adapter.identity.get(name)
        adapter.say("Unrecognized command" if shown is None else shown)
    elif name not in longest:
        adapter.say("Unrecognized command")
    elif len(text) > longest[name]:
        adapter.say("Invalid parameter")
    else:
        # The firmware reads a serial number as far as it is one.
        digits = text if text.isdigit() else "0"
        adapter.identity[name] = f"{int(digits):09d}" if name == "serial" else text


def _verbose(adapter: Adapter, values: list[str]) -> None:
    """``++verbose``: a toggle."""
    adapter.verbose = not adapter.verbose
    adapter.say(f"Verbose: {'ON' if adapter.verbose else 'OFF'}")


ARDUINO_COMMANDS: dict[str, Callable[[Adapter, list[str]], None]] = {
    "allspoll": _poll_all,
    "fndl": _find_listeners,
    "id": _identity,
    "verbose": _verbose,
}
"""By name, without the ``++``."""
