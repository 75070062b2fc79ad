"""The unit with which a stored measurement was made.

Owns where its values come from. It changes no history and prints nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from daq.errors import ConfigurationError

if TYPE_CHECKING:
    from daq.store_records import Measurement
    from sim.unit import Unit

__all__ = ["unit_as_measured"]


def unit_as_measured(measurement: Measurement) -> Unit:
    """The unit of a stored measurement as its file was then, whatever bears its name now.

    Where the history holds no file, it is the one of that name that comes with lashbench.

    Raises
    ------
    ConfigurationError
        If the history holds no unit file, or a damaged one.
    """
    from daq.configs import config_names
    from daq.untrusted.bounded_text import parse_toml
    from sim.unit import load_unit, unit_from_mapping

    header, source = measurement.header, f"unit of measurement {measurement.id}"
    text = header.configurations.get("unit")
    if text is not None:
        try:
            return unit_from_mapping(parse_toml(text), source)
        except ValueError as error:
            raise ConfigurationError(f"{source}: is not valid TOML ({error})") from error
    if header.unit.lower() in config_names("units"):
        return load_unit(header.unit)
    raise ConfigurationError(f"{source}: {header.unit!r} has no file in the history")
