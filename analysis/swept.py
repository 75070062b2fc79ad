"""Sweeps that were diagnosed together: as a document, and in words for a person.

Owns how a sweep is told in a diagnosis. It imports nothing heavy, so that a
screen may say it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from daq.plan import SweepPlan

__all__ = ["sweep_document", "sweep_lines"]


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
    """Sweeps that were diagnosed together, a line each, from ``sweeps``; nothing of one alone."""
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
