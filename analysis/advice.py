"""What an estimate means for whoever adjusts the gears, in plain words.

Owns the sentence about which stage to adjust and the comparison of b1 and b2
with their limits. It estimates nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sim.unit import Unit

__all__ = ["limit_lines", "stage_actions", "stage_to_adjust"]

_HALF = 0.5
_SIGMA = 2.0
"""Standard errors by which a value must clear a limit for the verdict to be sure."""


def stage_to_adjust(document: Mapping[str, Any]) -> str:
    """Which stage holds more of the backlash, from the document of ``estimate --json``.

    The verdict is taken only where the whole 95 % interval of the contribution
    ratio lies on one side of one half.
    """
    ratio = document["contribution_ratio"]
    if ratio["value"] == 1.0 and not ratio["std"]:
        return "There is one gear stage: it holds all of the backlash."
    low, high = ratio.get("interval95") or _interval(ratio)
    share = f"{100 * ratio['value']:.0f} % of the backlash sits in stage 1 (95 %: "
    share += f"{100 * low:.0f} to {100 * high:.0f} %)"
    if low > _HALF:
        return f"Adjust stage 1 first: {share}."
    if high < _HALF:
        return f"Adjust stage 2 first: {share}."
    return f"Neither stage stands out: {share}. Measure at more levels before adjusting one."


def limit_lines(document: Mapping[str, Any], unit: Unit) -> list[str]:
    """b1 and b2 beside their limits, one line each.

    A unit file may set ``b1_deg`` and ``b2_deg`` under ``[limits]``. Without
    them the whole backlash in that stage is the greatest value there can be.
    """
    b_t = unit.backlash.b_t_deg
    most = {"b1_deg": b_t * unit.output_ratio, "b2_deg": b_t}
    lines = []
    for stage, name in enumerate(list(most)[: unit.stages], start=1):
        value, std = document[name]["value"], document[name]["std"] or 0.0
        limit = getattr(unit.limits, name)
        said = f"b{stage} = {value:.4f} +- {std:.4f} deg"
        if limit is None:
            lines.append(f"{said}; no limit set, all of it would be {most[name]:.4f} deg")
        else:
            lines.append(f"{said}; limit {limit:.4f} deg: {_verdict(value, std, limit)}")
    return lines


def stage_actions(document: Mapping[str, Any], unit: Unit) -> list[str]:
    """What to do about each stage that has a limit: leave, adjust or replace, measure again."""
    actions = []
    for stage in range(1, unit.stages + 1):
        name = f"b{stage}_deg"
        limit = getattr(unit.limits, name)
        if limit is None:
            continue
        value, std = document[name]["value"], document[name]["std"] or 0.0
        actions.append(f"Stage {stage}: {_ACTIONS[_verdict(value, std, limit)]}")
    if not actions:
        return [
            "No limits are set; b1_deg and b2_deg under [limits] of the unit file would say "
            "whether to adjust, replace or leave a stage."
        ]
    return actions


def _interval(ratio: Mapping[str, Any]) -> tuple[float, float]:
    std = ratio["std"] or 0.0
    return max(0.0, ratio["value"] - 2.0 * std), min(1.0, ratio["value"] + 2.0 * std)


_WITHIN, _ABOVE, _OPEN = "WITHIN", "ABOVE", "NOT DECIDED, too close for its error"
_ACTIONS = {
    _WITHIN: "leave it; its backlash is within the limit.",
    _ABOVE: (
        "adjust its mesh (centre distance or preload) and measure again; replace the gear pair "
        "where nothing is left to adjust, or where the play came with wear."
    ),
    _OPEN: "measure again at further source levels; its backlash is too near the limit to decide.",
}


def _verdict(value: float, std: float, limit: float) -> str:
    if value + _SIGMA * std <= limit:
        return _WITHIN
    if value - _SIGMA * std > limit:
        return _ABOVE
    return _OPEN
