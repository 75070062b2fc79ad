"""The unit file of a commissioned drive.

Owns how values, tolerances and covariance get into the text of the datasheet's file, whose
comments and limits stay. It identifies nothing.
"""

from __future__ import annotations

from collections.abc import MutableMapping
from datetime import date
from typing import Any

import tomlkit
from tomlkit.items import Table

from analysis.commissioning.commission import Commissioned
from analysis.commissioning.coordinates import RATIO
from analysis.commissioning.response_model import LEAST_STD
from daq.untrusted.bounded_text import parse_toml
from sim.drive.unit import NO_PHYSICS
from sim.tolerance import DEFAULT, MOST
from sim.unit import unit_from_mapping

__all__ = ["commissioned_unit_text"]

_DIGITS = 6


def commissioned_unit_text(datasheet: str, found: Commissioned, name: str, today: date) -> str:
    """The text of a unit file (TOML) with the identified values in place of the datasheet's.

    Parameters
    ----------
    datasheet
        Text of the unit file that was commissioned.
    name
        Name of the unit in the new file.

    Raises
    ------
    ConfigurationError
        If the text would be no unit file.

    Notes
    -----
    ``[tolerance]`` holds the error of each value if the others are as identified: a later sweep
    shows what has changed since, which is known far better than any value by itself. A value
    without a tolerance stays exact.
    """
    document = tomlkit.parse(datasheet)
    document["name"] = name
    identified = {p.symbol: p for p in found.parameters if p.symbol != RATIO}
    for key, section in document.items():
        if not isinstance(section, MutableMapping) or key in NO_PHYSICS:
            continue
        for symbol in set(section) & set(identified):
            section[symbol] = _rounded(identified[symbol].value)
    tolerance = tomlkit.table()
    tolerance.add(tomlkit.comment("share, one standard deviation while the other values stay"))
    exact = [s for s, share in found.unit.tolerances.items() if share == 0.0]
    for symbol, share in [
        (DEFAULT, 0.0),
        *((s, p.conditional) for s, p in identified.items() if s != "b_t_deg"),
    ]:
        if symbol not in exact:
            kept = 0.0 if symbol == DEFAULT else min(max(share, LEAST_STD), MOST)
            tolerance.add(symbol, _rounded(kept))
    document.pop("tolerance", None)
    document.pop("commissioning", None)
    document.add("tolerance", tolerance)
    document.add("commissioning", _commissioning(found, today))
    text = tomlkit.dumps(document)
    unit_from_mapping(parse_toml(text), f"unit {name}")
    return text


def _commissioning(found: Commissioned, today: date) -> Table:
    table = tomlkit.table()
    table.add(tomlkit.comment("how the values were identified; `lashbench commission` wrote this"))
    table.add("date", today.isoformat())
    table.add("of", found.unit.name)
    for one in found.parameters:
        if one.symbol == RATIO:
            table.add("contribution_ratio", _rounded(one.value))
            table.add("contribution_ratio_std", _rounded(one.std))
    table.add("order", [one.symbol for one in found.parameters])
    rows = tomlkit.array()
    for row in found.covariance.tolist():
        rows.append([_rounded(value) for value in row])
    table.add("covariance", rows.multiline(True))
    held = [one for one in found.parameters if one.symbol != RATIO]
    table.add("datasheet", _mapping({p.symbol: p.datasheet for p in held}))
    table.add("std", _mapping({p.symbol: _rounded(p.std) for p in held}))
    sweeps = tomlkit.aot()
    for sweep in found.sweeps:
        sweeps.append(_mapping(sweep))
    table.add("sweeps", sweeps)
    return table


def _mapping(values: dict[str, Any]) -> Table:
    table = tomlkit.table()
    for key, value in values.items():
        table.add(key, value)
    return table


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")
