"""Which driver an address is for: the one table of drivers.

Owns the way from an instrument's URL to its driver, for sessions, watchdog and screens alike. A
new driver is a folder of this floor with a module `driver` in it, whose `DRIVER` is found here.
It talks to no instrument itself.
"""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from daq.driving.entry import Driver
from daq.errors import ConfigurationError
from daq.transports.address import Address, parse_address

if TYPE_CHECKING:
    from daq.analyser import Analyser
    from daq.plan import SweepPlan
    from daq.transports.base import Transport
    from daq.transports.open import TransportFactory

__all__ = [
    "DRIVERS",
    "Driver",
    "check_sweep",
    "driver_at",
    "driver_for",
    "is_simulated",
    "load_all_of",
    "open_analyser",
    "parse_instrument",
    "stranger",
]


def _found() -> tuple[Driver, ...]:
    import daq

    rooms = sorted(found.name for found in pkgutil.iter_modules(daq.__path__) if found.ispkg)
    names = [f"daq.{room}.driver" for room in rooms]
    modules = [importlib.import_module(name) for name in names if importlib.util.find_spec(name)]
    return tuple(sorted((module.DRIVER for module in modules), key=lambda driver: driver.scheme))


DRIVERS = _found()
"""Every driver there is; the one without a scheme is the preset."""


def driver_for(identity: str) -> Driver | None:
    """The driver of an instrument by its answer to ``*IDN?``; None if there is none."""
    return next((driver for driver in DRIVERS if driver.answers(identity)), None)


def stranger(identity: str, asked: str) -> str:
    """What to do about an instrument that is not the one its driver drives; a clause.

    Parameters
    ----------
    identity
        What it answers to ``*IDN?``.
    asked
        Scheme of the driver that was to drive it.
    """
    driver = driver_for(identity)
    if driver is None or driver.scheme == asked:
        return "check the address"
    if driver.scheme:
        return f"check the address: one of {driver.name} begins with '{driver.scheme}:'"
    return f"check the address: one of {driver.name} has no '{asked}:' before it"


def parse_instrument(url: str, hosted: tuple[str, ...] = ("sim",)) -> Address:
    """Where the instrument at a URL is, its driver's GPIB address being the preset.

    Raises
    ------
    ConfigurationError
        If it is no address.
    """
    driver, address = driver_at(url)
    try:
        return parse_address(address, (*hosted, *driver.wires), driver.gpib_address)
    except ConfigurationError as error:
        told = str(error).replace(f"instrument {address!r}", f"instrument {url!r}", 1)
        others = ", ".join(f"'{one.scheme}:' for {one.name}" for one in DRIVERS if one.scheme)
        raise ConfigurationError(f"{told}; before any of them may stand {others}") from error


def driver_at(url: str) -> tuple[Driver, str]:
    """The driver that a URL asks for, and the address that is left for the transport."""
    text = url.strip()
    for driver in DRIVERS:
        if driver.scheme and text.startswith(f"{driver.scheme}:"):
            return driver, text.removeprefix(f"{driver.scheme}:")
    return next(driver for driver in DRIVERS if not driver.scheme), text


def is_simulated(url: str) -> bool:
    """Whether a URL is of an instrument that lives in this program."""
    return driver_at(url)[1].startswith("sim:")


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
    parse_instrument(url, tuple(factories or {}))
    ways = {scheme: wire.open for scheme, wire in driver.wires.items()}
    transport = open_transport(
        address,
        ways | dict(factories or {}),
        record=record,
        fault=fault,
        gpib_address=driver.gpib_address,
    )
    return driver.drive(transport)


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
    own = driver.wires.get(address.partition(":")[0])
    if own is not None:
        own.load()
    else:
        load_transport(address)

    class Nobody:
        """A wire that is never used: a driver imports its own modules when it is made."""

        def __init__(self, address: str) -> None:
            self.address = address

    nobody: Transport = Nobody(address)  # type: ignore[assignment]
    driver.drive(nobody)
