"""Units of measurement in which catalogues give the values of a unit file.

Owns the conversion factors, the accepted spellings, and the reading of "3.6 V/krpm". Unit files
themselves hold SI units, and degrees for backlash. It judges no value.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

__all__ = [
    "SENSOR_GAINS",
    "CatalogueUnit",
    "parse_quantity",
    "shown_symbol",
    "unit_in_files",
    "units_of",
]

# Exact by definition: international inch and pound, standard gravity (NIST SP 811, appendix B).
_INCH = 0.0254
_FOOT = 12.0 * _INCH
_POUND = 0.45359237
_OUNCE = _POUND / 16.0
_GRAVITY = 9.80665
_RPM = 2.0 * math.pi / 60.0
_DEGREE = math.pi / 180.0
_ARCMIN = _DEGREE / 60.0
_OZ_IN = _OUNCE * _GRAVITY * _INCH
_LB_IN = _POUND * _GRAVITY * _INCH
_LB_FT = _POUND * _GRAVITY * _FOOT
_KGF_M = _GRAVITY
_KGF_CM = _GRAVITY / 100.0


@dataclass(frozen=True, slots=True)
class CatalogueUnit:
    """A unit of measurement of one quantity.

    Parameters
    ----------
    name
        As it is printed.
    factor
        Value in the unit of the file per value in this one.
    reciprocal
        Whether it measures the inverse of the quantity, as rpm/V does of a back-EMF constant;
        the value in the file is then ``factor / value``.
    """

    name: str
    factor: float
    reciprocal: bool = False

    def convert(self, value: float) -> float:
        """The value in the unit of the file.

        Raises
        ------
        ValueError
            If the inverse of zero is asked for.
        """
        if not self.reciprocal:
            return value * self.factor
        if value == 0.0:
            raise ValueError(f"0 {self.name} has no inverse")
        return self.factor / value


def _of(first: str, others: Mapping[str, float], *more: CatalogueUnit) -> tuple[CatalogueUnit, ...]:
    listed = {first: 1.0, **others}
    return (*(CatalogueUnit(name, factor) for name, factor in listed.items()), *more)


_INDUCTANCE = _of("H", {"mH": 1e-3, "uH": 1e-6})
_RESISTANCE = _of("ohm", {"mohm": 1e-3, "kohm": 1e3})
_PER_SPEED = {
    "V/krpm": 1.0 / (1000.0 * _RPM),
    "V/rpm": 1.0 / _RPM,
    "mV/rpm": 1e-3 / _RPM,
    "mV.s/rad": 1e-3,
    "V.s/deg": 1.0 / _DEGREE,
}
_BACK_EMF = _of(
    "V.s/rad",
    _PER_SPEED,
    CatalogueUnit("rpm/V", 1.0 / _RPM, reciprocal=True),
    CatalogueUnit("rad/s/V", 1.0, reciprocal=True),
)
_TACHOMETER = _of("V.s/rad", _PER_SPEED)
_TORQUES = {
    "mN.m": 1e-3,
    "N.cm": 1e-2,
    "N.mm": 1e-3,
    "oz.in": _OZ_IN,
    "lb.in": _LB_IN,
    "lb.ft": _LB_FT,
    "kgf.cm": _KGF_CM,
    "gf.cm": _KGF_CM / 1000.0,
}
_TORQUE = _of("N.m", _TORQUES)
_TORQUE_CONSTANT = _of("N.m/A", {f"{name}/A": factor for name, factor in _TORQUES.items()})
_INERTIA = _of(
    "kg.m^2",
    {
        "kg.cm^2": 1e-4,
        "kg.mm^2": 1e-6,
        "g.cm^2": 1e-7,
        "g.mm^2": 1e-9,
        "oz.in^2": _OUNCE * _INCH**2,
        "lb.in^2": _POUND * _INCH**2,
        "lb.ft^2": _POUND * _FOOT**2,
        "oz.in.s^2": _OZ_IN,
        "lb.in.s^2": _LB_IN,
    },
)
_VISCOUS = _of(
    "N.m.s/rad",
    {
        "mN.m.s/rad": 1e-3,
        "N.m/krpm": 1.0 / (1000.0 * _RPM),
        "mN.m/krpm": 1e-6 / _RPM,
        "N.m/rpm": 1.0 / _RPM,
        "mN.m/rpm": 1e-3 / _RPM,
        "N.m.s/deg": 1.0 / _DEGREE,
        "oz.in/krpm": _OZ_IN / (1000.0 * _RPM),
    },
)
_STIFFNESS = _of(
    "N.m/rad",
    {
        "N.m/arcmin": 1.0 / _ARCMIN,
        "N.m/deg": 1.0 / _DEGREE,
        "kN.m/rad": 1e3,
        "N.m/mrad": 1e3,
        "oz.in/rad": _OZ_IN,
        "lb.in/rad": _LB_IN,
        "lb.in/deg": _LB_IN / _DEGREE,
        "lb.in/arcmin": _LB_IN / _ARCMIN,
        "kgf.m/rad": _KGF_M,
        "kgf.m/arcmin": _KGF_M / _ARCMIN,
    },
)
_PLAY = _of(
    "deg", {"arcmin": 1.0 / 60.0, "arcsec": 1.0 / 3600.0, "mrad": 1e-3 / _DEGREE,
            "rad": 1.0 / _DEGREE},
)  # fmt: skip
_SENSITIVITY = _of(
    "V.s^2/m",
    {"V/(m/s^2)": 1.0, "mV/(m/s^2)": 1e-3, "V/g": 1.0 / _GRAVITY, "mV/g": 1e-3 / _GRAVITY},
)
_ANGULAR_SENSITIVITY = _of(
    "V.s^2/rad", {"V/(rad/s^2)": 1.0, "mV/(rad/s^2)": 1e-3, "mV/(deg/s^2)": 1e-3 / _DEGREE}
)
_CURRENT_SENSITIVITY = _of("V/A", {"mV/A": 1e-3, "mV/mA": 1.0})
_LENGTH = _of("m", {"mm": 1e-3, "cm": 1e-2, "in": _INCH})
_FREQUENCY = _of("Hz", {"kHz": 1e3, "rad/s": 1.0 / (2.0 * math.pi)})
_PEAK = _of("V", {"mV": 1e-3, "V rms": math.sqrt(2.0), "V pp": 0.5})
_VOLTAGE = _of("V", {"mV": 1e-3})

_QUANTITIES: Mapping[str, tuple[CatalogueUnit, ...]] = {
    "L_a": _INDUCTANCE,
    "R_m": _RESISTANCE,
    "k_b": _BACK_EMF,
    "k_t": _TORQUE_CONSTANT,
    "k_ts": _TACHOMETER,
    **dict.fromkeys(("J_m", "J_g1", "J_s1", "J_p2", "J_g2", "J_L", "J_cm", "J_cL"), _INERTIA),
    **dict.fromkeys(("B_m", "B_L", "c_s1", "c_g1", "c_2", "c_3", "c_cm", "c_cL"), _VISCOUS),
    **dict.fromkeys(("T_f_m", "T_f_L"), _TORQUE),
    **dict.fromkeys(("k_g1", "k_s1", "k_2", "k_3", "k_cm", "k_cL"), _STIFFNESS),
    **dict.fromkeys(("b_t_deg", "b3_deg"), _PLAY),
    **dict.fromkeys(("eta_1", "eta_2", "eta_3"), _of("", {"%": 1e-2})),
    **dict.fromkeys(("start_hz", "stop_hz", "corner_hz", "rate_hz"), _FREQUENCY),
    **dict.fromkeys(("bandwidth_hz", "low_pass_hz", "high_pass_hz"), _FREQUENCY),
    "radius_m": _LENGTH,
    "current_limit_a": _of("A", {"mA": 1e-3, "A rms": math.sqrt(2.0)}),
    **dict.fromkeys(("delay_s", "T_i_s", "computing_s"), _of("s", {"ms": 1e-3, "us": 1e-6})),
    "K_v": _of("1/s", {"m/min/mm": 1000.0 / 60.0}),
    "source_vpk": _PEAK,
    "source_offset_v": _VOLTAGE,
    "k_acc": _SENSITIVITY,
    "k_angular": _ANGULAR_SENSITIVITY,
    "k_current": _CURRENT_SENSITIVITY,
}
_PURE = (CatalogueUnit("", 1.0),)

SENSOR_GAINS = {"V.s^2/m": "k_acc", "V.s^2/rad": "k_angular", "V/A": "k_current"}
"""Symbols that ``k_ts`` of other sensors than a tachometer is known by here, by its unit."""

_SAME = (
    ("1000rpm", "krpm"), ("rpm/1000", "krpm"), ("µ", "u"), ("μ", "u"), ("Ω", "ohm"), ("Ω", "ohm"),
    ("²", "2"), ("°", "deg"), ("′", "arcmin"), ("″", "arcsec"),
)  # fmt: skip
_SPELLINGS = {
    "V/rad/s": "V.s/rad", "mV/rad/s": "mV.s/rad", "V/deg/s": "V.s/deg",
    "Nm/rad/s": "N.m.s/rad", "mNm/rad/s": "mN.m.s/rad", "Nm/deg/s": "N.m.s/deg",
    "ohms": "ohm", "Vpk": "V", "Vp": "V", "Vpeak": "V", "Vpkpk": "V pp", "degree": "deg",
    "degrees": "deg", "'": "arcmin", '"': "arcsec", "rad/Vs": "rad/s/V",
}  # fmt: skip
"""Other ways to write a unit, without its dots, and the name of the unit."""
_TURNED = (("inozf", "ozin"), ("inoz", "ozin"), ("inlbf", "lbin"), ("inlb", "lbin"),
           ("ftlbf", "lbft"), ("ftlb", "lbft"), ("ozfin", "ozin"), ("lbfin", "lbin"),
           ("lbfft", "lbft"), ("kgcm/A", "kgfcm/A"))  # fmt: skip
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)


def units_of(symbol: str) -> tuple[CatalogueUnit, ...]:
    """The units in which a value may be given, that of the file first; a ratio has none."""
    return _QUANTITIES.get(symbol, _PURE)


def shown_symbol(symbol: str) -> str:
    """The symbol as it stands in a unit file."""
    return "k_ts" if symbol in SENSOR_GAINS.values() else symbol


def unit_in_files(symbol: str) -> str:
    """The unit that a value has in a unit file; empty where it has none."""
    return units_of(symbol)[0].name


def parse_quantity(symbol: str, text: str) -> tuple[float, CatalogueUnit]:
    """Read a value with or without its unit, as in ``3.6 V/krpm``; a ratio also as ``72/12``.

    Parameters
    ----------
    symbol
        Of the value, as in unit files; ``corner_hz`` is that of the filter.
    text
        A number, then a unit; without one the unit of the file is meant.

    Returns
    -------
    The value in the unit of the file, and the unit in which it was given.

    Raises
    ------
    ValueError
        If it is not a finite number, or its unit is none of this quantity; says what to give.
    """
    text = text.strip()
    found = _NUMBER.match(text)
    if not text.isprintable() or found is None or text[found.end() :].startswith(","):
        raise ValueError(f"{text!r} is not a number; give one with a decimal point, as in 0.25")
    value, rest = float(found.group()), text[found.end() :].strip()
    choices = units_of(symbol)
    if choices is _PURE:
        return _ratio(value, rest, text), _PURE[0]
    unit = choices[0] if not rest else _named(rest, choices)
    if unit is None:
        known = ", ".join(choice.name for choice in choices if choice.name)
        raise ValueError(f"{rest!r} is no unit of {shown_symbol(symbol)}; use one of: {known}")
    converted = unit.convert(value)
    if not math.isfinite(converted):
        raise ValueError(f"{text!r} is too large a number")
    return converted, unit


def _ratio(value: float, rest: str, text: str) -> float:
    if rest:
        divisor = rest[1:].strip()
        if rest[0] not in "/:" or not _NUMBER.fullmatch(divisor) or float(divisor) == 0.0:
            raise ValueError(f"{text!r} is not a number or a ratio; give for instance 6 or 72/12")
        value /= float(divisor)
    if not math.isfinite(value):
        raise ValueError(f"{text!r} is too large a number")
    return value


def _named(text: str, choices: tuple[CatalogueUnit, ...]) -> CatalogueUnit | None:
    wanted = _plain(text)
    wanted = _plain(_SPELLINGS.get(wanted, wanted))
    names = {_plain(choice.name): choice for choice in choices}
    if wanted in names:
        return names[wanted]
    # M is mega and m is milli: they differ by nine noughts, so that case counts there.
    if text[:1] == "M":
        return None
    return {name.lower(): choice for name, choice in names.items()}.get(wanted.lower())


def _plain(text: str) -> str:
    for written, meant in _SAME:
        text = text.replace(written, meant)
    text = re.sub(r"[\s.·⋅*^()_-]", "", text)
    for written, meant in _TURNED:
        text = text.replace(written, meant)
    return text
