"""What was believed of a datasheet, as it is told with every answer.

Owns the fields of a document and the words for a person. What is believed, `sim.unit` knows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sim.tolerance import USUAL
from sim.unit import Unit

__all__ = ["HINT", "believed_document", "believed_lines", "is_usually_off", "trusts_much"]

HINT = (
    "a larger tolerance of the datasheet could explain this as well; "
    f"try --tolerance {100.0 * USUAL:g}%"
)

_HEALTHY = 3.0
"""Standard deviations within which a value is as its datasheet says."""

_LINES = 5
"""Most lines of what is believed."""

_ORIGINS = {
    "option": "by --tolerance",
    "unit file": "by the unit file",
    "default": "by default",
}

_SAY_OTHERWISE = "; say otherwise under [tolerance] in the unit file, or by --tolerance)"
"""End of the first line of what is believed by default."""


def believed_document(unit: Unit) -> dict[str, Any]:
    """The fields ``tolerance`` and ``tolerance_from``, each by symbol."""
    believed = unit.believed
    return {
        "tolerance": {symbol: share for symbol, (share, _) in believed.items()},
        "tolerance_from": {symbol: origin for symbol, (_, origin) in believed.items()},
    }


def believed_lines(document: Mapping[str, Any]) -> list[str]:
    """The same in words, of a document that holds them: a line for every share.

    Counted teeth and the filter's gain are exact if nobody says otherwise, and not told. Many
    shares that differ are told as a range.
    """
    shares, origins = document.get("tolerance", {}), document.get("tolerance_from", {})
    alike: dict[tuple[float, str], list[str]] = {}
    for symbol, share in shares.items():
        origin = origins.get(symbol, "")
        if share or origin != "default":
            alike.setdefault((share, origin), []).append(symbol)
    if len(alike) > _LINES:
        return _ranges(alike)
    ranked = sorted(alike.items(), key=lambda one: len(one[1]))
    rest = "all values" if len(alike) == 1 else "all other values"
    lines = []
    for number, ((share, origin), symbols) in enumerate(ranked, start=1):
        said = "exact" if share == 0.0 else f"to {100.0 * share:.3g} %"
        named = rest if number == len(ranked) and len(symbols) > 1 else ", ".join(symbols)
        by = f" ({_ORIGINS[origin]})" if origin in _ORIGINS else ""
        lines.append(f"datasheet believed {said}: {named}{by}")
    return _with_hint(lines)


def _with_hint(lines: list[str]) -> list[str]:
    """Say once what to do about what is believed by default."""
    end = f" ({_ORIGINS['default']})"
    first = next((number for number, line in enumerate(lines) if line.endswith(end)), None)
    if first is not None:
        lines[first] = lines[first].removesuffix(")") + _SAY_OTHERWISE
    return lines


def _ranges(alike: Mapping[tuple[float, str], Sequence[str]]) -> list[str]:
    """A line for each origin, of shares that differ from value to value."""
    lines = []
    for origin in dict.fromkeys(origin for _, origin in alike):
        known = [(share, symbol) for (share, by), names in alike.items() if by == origin
                 for symbol in names]  # fmt: skip
        (least, best), (most, worst) = min(known), max(known)
        by = f" ({_ORIGINS[origin]})" if origin in _ORIGINS else ""
        lines.append(
            f"datasheet believed to {100.0 * least:.2g} % ({best}) to {100.0 * most:.2g} % "
            f"({worst}), {len(known)} values{by}"
        )
    return _with_hint(lines)


def trusts_much(document: Mapping[str, Any]) -> bool:
    """Whether all values of the datasheet are believed to be better than usual."""
    return all(share < USUAL for share in document.get("tolerance", {}).values())


def is_usually_off(value: float, datasheet: float | None) -> bool:
    """Whether a value is off its datasheet by no more than those of a usual one are."""
    return datasheet is not None and abs(value / datasheet - 1.0) < _HEALTHY * USUAL
