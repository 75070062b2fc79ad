"""What the columns of a table hold, from their headers, and by guess from their numbers.

Owns the words by which programs and people call frequency, magnitude and phase. It says of each
column whether the header states quantity and unit; what is guessed is never said to be stated.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.formats.foreign.quantities import QUANTITIES
from daq.formats.foreign.unit_words import frequency_in, gain_in, level_in, phase_in, plain_unit

__all__ = ["Meaning", "guessed_by_place", "meaning_of", "names_another_unit", "settled_unit"]

_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[(\[{](?P<unit>[^()\[\]{}]*)[)\]}]\s*$")
_STROKE = re.compile(
    r"^(?P<name>.*?)\s*(?:/\s*(?P<unit>[^\s/]+(?:/s(?:ec)?)?)|\bin\s+(?P<in>\S+))\s*$"
)
"""A name with its unit in brackets; behind a stroke or "in"."""
_LAST = re.compile(r"^(?P<name>.*?)[\s_,]+(?P<unit>\S+)$")


def _set(words: str) -> frozenset[str]:
    return frozenset(words.split())


_WORDS = (
    ("error", _set("std sigma stdev stddev err error uncertainty unsicherheit")),
    ("coherence", _set("coherence coh kohärenz cohérence koherenz γ² gamma2 coher")),
    ("phase", _set("phase ph phas arg angle ang winkel phi φ ∠ phasegang fase")),
    ("imag", _set("imag im imaginary imaginär imaginärteil imaginaire")),
    ("real", _set("real re realteil réel reel")),
    (
        "frequency",
        _set("frequency freq frequenz fréquence frequence frequencia f omega ω w hz"),
    ),
    (
        "gain",
        _set(
            "gain mag magn magnitude ampl amp amplitude modulus betrag db verstärkung transfer "
            "response tf frf h abs |h| dbmag lvl"
        ),
    ),
)
"""Words of a header, and the kind of column that they mean; the first that is there counts."""
_LOGARITHM = frozenset(("log", "log10", "lg"))
_ANGULAR = frozenset(("omega", "ω", "w"))


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a header says: a kind, and the quantity where kind and unit are stated.

    `kind` is one of frequency, gain, phase, real, imag, coherence, error, or empty.
    """

    kind: str = ""
    quantity: str | None = None


def meaning_of(header: str) -> Meaning:
    """The meaning of a column's header."""
    plain = " ".join(header.split())
    if plain.lower() in QUANTITIES and "_" in plain:
        return Meaning(_kind_of(plain.lower()), plain.lower())
    name, unit = _parted(plain)
    kind = _kind(name)
    if kind == "gain":
        # A part of a complex gain, which stands in the place of its unit: Gain (Real), Gain (deg).
        part = _kind(unit)
        kind = part if part in ("real", "imag") else "phase" if phase_in(unit) else kind
        unit = "" if part in ("real", "imag") else unit
    if kind == "frequency" and _words(name) & _LOGARITHM:
        return Meaning(kind)
    if kind:
        return Meaning(kind, _quantity(kind, unit))
    quantity = _by_unit(unit)
    # A unit alone says what it is: Hz, dB, deg. Behind a name that says nothing it is a guess.
    return Meaning(_kind_of(quantity or ""), None if name else quantity)


def settled_unit(kind: str, header: str, values: NDArray[Any]) -> str | None:
    """The quantity of a column whose kind is known and whose unit is guessed from its numbers.

    None where the header names a unit that is none of the quantity.
    """
    known = np.asarray(values)
    if known.dtype.kind == "c":
        return "gain_complex" if kind == "gain" else None
    known = known[np.isfinite(known)]
    name, unit = _parted(" ".join(header.split()))
    if kind in ("real", "imag"):
        return f"gain_{kind}"
    if name and not _kind(name):
        return _by_unit(unit)
    if kind == "frequency" and _words(f"{name} {unit}") & _LOGARITHM:
        small = bool(known.size) and float(np.max(known)) < 10.0
        return "frequency_log10_hz" if small else "frequency_hz"
    if unit and plain_unit(unit) not in ("", "-"):
        return None
    if kind == "frequency":
        return "frequency_rad_s" if _words(name) & _ANGULAR else "frequency_hz"
    if kind == "gain":
        return "gain_db" if np.any(known < 0.0) else "gain"
    if kind == "phase":
        beyond = bool(known.size) and float(np.max(np.abs(known))) > 2.2 * np.pi
        return "phase_deg" if beyond else "phase_rad"
    return None


def guessed_by_place(columns: Sequence[NDArray[Any]]) -> dict[str, int]:
    """What the columns of a table without names may be, by their number and numbers."""
    if any(column.dtype.kind == "c" for column in columns[1:2]):
        return {"frequency_hz": 0, "gain_complex": 1}
    if len(columns) == 2:
        return {"frequency_hz": 0, str(settled_unit("gain", "", columns[1])): 1}
    second, third = columns[1], columns[2]
    size = np.nanmax(np.abs(third)) if np.any(np.isfinite(third)) else 0.0
    swings = bool(np.any(second < 0.0) and np.any(second > 0.0))
    if swings and size <= min(3.0 * np.nanmax(np.abs(second)), 2.2 * np.pi):
        return {"frequency_hz": 0, "gain_real": 1, "gain_imag": 2}
    return {
        "frequency_hz": 0,
        str(settled_unit("gain", "", second)): 1,
        str(settled_unit("phase", "", third)): 2,
    }


def _parted(header: str) -> tuple[str, str]:
    """Name and unit of a header; the unit is empty where none stands there."""
    if found := _BRACKETS.match(header):
        return found["name"].strip(), found["unit"]
    found = _LAST.match(header)
    if found and _is_known(found["unit"]):
        return found["name"], found["unit"]
    if (found := _STROKE.match(header)) and not frequency_in(header):
        return found["name"].strip(), found["unit"] or found["in"]
    if any(known(header) for known in (frequency_in, phase_in)) or header.lower() == "db":
        return "", header
    return header, ""


def _is_known(unit: str) -> bool:
    """Whether a word can be nothing but a unit."""
    said = plain_unit(unit) in ("db", "lin", "linear", "abs", "ratio", "v/v")
    return said or any(known(unit) for known in (frequency_in, phase_in, level_in))


def _by_unit(unit: str) -> str | None:
    """The quantity that a unit alone means."""
    if plain_unit(unit) == "db":
        return "gain_db"
    return frequency_in(unit) or phase_in(unit)


def names_another_unit(header: str) -> bool:
    """Whether a header states a unit, and one that no gain has."""
    unit = _parted(" ".join(header.split()))[1]
    return plain_unit(unit) not in ("", "-") and gain_in(unit) is None


def _words(name: str) -> set[str]:
    return {word for word in re.split(r"[\s_:;,.\-]+", name.lower()) if word}


def _kind(name: str) -> str:
    words = _words(name)
    words |= {word.strip("|0123456789<>") for word in words}
    words |= {word.rstrip("()") for word in words}
    for kind, known in _WORDS:
        if words & known:
            return kind
    return ""


def _kind_of(quantity: str) -> str:
    if quantity in ("gain_real", "gain_imag"):
        return quantity.removeprefix("gain_")
    if "std" in quantity:
        return "error"
    return quantity.partition("_")[0]


def _quantity(kind: str, unit: str) -> str | None:
    """The quantity where kind and unit say it; a part of a complex number needs no unit."""
    if kind == "frequency":
        return frequency_in(unit)
    if kind == "phase":
        return phase_in(unit)
    if kind == "gain":
        return gain_in(unit)
    if kind == "coherence":
        return "coherence"
    if kind in ("real", "imag") and (unit in ("", "-") or gain_in(unit) == "gain"):
        return f"gain_{kind}"
    return None
