"""Sweeps that are taken together: which may be, and how they are told.

Owns what is refused, and a sweep as a document and in words for a person. It
imports nothing heavy, so that a screen may say it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np

from analysis.observation.rounding import settled
from daq.errors import InputError
from daq.frf import FrequencyResponse
from daq.plan import SweepPlan
from sim.unit import Unit

__all__ = ["check_together", "sweep_document", "sweep_lines", "unit_doubts"]

_NAMELESS = {"", "unknown"}
"""What a response says that names none."""


def check_together(responses: Sequence[FrequencyResponse]) -> None:
    """Refuse sweeps of different machines, whose difference is no cause of either, and copies.

    Raises
    ------
    InputError
        If the responses are said to be of different units or specimens, or one is there twice.
    """
    for what, said in (
        ("units", [one.unit for one in responses]),
        ("specimens", [str(one.provenance.get("serial") or "") for one in responses]),
    ):
        different = sorted(set(said) - _NAMELESS)
        if len({one.lower() for one in different}) > 1:
            raise InputError(
                f"the responses are of different {what}, {' and '.join(different)}; "
                "take them one by one"
            )
    for one, other in combinations(map(settled, responses), 2):
        if np.array_equal(one.gain, other.gain):
            raise InputError("a response was given twice; it says no more than once")


def unit_doubts(responses: Sequence[FrequencyResponse], unit: Unit) -> list[str]:
    """What is to be said where responses are said to be of another unit than the one given."""
    said = {one.unit for one in responses if one.unit.lower() not in _NAMELESS}
    own = {unit.name.lower()}
    if unit.commissioning is not None:
        own.add(unit.commissioning.of.lower())
    others = sorted(name for name in said if name.lower() not in own)
    return [f"the response is of unit {other}, not of {unit.name}" for other in others]


def sweep_document(plan: SweepPlan) -> dict[str, Any]:
    """One entry of ``sweeps``."""
    f = plan.frequencies_hz
    return {
        "levels_vpk": list(plan.levels_vpk),
        "start_hz": f[0],
        "stop_hz": f[-1],
        "points": len(f),
        "direction": plan.direction,
        "dc_offset_v": plan.dc_offset_v,
    }


def sweep_lines(sweeps: Sequence[Mapping[str, Any]]) -> list[str]:
    """Sweeps that were taken together, a line each, from ``sweeps``; nothing of one alone."""
    if len(sweeps) < 2:
        return []
    return [f"sweep {n}: {_words(one)}" for n, one in enumerate(sweeps, start=1)]


def _words(sweep: Mapping[str, Any]) -> str:
    levels = ", ".join(f"{level:g}" for level in sweep["levels_vpk"])
    offset = f", offset {sweep['dc_offset_v']:g} V" if sweep["dc_offset_v"] else ""
    return (
        f"{sweep['points']} points from {sweep['start_hz']:g} to {sweep['stop_hz']:g} Hz "
        f"{sweep['direction']} at {levels} V{offset}"
    )
