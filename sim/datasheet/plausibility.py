"""Values of a unit file that cannot be, or that are unusual, before anything is simulated.

Owns the search for values outside their ranges (`sim.datasheet.ranges`), and for a catalogue unit
that explains one. It changes no value, and simulates no motion.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from sim.datasheet.catalogue_units import SENSOR_GAINS, shown_symbol, unit_in_files, units_of
from sim.datasheet.chain import natural_frequencies
from sim.datasheet.ranges import COMBINED, KEYS, SINGLES, Range, Values
from sim.datasheet.stability import MARGIN, find_unstable

if TYPE_CHECKING:
    from sim.drive.unit import Unit

__all__ = ["find_impossible", "find_unusual", "impossible_among", "unusual_among"]


def find_impossible(unit: Unit) -> list[str]:
    """What a unit's values cannot be: key, value, what is plausible, and the likely slip each."""
    values = _values(unit)
    # What cannot be says more than what follows from it.
    return list(impossible_among(values)) or _resonances(unit, beyond=20.0) or find_unstable(unit)


def find_unusual(unit: Unit) -> list[str]:
    """What is unusual in a unit's values and can be all the same, in the same form."""
    found = list(unusual_among(_values(unit))) or _resonances(unit, beyond=1.0)
    return [*found, *find_unstable(unit, MARGIN), *_misplaced_delay(unit), *_insensitive(unit)]


def impossible_among(values: Values) -> Iterator[str]:
    """The same of values by symbol, of which some may be missing."""
    return _beyond(values, lambda given: given.possible)


def unusual_among(values: Values) -> Iterator[str]:
    """The same."""
    return _beyond(values, lambda given: given.usual)


def _beyond(values: Values, bounds: Callable[[Range], tuple[float, float]]) -> Iterator[str]:
    """A sentence for each quantity outside its bounds, but one only for each suspected value."""
    told: set[str] = set()
    for given in _checks(values):
        if _is_within(given.value(values), bounds(given)) or told.intersection(given.needs):
            continue
        told.add(given.needs[0])
        told.update(symbol for symbol, _, _ in _slips(given, values))
        yield _sentence(given, values)


def _checks(values: Values) -> Iterator[Range]:
    for given in (*SINGLES, *COMBINED):
        if all(symbol in values for symbol in given.needs):
            yield given


def _is_within(value: float, bounds: tuple[float, float]) -> bool:
    return bounds[0] <= value <= bounds[1]


def _sentence(given: Range, values: Values) -> str:
    symbol = given.needs[0]
    number = f"{values[symbol]:.4g}"
    in_file = unit_in_files(symbol)
    quantity = f"{given.value(values):.3g}"
    what = "" if not given.means else f": {given.means.format(value=quantity)}"
    plausible = _range_text(given)
    slips = [
        f"if {shown_symbol(name)} is in {written}, give {converted:.4g}"
        for name, written, converted in _slips(given, values)[:2]
    ]
    remedy = given.remedy or ("" if slips else "see whether it is in SI units")
    look = "; otherwise ".join(part for part in (", or ".join(slips), remedy) if part)
    return (
        f"{KEYS[symbol]} {number} {in_file}".rstrip() + f"{what} (plausible: {plausible}); {look}"
    )


def _range_text(given: Range) -> str:
    least, most = given.usual
    unit = f" {given.unit}" if given.unit else ""
    if least == 0.0:
        return f"at most {most:g}{unit}"
    if math.isinf(most):
        return f"at least {least:g}{unit}"
    return f"{least:g} to {most:g}{unit}"


def _slips(given: Range, values: Values) -> list[tuple[str, str, float]]:
    """Symbol, catalogue unit and converted value, for each that makes the quantity usual.

    Only those that leave the fewest other quantities unusual. The first is the likeliest.
    """
    found: dict[tuple[str, float], tuple[int, int, float, int, str, str, float]] = {}
    singles = {one.needs[0]: one.usual for one in SINGLES}
    for place, symbol in enumerate(given.needs):
        for rank, unit in enumerate(units_of(symbol)[1:]):
            if values[symbol] == 0.0:
                continue
            converted = unit.convert(values[symbol])
            if 0.4 < converted / values[symbol] < 2.5:
                continue  # no slip of units explains so little
            changed = {**values, symbol: converted}
            quantity = given.value(changed)
            if _is_within(converted, singles[symbol]) and _is_within(quantity, given.usual):
                left = sum(not _is_within(one.value(changed), one.usual) for one in _checks(values))
                distance = _distance(quantity, given.usual)
                entry = (left, place, distance, rank, symbol, unit.name, converted)
                found.setdefault((symbol, converted), entry)
    fewest = min((entry[0] for entry in found.values()), default=0)
    return [entry[4:] for entry in sorted(found.values()) if entry[0] == fewest]


def _distance(value: float, bounds: tuple[float, float]) -> float:
    if bounds[0] <= 0.0 or value <= 0.0 or math.isinf(bounds[1]):
        return 0.0
    return abs(math.log(value / math.sqrt(bounds[0] * bounds[1])))


def _values(unit: Unit) -> dict[str, float]:
    limits, known = unit.limits, unit.parameters
    if unit.sensor is not None and unit.sensor.gain_unit in SENSOR_GAINS:
        known[SENSOR_GAINS[unit.sensor.gain_unit]] = known.pop("k_ts")
    return (
        known
        | _filter_values(unit)
        | _loop_values(unit)
        | {
            "source_vpk": limits.source_vpk,
            "source_offset_v": limits.source_offset_v,
            "start_hz": limits.start_hz,
            "stop_hz": limits.stop_hz,
        }
    )


def _insensitive(unit: Unit) -> list[str]:
    """A sensor that hardly shows what is looked for."""
    if unit.sensor is None or unit.sensor.kind != "current" or unit.stages == 1:
        return []
    return [
        "sensor.kind current: R_m limits it, and the contribution ratio shows near RF alone: "
        "estimates may be off by 0.3; read a speed or acceleration to tell the stages apart"
    ]


def _misplaced_delay(unit: Unit) -> list[str]:
    """A delay that the loop does not have, where nobody said what it has."""
    if unit.loop is None or unit.sensor is None or not unit.sensor.delay_s:
        return []
    if unit.loop.computing_s is not None:
        return []
    return [
        f"sensor.delay_s {unit.sensor.delay_s:g} s is outside the loop; give what the controller "
        "waits from reading to command as loop.computing_s, or 0"
    ]


def _loop_values(unit: Unit) -> dict[str, float]:
    if unit.loop is None:
        return {}
    limits, gain_at = unit.limits, unit.loop.gain_at
    return {"slow_gain": gain_at(limits.start_hz), "fast_gain": gain_at(limits.stop_hz)}


def _filter_values(unit: Unit) -> dict[str, float]:
    if unit.electronics.filter_denominator is None:
        return {}
    first, second, third = unit.electronics.filter_denominator
    omega = math.sqrt(third / first)
    return {
        "filter_denominator": third,
        "corner_hz": omega / (2.0 * math.pi),
        "filter_damping": second / (2.0 * first * omega),
    }


def _resonances(unit: Unit, beyond: float) -> list[str]:
    """Linear ARF and RF outside the limits by more than a factor; backlash lowers both."""
    arf, rf = _arf_and_rf(unit)
    limits = unit.limits
    if arf <= limits.stop_hz * beyond and rf * beyond >= limits.start_hz:
        return []
    side, key = ("above", "stop_hz") if arf > limits.stop_hz else ("below", "start_hz")
    return [
        f"limits.{key} {getattr(limits, key):.4g} Hz: the linear ARF {arf:.4g} Hz and RF "
        f"{rf:.4g} Hz are {side} it, and no allowed sweep shows them; {_resonance_slip(unit)}"
    ]


def _resonance_slip(unit: Unit) -> str:
    values = unit.parameters
    for symbol in ("k_s1", "J_L", "k_g1", "k_2"):
        for other in units_of(symbol)[1:] if symbol in values else ():
            converted = other.convert(values[symbol])
            arf, rf = _arf_and_rf(unit.with_parameters(**{symbol: converted}))
            if arf >= 2.0 * unit.limits.start_hz and rf <= unit.limits.stop_hz / 2.0:
                return f"if {symbol} is in {other.name}, give {converted:.4g}"
    return "see whether stiffnesses (N.m/rad), inertias (kg.m^2) and the limits are right"


def _arf_and_rf(unit: Unit) -> tuple[float, float]:
    found = natural_frequencies(unit)
    return found.anti_resonances_hz[0], found.resonances_hz[0]
