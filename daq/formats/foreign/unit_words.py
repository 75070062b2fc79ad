"""Units as programs write them, and the quantity that a number in such a unit is.

Owns the spellings. It decides nothing where a word leaves a doubt: V alone is neither peak nor
rms.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

__all__ = ["frequency_in", "gain_in", "level_in", "phase_in", "plain_unit"]

_FREQUENCY: Mapping[str, str] = {
    **dict.fromkeys(("hz", "hertz", "cps", "cycles/s", "cycle/s"), "frequency_hz"),
    **dict.fromkeys(("khz", "kilohertz"), "frequency_khz"),
    **dict.fromkeys(
        ("rad/s", "rad/sec", "rad/second", "rad.s-1", "rads/s", "rads-1", "radians/s",
         "radians/sec", "radians/second", "rad*s-1"),
        "frequency_rad_s",
    ),
    **dict.fromkeys(("rpm", "1/min", "u/min", "min-1", "rev/min", "r/min"), "frequency_rpm"),
}  # fmt: skip
_LEVEL: Mapping[str, str] = {
    **dict.fromkeys(("vpk", "vp", "vpeak", "v0pk", "v0p", "voltspeak", "voltpeak"), "vpk"),
    **dict.fromkeys(("vrms", "vr", "veff", "voltsrms", "voltrms"), "vrms"),
    **dict.fromkeys(("vpp", "vpkpk", "vpktopk", "vpeaktopeak", "vpkpp"), "vpp"),
}
_GAIN: Mapping[str, str] = {
    **dict.fromkeys(("db", "decibel", "decibels", "dbv/v", "dbmag"), "gain_db"),
    **dict.fromkeys(
        ("v/v", "1", "lin", "linear", "linmag", "abs", "ratio", "vo/vi", "vout/vin",
         "mag", "unitless"),
        "gain",
    ),
}  # fmt: skip
_PHASE: Mapping[str, str] = {
    **dict.fromkeys(("deg", "degree", "degrees", "°", "º", "degs"), "phase_deg"),
    **dict.fromkeys(("rad", "radian", "radians"), "phase_rad"),
}


def plain_unit(text: str) -> str:
    """A unit without brackets, blanks and capitals; the usual damage to a degree sign is mended."""
    text = text.strip().strip("()[]{}<>").replace("\N{MASCULINE ORDINAL INDICATOR}", "°")
    text = text.replace("Â°", "°").replace("\ufffd", "°").replace("\N{SUPERSCRIPT TWO}", "2")
    return re.sub(r"[\s_]+", "", text).lower()


def frequency_in(unit: str) -> str | None:
    """The quantity that a frequency in a unit is, such as ``frequency_rad_s``; None if unknown."""
    return _FREQUENCY.get(plain_unit(unit))


def level_in(unit: str) -> str | None:
    """``vpk``, ``vrms`` or ``vpp``; None where a unit does not say which."""
    return _LEVEL.get(plain_unit(unit).replace("-", "").replace(".", "").replace("/", ""))


def gain_in(unit: str) -> str | None:
    """``gain_db`` or ``gain``; None if unknown."""
    return _GAIN.get(plain_unit(unit))


def phase_in(unit: str) -> str | None:
    """``phase_deg`` or ``phase_rad``; None if unknown."""
    return _PHASE.get(plain_unit(unit))
