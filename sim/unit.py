"""The unit under test: its physical parameters, read from a TOML file and checked whole.

Owns the way from a name or a file to a unit whose values are plausible, and gives the names of
`sim.drive.unit`, which has the record. It builds no equations.
"""

from __future__ import annotations

from daq.configs import config_path
from daq.errors import ConfigurationError
from daq.untrusted.toml_files import read_toml
from sim.datasheet.plausibility import find_impossible
from sim.drive.unit import StageBacklash, Unit, stage_backlash, unit_from_mapping
from sim.own_effects.sources import read_sources

__all__ = ["StageBacklash", "Unit", "load_unit", "stage_backlash", "unit_from_mapping"]


def load_unit(name_or_path: str) -> Unit:
    """Read a unit by the name of one that comes with lashbench, or by path.

    Raises
    ------
    ConfigurationError
        If the file is not there, is not TOML, or any value in it is wrong or cannot be; or if it
        names files of its own effects and nobody allowed these (`sim.own_effects`).
    """
    path = config_path("units", name_or_path)
    unit = unit_from_mapping(read_toml(path), source=str(path))
    impossible = find_impossible(unit)
    if impossible:
        raise ConfigurationError(f"{path}: values that cannot be: {'; '.join(impossible)}")
    if unit.own_effects is None:
        return unit
    return unit.with_effect_sources(read_sources(path, unit.own_effects.files))
