"""Which values of a unit file are usual, and which are possible, one by one and together.

Owns the plausible ranges, and where each value stands in the file. It looks at no unit: what lies
outside, and why, is told by `sim.datasheet.plausibility`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from sim.datasheet.catalogue_units import SENSOR_GAINS, unit_in_files

__all__ = ["COMBINED", "KEYS", "SINGLES", "Range", "Values"]

Values = Mapping[str, float]
"""By symbol; `slow_gain` and `fast_gain` are those of a controller at the ends of the limits."""

_SECTIONS = {
    "motor": ("L_a", "R_m", "k_b", "k_t", "J_m", "B_m", "T_f_m"),
    "electronics": ("k_a", "k_ts", "filter_numerator", "filter_denominator"),
    "stage1": ("N_1", "k_g1", "J_g1", "k_s1", "J_s1", "J_p2", "eta_1"),
    "stage2": ("N", "k_2", "eta_2"),
    "stage3": ("J_g2", "N_3", "k_3", "b3_deg", "eta_3"),
    "load": ("J_L", "T_f_L"),
    "backlash": ("b_t_deg",),
    "limits": ("source_vpk", "source_offset_v", "start_hz", "stop_hz"),
    "damping": ("B_L", "c_s1", "c_g1", "c_2", "c_3"),
    "amplifier": ("bandwidth_hz", "current_limit_a"),
    "sampling": ("rate_hz",),
    "sensor": ("counts", "delay_s", "radius_m", "low_pass_hz", "high_pass_hz"),
    "motor_coupling": ("k_cm", "c_cm", "J_cm"),
    "load_coupling": ("k_cL", "c_cL", "J_cL"),
    "loop": ("K_p", "T_i_s", "K_v", "computing_s"),
}
KEYS = {symbol: f"{name}.{symbol}" for name, symbols in _SECTIONS.items() for symbol in symbols}
KEYS |= dict.fromkeys(SENSOR_GAINS.values(), "electronics.k_ts")
"""Where a value stands in a unit file, by symbol."""


@dataclass(frozen=True, slots=True)
class Range:
    """What a quantity can be.

    Parameters
    ----------
    needs
        Symbols that it is calculated from, the one most likely to be wrong first.
    usual, possible
        Least and greatest value; outside `usual` is worth a look, outside `possible` cannot be.
    of
        The quantity from values by symbol; the first of `needs` itself if left out.
    means
        What it is, with ``{value}``; only for a quantity that is calculated.
    unit
        Of the quantity, for the range in messages.
    remedy
        What to look at if no unit of measurement explains it.
    """

    needs: tuple[str, ...]
    usual: tuple[float, float]
    possible: tuple[float, float]
    of: Callable[[Values], float] | None = None
    means: str = ""
    unit: str = ""
    remedy: str = ""

    def value(self, values: Values) -> float:
        """The quantity of some values."""
        return values[self.needs[0]] if self.of is None else self.of(values)


def _single(
    symbol: str, usual: tuple[float, float], possible: tuple[float, float], remedy: str = ""
) -> Range:
    return Range((symbol,), usual, possible, unit=unit_in_files(symbol), remedy=remedy)


_INERTIA = ((1e-12, 1e5), (1e-16, 1e9))
_STIFFNESS = ((1e-3, 1e10), (1e-7, 1e14))
_STAGE = ((1.05, 400.0), (0.02, 1e5))
_TURNED = "it is turns of the faster side per turn of the slower one, 1 or more"

# From motors of 4 mm diameter to drives of antennas.
SINGLES = (
    _single("L_a", (1e-6, 0.3), (1e-9, 20.0)),
    _single("R_m", (5e-3, 500.0), (1e-6, 1e6)),
    _single("k_b", (1e-4, 30.0), (1e-7, 1e4)),
    _single("k_t", (1e-4, 30.0), (1e-7, 1e4)),
    _single("J_m", *_INERTIA),
    _single("B_m", (0.0, 10.0), (0.0, 1e5)),
    _single("T_f_m", (0.0, 100.0), (0.0, 1e5)),
    _single("k_a", (1e-3, 1e3), (1e-7, 1e7)),
    _single("k_ts", (1e-5, 1e3), (1e-10, 1e8)),
    _single("N_1", (1.0, 400.0), (0.02, 1e5), remedy=_TURNED),
    _single("k_g1", *_STIFFNESS),
    _single("J_g1", *_INERTIA),
    _single("k_s1", *_STIFFNESS),
    _single("J_s1", (0.0, 1e5), (0.0, 1e9)),
    _single("J_p2", (0.0, 1e5), (0.0, 1e9)),
    _single("N", *_STAGE, remedy=f"{_TURNED}; a drive with one stage has no [stage2]"),
    _single("k_2", *_STIFFNESS),
    *(_single(symbol, (0.3, 1.0), (0.2, 1.0)) for symbol in ("eta_1", "eta_2", "eta_3")),
    _single("J_g2", *_INERTIA),
    _single("N_3", *_STAGE, remedy=_TURNED),
    _single("k_3", *_STIFFNESS),
    _single("J_L", (1e-10, 1e7), (1e-16, 1e10)),
    _single("T_f_L", (0.0, 1e5), (0.0, 1e8)),
    *(_single(symbol, (0.0, 3.0), (0.0, 45.0)) for symbol in ("b_t_deg", "b3_deg")),
    _single("source_vpk", (1e-3, 100.0), (1e-7, 1e5)),
    _single("source_offset_v", (0.0, 100.0), (0.0, 1e5)),
    _single("start_hz", (1e-4, 1e4), (1e-7, 1e7)),
    _single("stop_hz", (1e-2, 1e5), (1e-6, 1e8)),
    _single("bandwidth_hz", (20.0, 2e4), (0.1, 1e6)),
    _single("current_limit_a", (0.02, 1e3), (1e-4, 1e6)),
    _single("rate_hz", (50.0, 1e5), (0.1, 1e5)),
    _single("counts", (64.0, 5e7), (4.0, 1e9), "counts in a turn are four times the lines"),
    _single("delay_s", (0.0, 0.02), (0.0, 0.1)),
    _single("K_p", (1e-6, 1e6), (1e-12, 1e12)),
    _single("T_i_s", (1e-4, 100.0), (1e-6, 1e5)),
    _single("K_v", (0.5, 1e3), (1e-3, 1e5)),
    _single("computing_s", (0.0, 0.005), (0.0, 0.1)),
    # From piezoresistive sensors for shocks (0.1 mV/g) to seismic ones (10 V/g).
    _single("k_acc", (1e-5, 2.0), (1e-9, 1e4)),
    _single("k_angular", (1e-7, 10.0), (1e-12, 1e5)),
    _single("k_current", (1e-3, 1e2), (1e-7, 1e6)),
    _single("radius_m", (2e-3, 5.0), (1e-4, 1e3), "it is the distance from the axis"),
    _single("low_pass_hz", (20.0, 1e5), (0.1, 1e7)),
    _single("high_pass_hz", (1e-4, 20.0), (1e-9, 1e5)),
    *(_single(symbol, *_STIFFNESS) for symbol in ("k_cm", "k_cL")),
    *(_single(symbol, *_INERTIA) for symbol in ("J_cm", "J_cL")),
    *(
        _single(symbol, (0.0, 1e5), (0.0, 1e9))
        for symbol in ("B_L", "c_s1", "c_g1", "c_2", "c_3", "c_cm", "c_cL")
    ),
)


def _total(v: Values) -> float:
    return v["N_1"] * v.get("N", 1.0) * v.get("N_3", 1.0)


def _stall_torque(v: Values) -> float:
    volts = (v["source_vpk"] + v["source_offset_v"]) * v.get("slow_gain", 1.0)
    if "R_m" in v:
        return v["k_t"] * v["k_a"] * volts / v["R_m"]
    return v["k_t"] * min(v["k_a"] * volts, v.get("current_limit_a", math.inf))


def _acceleration(v: Values) -> float:
    return _stall_torque(v) / v["J_m"]


def _friction(v: Values) -> float:
    return (v["T_f_m"] + v["T_f_L"] / _total(v)) / _stall_torque(v)


def _part_at_motor(symbol: str, *ratios: str) -> Range:
    return Range(
        (symbol, "J_m", *ratios), (0.0, 30.0), (0.0, 1e3),
        lambda v: v[symbol] / math.prod(v[ratio] for ratio in ratios) ** 2 / v["J_m"],
        f"{symbol} seen by the motor is {{value}} times J_m",
    )  # fmt: skip


def _samples_a_cycle(v: Values) -> float:
    return v["rate_hz"] / v["stop_hz"]


def _share_of_stage_3(v: Values) -> float:
    if v["b_t_deg"] == 0.0:
        return math.inf if v["b3_deg"] else 0.0
    return v["b3_deg"] / v["b_t_deg"]


_MOVED = ("J_m", "k_t", "k_a", "source_vpk", "source_offset_v")
_DRIVEN = ("k_t", "k_a", "R_m", "source_vpk", "source_offset_v", "N_1")
_BY_CURRENT = ("k_t", "k_a", "bandwidth_hz", "source_vpk", "source_offset_v", "N_1")


def _frictions(driven: tuple[str, ...]) -> tuple[Range, Range]:
    return (
        Range(
            ("T_f_m", *driven), (0.0, 0.5), (0.0, 5.0), lambda v: v["T_f_m"] / _stall_torque(v),
            "it is {value} times the motor's torque at the highest source level of [limits]",
            remedy="friction holds the motor still at every level; raise limits.source_vpk",
        ),
        Range(
            ("T_f_L", "T_f_m", *driven), (0.0, 0.5), (0.0, 5.0), _friction,
            "friction of motor and load is {value} times the motor's torque at the highest source "
            "level of [limits]",
            remedy="friction holds the drive still at every level; raise limits.source_vpk",
        ),
    )  # fmt: skip


COMBINED = (
    Range(
        ("k_b", "k_t"), (0.7, 1.4), (0.25, 4.0), lambda v: v["k_b"] / v["k_t"],
        "{value} times k_t; in SI units both are equal in a DC motor",
        remedy="constants of AC motors depend on the convention (rms, phase to phase)",
    ),
    Range(
        ("L_a", "R_m"), (1e-7, 0.1), (1e-11, 1.0), lambda v: v["L_a"] / v["R_m"],
        "L_a/R_m, the electrical time constant, is {value} s", "s",
        "are inductance and resistance in each other's place?",
    ),
    Range(
        ("J_m", "k_t", "k_b", "R_m"), (1e-5, 10.0), (1e-8, 100.0),
        lambda v: v["J_m"] * v["R_m"] / (v["k_t"] * v["k_b"]),
        "J_m R_m/(k_t k_b), the mechanical time constant of the motor, is {value} s", "s",
    ),
    Range(
        ("J_L", "J_m", "N_1"), (1e-3, 100.0), (1e-7, 1e4),
        lambda v: v["J_L"] / _total(v) ** 2 / v["J_m"],
        "the load seen by the motor is {value} times J_m",
        remedy="see whether the inertias and the ratios are right",
    ),
    _part_at_motor("J_g1", "N_1"),
    _part_at_motor("J_s1", "N_1"),
    _part_at_motor("J_p2", "N_1"),
    _part_at_motor("J_g2", "N_1", "N"),
    Range(
        ("b3_deg", "b_t_deg"), (0.0, 0.98), (0.0, 1.0), _share_of_stage_3,
        "stage 3 has {value} of the total backlash",
        remedy="b3_deg is the play at the output with pinion 3 held, b_t_deg that with the motor "
        "held",
    ),
    Range(
        ("B_m", "J_m"), (0.0, 3e3), (0.0, 1e8), lambda v: v["B_m"] / v["J_m"],
        "B_m/J_m, the rate at which viscous friction stops the motor, is {value} 1/s", "1/s",
    ),
    *_frictions(_DRIVEN),
    *_frictions(_BY_CURRENT),
    Range(
        ("k_ts", "k_a", "k_b", "source_vpk"), (0.0, 2000.0), (0.0, 1e9),
        lambda v: v["k_a"] * v["k_ts"] / v["k_b"] * v["source_vpk"],
        "the tachometer gives {value} V at the highest source level of [limits]", "V",
    ),
    Range(
        ("filter_numerator", "filter_denominator"), (1e-3, 1e3), (1e-9, 1e9),
        lambda v: v["filter_numerator"] / v["filter_denominator"],
        "the filter's gain at low frequency is {value}",
        remedy="numerator and last coefficient of the denominator are usually equal",
    ),
    Range(
        ("filter_denominator", "start_hz"), (1.0, math.inf), (1e-3, math.inf),
        lambda v: v["corner_hz"] / v["start_hz"],
        "the filter's corner is {value} times limits.start_hz",
        remedy="coefficients are in rad/s: omega^2 = (2 pi f)^2",
    ),
    Range(
        ("filter_denominator",), (0.02, 20.0), (0.0, 1e6), lambda v: v["filter_damping"],
        "the filter's damping ratio is {value}",
        remedy="the coefficients are 1, 2 zeta omega and omega^2",
    ),
    Range(
        ("start_hz", "stop_hz"), (0.0, 0.9), (0.0, 0.999), lambda v: v["start_hz"] / v["stop_hz"],
        "it is {value} times limits.stop_hz",
        remedy="the limits leave no band for a sweep",
    ),
    Range(
        ("rate_hz", "stop_hz"), (4.0, math.inf), (2.0, math.inf), _samples_a_cycle,
        "it is {value} times limits.stop_hz",
        remedy="a clock shows nothing above half of its rate; lower limits.stop_hz",
    ),
    Range(
        ("bandwidth_hz", "stop_hz"), (0.5, math.inf), (0.01, math.inf),
        lambda v: v["bandwidth_hz"] / v["stop_hz"],
        "the current loop's bandwidth is {value} times limits.stop_hz",
    ),
    Range(
        ("low_pass_hz", "stop_hz"), (0.5, math.inf), (0.01, math.inf),
        lambda v: v["low_pass_hz"] / v["stop_hz"],
        "the sensor's upper corner is {value} times limits.stop_hz",
    ),
    Range(
        ("high_pass_hz", "start_hz"), (0.0, 1.0), (0.0, 100.0),
        lambda v: v["high_pass_hz"] / v["start_hz"],
        "the sensor's lower corner is {value} times limits.start_hz",
    ),
    Range(
        ("k_acc", "radius_m", *_MOVED), (2e-4, 50.0), (1e-7, 1e5),
        lambda v: v["k_acc"] * v["radius_m"] * _acceleration(v),
        "the accelerometer gives {value} V at the largest torque of the motor, with nothing else "
        "on its shaft", "V",
    ),
    Range(
        ("k_current", "k_a", "R_m", "source_vpk"), (1e-3, 50.0), (1e-6, 1e5),
        lambda v: v["k_current"] * v["k_a"] * v["source_vpk"] / v["R_m"],
        "the sensor gives {value} V at the current that limits.source_vpk drives through R_m", "V",
    ),
    Range(
        ("current_limit_a", "k_a", "source_vpk"), (0.2, math.inf), (0.0, math.inf),
        lambda v: v["current_limit_a"] / (v["k_a"] * v["source_vpk"] * v.get("fast_gain", 1.0)),
        "it is {value} times the current that limits.source_vpk asks for",
        remedy="the amplifier clips at most levels; lower limits.source_vpk, or see whether k_a is "
        "in A/V",
    ),
)  # fmt: skip
