"""Pictures made of text: departures by level and band, bars of probability, datasheet values.

Owns their layout. Colour repeats what signs and digits say. It knows no widget.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from textual.content import Content

from sim.datasheet.catalogue_units import unit_in_files
from tui.app.plot.palette import Palette
from tui.text.symbols import printed_unit

__all__ = ["LEAST_TOLD", "bar", "datasheet_table", "departure_grid"]

LEAST_TOLD = 0.005
"""What is believed less is 0.00 in two digits, and not told."""

_BLOCKS = " \u258f\u258e\u258d\u258c\u258b\u258a\u2589\u2588"
_CELL = 8
"""Columns of a cell of the grid."""

_LABEL = 13
_CLEAR_SIGMA = 5.0


def bar(share: float, width: int) -> str:
    """A bar of a share from 0 to 1, to an eighth of a character."""
    eighths = round(max(0.0, min(1.0, share)) * 8 * width)
    whole, rest = divmod(eighths, 8)
    text = "\u2588" * whole + (_BLOCKS[rest] if rest else "")
    return f"{text:<{width}}"


def departure_grid(
    departures: Sequence[Mapping[str, Any]], palette: Palette, width: int
) -> list[Content]:
    """Where the measurement departs: a row for each level and quantity, a column for each band.

    Bands are those in which something departs; a cell holds the departure in dB or degrees, and
    signs for how clear it is: ``!`` from 2, ``!!`` from 5 standard deviations on.

    Parameters
    ----------
    departures
        The field ``residual`` of a diagnosis.
    width
        Columns that there are; bands of the largest departures are kept.
    """
    if not departures:
        return [Content("no band departs by more than chance")]
    bands = _bands(departures, max(1, (width - _LABEL) // _CELL))
    head = "".join(f"{low:>.0f}-{high:.0f}".rjust(_CELL) for low, high in bands)
    lines = [Content(f"{'Hz':<{_LABEL}}{head}")]
    rows = sorted({(one["source_vpk"], one["quantity"]) for one in departures})
    for level, quantity in rows:
        unit = "dB" if quantity == "gain" else "deg"
        parts: list[str | tuple[str, str]] = [f"{f'{level:g} V, {unit}':<{_LABEL}}"]
        for band in bands:
            parts.append(_cell(_strongest(departures, level, quantity, band), palette))
        lines.append(Content.assemble(*parts))
    left = len({tuple(one["band_hz"]) for one in departures}) - len(bands)
    if left > 0:
        lines.append(Content(f"and {left} bands that depart less"))
    return lines


def datasheet_table(values: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """What the sweep says of each datasheet value beside its tolerance; in 69 columns.

    Parameters
    ----------
    values
        The field ``datasheet`` of a diagnosis: those first of which most was learned. Values of
        zero are left out.
    """
    known = {symbol: one for symbol, one in values.items() if one["datasheet"]}
    told = [(symbol, one) for symbol, one in known.items() if one["determined"]]
    silent = [symbol for symbol, one in known.items() if not one["determined"]]
    lines = []
    if told:
        lines = [
            "Datasheet values by this sweep, each with one standard deviation",
            f"{'measured':>28}{'datasheet':>21}{'off by':>20}",
        ]
    for symbol, one in told:
        size = abs(one["datasheet"])
        off = round(100.0 * (one["value"] - one["datasheet"]) / size, 1) + 0.0
        name = f"{symbol}{printed_unit(unit_in_files(symbol))}"
        lines.append(
            f" {name:<17}{_with_share(one['value'], one['std'] / size)}"
            f"{_with_share(one['datasheet'], one['datasheet_std'] / size)}{f'{off:+.1f} %':>9}"
        )
    if silent:
        lines.append(f"datasheet values not determined by this sweep: {', '.join(silent)}")
    return lines


def _with_share(value: float, std: float) -> str:
    """A value and its standard deviation in per cent, in 21 columns."""
    return f"{value:>10.4g} +- {f'{100.0 * std:.2g} %':<7}"


def _bands(departures: Sequence[Mapping[str, Any]], most: int) -> list[tuple[float, float]]:
    """The bands with the largest departures, ascending."""
    largest: dict[tuple[float, float], float] = {}
    for one in departures:
        low, high = one["band_hz"]
        largest[low, high] = max(largest.get((low, high), 0.0), abs(one["sigma"]))
    kept = sorted(largest, key=lambda band: -largest[band])[:most]
    return sorted(kept)


def _strongest(
    departures: Sequence[Mapping[str, Any]],
    level: float,
    quantity: str,
    band: tuple[float, float],
) -> Mapping[str, Any] | None:
    found = [
        one
        for one in departures
        if (one["source_vpk"], one["quantity"], tuple(one["band_hz"])) == (level, quantity, band)
    ]
    return max(found, key=lambda one: abs(one["sigma"]), default=None)


def _cell(one: Mapping[str, Any] | None, palette: Palette) -> str | tuple[str, str]:
    if one is None:
        return "\u00b7".rjust(_CELL)
    clear = "!!" if abs(one["sigma"]) >= _CLEAR_SIGMA else "! "
    digits = 1 if abs(one["mean"]) < 99.5 else 0
    text = f"{one['mean']:+.{digits}f}{clear}".rjust(_CELL)
    colour = palette.colour(5 if one["mean"] > 0 else 4)
    return (text, f"bold {colour}" if clear == "!!" else colour)
