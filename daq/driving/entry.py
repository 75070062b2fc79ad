"""The record by which a driver is known to `daq.drivers`.

Owns nothing but its fields. It imports no driver.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from daq.analyser import Analyser
    from daq.driving.first_day import Check
    from daq.transports.base import Transport

__all__ = ["Driver", "Wire"]


@dataclass(frozen=True, slots=True)
class Wire:
    """A way to an instrument that only its own driver knows, under a scheme of its own."""

    open: Callable[[str], Transport]
    """Opens what follows the scheme's colon."""
    load: Callable[[], None]
    """Imports whatever opening needs."""


@dataclass(frozen=True, slots=True)
class Driver:
    """An instrument that can be driven."""

    name: str
    """For people."""
    scheme: str
    """Word and colon before the address, as ``x:GPIB0::11::INSTR``; empty for the preset."""
    drive: Callable[[Transport], Analyser]
    """The analyser over an open wire, which is closed with it; imports what it needs."""
    check_sweep: Callable[..., None]
    """Refuses a sweep that the instrument cannot be set to; see `daq.drivers.check_sweep`."""
    models: tuple[str, ...]
    """What the second field of ``*IDN?`` ends with, in capitals."""
    gpib_address: int
    """The address that the instrument comes with."""
    first_day: Callable[[], tuple[Check, ...]] | None = None
    """Checks of what the driver assumes, for whoever has a real instrument; imports them."""
    wires: Mapping[str, Wire] = field(default_factory=dict)
    """Ways that no other driver has, by scheme."""

    def answers(self, identity: str) -> bool:
        """Whether an answer to ``*IDN?`` is that of an instrument of this driver."""
        fields = [field.strip().upper() for field in identity.split(",")]
        return len(fields) > 1 and fields[1].endswith(self.models)
