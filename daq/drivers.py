"""Which driver an address is for: the one table of drivers.

Owns the way from an instrument's URL to its driver, for sessions, watchdog and screens alike. A
new driver is one entry of `DRIVERS`. It talks to no instrument itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from daq.analyser import Analyser
    from daq.plan import SweepPlan
    from daq.transports.base import Transport
    from daq.transports.open import TransportFactory

__all__ = ["DRIVERS", "Driver", "check_sweep", "driver_at", "load_all_of", "open_analyser"]


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
    """Refuses a sweep that the instrument cannot be set to; see `check_sweep`."""


def _drive_35670a(transport: Transport) -> Analyser:
    from daq.hp35670a import HP35670A

    return HP35670A(transport)


def _check_35670a(
    plan: SweepPlan,
    slew_vpk_per_s: float,
    input_range_vpk: tuple[float | None, float | None],
    *,
    may_repeat: bool,
) -> None:
    from daq.hp35670a_setup import check_sweep as check

    check(plan, slew_vpk_per_s, input_range_vpk, may_repeat=may_repeat)


DRIVERS = (Driver("HP/Agilent 35670A", "", _drive_35670a, _check_35670a),)
"""Every driver there is; the first without a scheme is the preset."""


def driver_at(url: str) -> tuple[Driver, str]:
    """The driver that a URL asks for, and the address that is left for the transport."""
    text = url.strip()
    for driver in DRIVERS:
        if driver.scheme and text.startswith(f"{driver.scheme}:"):
            return driver, text.removeprefix(f"{driver.scheme}:")
    return next(driver for driver in DRIVERS if not driver.scheme), text


def open_analyser(
    url: str,
    factories: Mapping[str, TransportFactory] | None = None,
    *,
    record: Path | None = None,
    fault: Callable[[str], None] | None = None,
) -> Analyser:
    """Connect to the instrument at a URL with its driver.

    Parameters and errors are those of `daq.transports.open.open_transport`.
    """
    from daq.transports.open import open_transport

    driver, address = driver_at(url)
    return driver.drive(open_transport(address, factories, record=record, fault=fault))


def check_sweep(
    url: str,
    plan: SweepPlan,
    slew_vpk_per_s: float,
    input_range_vpk: tuple[float | None, float | None],
    *,
    may_repeat: bool = False,
) -> None:
    """Refuse a sweep that the instrument at a URL cannot be set to; nothing is sent.

    Parameters
    ----------
    may_repeat
        Let frequencies be that fall on one step, as in a measurement that was begun so.

    Raises
    ------
    LimitError
        If any value is out of range.
    InputError
        If two frequencies fall on one of the steps in which they are set.
    """
    driver, _ = driver_at(url)
    driver.check_sweep(plan, slew_vpk_per_s, input_range_vpk, may_repeat=may_repeat)


def load_all_of(url: str) -> None:
    """Import whatever `open_analyser` and the driver will need, so that nothing is loaded later."""
    from daq.transports.open import load_transport

    driver, address = driver_at(url)
    load_transport(address)

    class Nobody:
        """A wire that is never used: a driver imports its own modules when it is made."""

    nobody: Transport = Nobody()  # type: ignore[assignment]
    driver.drive(nobody)
