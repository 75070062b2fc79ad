"""The makes of adapter that the fake one can pretend to be.

Owns their texts, limits and presets, taken from manuals and firmware sources.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

__all__ = ["AR488", "AR488_LATE_EOI", "PROLOGIX_ETHERNET", "PROLOGIX_USB", "Dialect"]


@dataclass(frozen=True, slots=True)
class Dialect:
    """What tells one make of adapter from another.

    Parameters
    ----------
    version
        Text of ``++ver``.
    longest_read_ms, read_ms
        Upper limit of ``++read_tmo_ms``, and what it is after a start.
    piece_bytes
        Size at which a long line is sent on in pieces; 0 if never.
    saves_on_change
        Whether each changed setting is written to the EEPROM.
    restart_s
        Seconds of deafness after a start.
    bytes_per_s
        Speed of a real serial line, 0 for a USB chip or a network.
    late_eoi
        EOI is asserted after the last byte instead of with it, so that no instrument sees it.
    """

    name: Literal["prologix", "ar488"]
    version: str
    longest_read_ms: int
    read_ms: int
    address: int
    auto: int
    eoi: int
    eos: int
    piece_bytes: int
    saves_on_change: bool
    restart_s: float
    bytes_per_s: float
    greeting: bytes = b""
    late_eoi: bool = False


PROLOGIX_USB = Dialect(
    "prologix", "Prologix GPIB-USB Controller version 6.107", 3000, 500, 5, 1, 1, 0, 0, True, 5.0, 0
)
PROLOGIX_ETHERNET = Dialect(
    "prologix",
    "Prologix GPIB-ETHERNET Controller version 01.06.06.00",
    3000, 500, 5, 1, 1, 0, 0, True, 5.0, 0,
)  # fmt: skip
AR488 = Dialect(
    "ar488",
    "AR488 GPIB controller, ver. 0.53.04, 13/04/2025",
    32000, 1200, 1, 0, 0, 0, 128, False, 2.0, 11520.0, b"AR488 starting\r\n",
)  # fmt: skip
AR488_LATE_EOI = replace(AR488, late_eoi=True)
