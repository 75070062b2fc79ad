"""A frequency response out of the functions that another program put into a file.

Owns which functions are taken, what their axes say, and what is refused because they do not say
it. The functions are those of `daq.formats.foreign.functions`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError
from daq.formats.foreign.columns import Columns
from daq.formats.foreign.functions import COHERENCE, RESPONSE, Axis, Function
from daq.formats.foreign.quantities import checked_quantity, response_of
from daq.formats.foreign.unit_words import frequency_in, gain_in, level_in, phase_in
from daq.formats.reading import Reading, remarked
from daq.formats.record import ROW_LIMIT
from daq.frf import FrequencyResponse

__all__ = ["foreign_response"]

_UNKNOWN, _FREQUENCY, _RPM = 0, 18, 19
_KINDS = {
    0: "general", 1: "time response", 2: "auto spectrum", 3: "cross spectrum",
    4: "frequency response", 6: "coherence", 9: "spectral density", 12: "spectrum",
}  # fmt: skip
_AXES = {8: "displacement", 9: "force", 11: "velocity", 12: "acceleration", 13: "force",
         15: "pressure", 17: "time", 18: "frequency", 19: "rpm", 20: "order"}  # fmt: skip
_LISTED = 12
_SOURCE_FACTOR = {"vpk": 1.0, "vrms": math.sqrt(2.0), "vpp": 0.5}


def foreign_response(
    functions: Sequence[Function], reading: Reading, path: Path
) -> FrequencyResponse:
    """The response that is meant, from the functions of a file.

    Raises
    ------
    FileFormatError
        If there is none, several between which nothing tells, or one whose axes cannot be taken
        for frequency and gain; says what is there.
    """
    if reading.columns:
        return _as_told(functions, reading, path)
    responses = [one for one in functions if one.kind == RESPONSE]
    if not responses:
        found = f"; it holds {_listed(functions)}" if functions else ""
        raise FileFormatError(f"{path}: holds no frequency response function{found}")
    chosen = _chosen(responses, functions, reading, path)
    if sum(len(one.x) for one in chosen) > ROW_LIMIT:
        raise FileFormatError(f"{path}: holds more than {ROW_LIMIT} points")
    held, remarks = _columns(chosen, functions, path)
    return _response(chosen, held, remarks, reading, path)


def _chosen(
    responses: Sequence[Function], functions: Sequence[Function], reading: Reading, path: Path
) -> Sequence[Function]:
    """One response function, or one at each of several source levels."""
    if reading.function is not None:
        responses = [one for one in responses if _is_called(one, reading.function)]
        if not responses:
            raise FileFormatError(
                f"{path}: no frequency response function is called {reading.function[:40]!r}; "
                f"it holds {_listed(functions)}"
            )
    levels = [_level(one)[0] for one in responses]
    points = {one.degrees_of_freedom for one in responses}
    told_apart = len(points) == 1 and not np.any(np.isnan(levels))
    if len(responses) > 1 and not (told_apart and len(set(levels)) == len(levels)):
        raise FileFormatError(
            f"{path}: holds {len(responses)} frequency response functions that no source level "
            f"tells apart; choose by --function NUMBER, NAME or DOF: {_listed(responses)}"
        )
    return responses


def _is_called(one: Function, name: str) -> bool:
    """Whether a function has a number, a name or degrees of freedom."""
    plain = " ".join(name.split()).lower()
    if plain.isdecimal():
        return one.number == int(plain)
    names = [one.degrees_of_freedom, *one.names, *one.titles, "/".join(one.names)]
    known = {" ".join(text.split()).lower() for text in names if text not in ("", "NONE", "/")}
    return plain in known


def _listed(functions: Sequence[Function]) -> str:
    """Functions in a few words each."""
    told = [
        f"{one.number}: {_KINDS.get(one.kind, f'type {one.kind}')} {one.degrees_of_freedom}"
        + (f" {'/'.join(one.names)}" if any(one.names) else "")
        + (f" {one.title[:30]!r}" if one.title else "")
        + f", {len(one.x)} points"
        for one in functions[:_LISTED]
    ]
    rest = len(functions) - len(told)
    return "; ".join(told) + (f"; and {rest} more" if rest > 0 else "")


def _as_told(functions: Sequence[Function], reading: Reading, path: Path) -> FrequencyResponse:
    """Functions as columns that `reading` names: each a function's number, name or DOF."""
    held: dict[str, NDArray[Any]] = {}
    taken: list[Function] = []
    for name, where in reading.columns:
        checked_quantity(name)
        if where == "abscissa" and name.startswith("frequency"):
            continue
        found = [one for one in functions if _is_called(one, where)]
        if len(found) != 1:
            how_many = "no function is" if not found else f"{len(found)} functions are"
            raise FileFormatError(
                f"{path}: {how_many} called {where[:40]!r}; it holds {_listed(functions)}"
            )
        held[name] = found[0].values
        taken += found
    if not taken:
        raise FileFormatError(f"{path}: --column names no function; it holds {_listed(functions)}")
    first = taken[0]
    for other in taken:
        if len(other.x) != len(first.x) or not np.allclose(other.x, first.x, rtol=1e-6):
            raise FileFormatError(
                f"{path}: functions {first.number} and {other.number} have other frequencies"
            )
    told = [name for name, where in reading.columns if where == "abscissa"]
    held[told[0] if told else _abscissa(first, path)] = first.x
    return _response([first], held, [], reading, path)


def _columns(
    chosen: Sequence[Function], functions: Sequence[Function], path: Path
) -> tuple[dict[str, NDArray[Any]], list[str]]:
    """What response functions hold by quantities, and what is to be remarked."""
    names = {(_abscissa(one, path), _ordinate(one, path)) for one in chosen}
    if len(names) > 1:
        raise FileFormatError(f"{path}: its functions have different units; choose by --function")
    abscissa, ordinate = names.pop()
    levels, remarks = [], _axes_remarks(chosen[0])
    for one in chosen:
        level, remark = _level(one)
        levels.append(level)
        remarks += [remark] if remark and remark not in remarks else []
    held: dict[str, NDArray[Any]] = {
        abscissa: np.concatenate([one.x for one in chosen]),
        ordinate: np.concatenate([one.values for one in chosen]),
        "source_vpk": np.repeat(levels, [len(one.x) for one in chosen]),
    }
    coherence = [_coherence_of(one, functions) for one in chosen]
    if all(found is not None for found in coherence):
        held["coherence"] = np.concatenate([np.real(f.values) for f in coherence if f is not None])
    return held, remarks


def _abscissa(one: Function, path: Path) -> str:
    """The quantity of the abscissa."""
    axis = one.abscissa
    place = f"{path}: the abscissa of function {one.number}"
    if axis.kind not in (_UNKNOWN, 1, _FREQUENCY, _RPM):
        what = _AXES.get(axis.kind, f"quantity {axis.kind}")
        raise FileFormatError(f"{place} is not a frequency but {what}")
    if axis.unit:
        found = frequency_in(axis.unit)
        if found is None:
            raise FileFormatError(
                f"{place} is in {axis.unit!r}, which is no known unit of frequency; say which it "
                f"is: --column frequency_hz=abscissa --column gain_complex={one.number}"
            )
        return found
    return "frequency_rpm" if axis.kind == _RPM else "frequency_hz"


def _ordinate(one: Function, path: Path) -> str:
    """The quantity of the ordinate of a response function."""
    unit, place = one.ordinate.unit, f"{path}: function {one.number}"
    if np.iscomplexobj(one.values):
        if gain_in(unit) == "gain_db" or phase_in(unit):
            raise FileFormatError(
                f"{place} is complex and in {unit!r}, which is no complex response; save it as "
                "linear real and imaginary parts"
            )
        return "gain_complex"
    if phase_in(unit):
        raise FileFormatError(
            f"{place} is a phase in {unit!r}; give magnitude and phase: --column gain_db=NUMBER "
            f"--column {phase_in(unit)}={one.number}"
        )
    if (quantity := gain_in(unit)) is not None:
        return quantity
    n = one.number
    linear = "" if np.any(one.values < 0.0) else f"linear magnitudes, --column gain={n}; for "
    raise FileFormatError(
        f"{place} is real, and no unit says what its values are; for {linear}"
        f"decibels, give --column gain_db={n}; for the real part, give both: --column "
        f"gain_real={n} --column gain_imag=NUMBER"
    )


def _level(one: Function) -> tuple[float, str]:
    """Source level on the third axis, V peak, NaN where there is none; and what to remark."""
    value, axis = one.third_value, one.third
    if value == 0.0:
        return math.nan, ""
    if axis.kind in (_UNKNOWN, 1) and (kind := level_in(axis.unit)) is not None and value > 0.0:
        return _SOURCE_FACTOR[kind] * value, ""
    what = " ".join(word for word in (axis.label, axis.unit) if word)
    what = what or _AXES.get(axis.kind, "no name")
    return math.nan, (
        f"the third axis ({what}, {value:g}) is not taken for a source level, as it is not in V "
        "peak, V rms or V peak to peak; give --level"
    )


def _axes_remarks(one: Function) -> list[str]:
    top, below = _axis_words(one.ordinate), _axis_words(one.denominator)
    if not top and not below:
        return []
    return [f"the function is {top or 'a value'} over {below or 'a value'}, taken as V_o/V_i"]


def _axis_words(axis: Axis) -> str:
    """What an axis says that it holds, where that is no voltage."""
    words = " ".join(word for word in (axis.label, axis.unit) if word)
    volts = axis.unit.strip().lower() in ("", "v", "v/v", "volt", "volts", "db")
    if axis.kind in (_UNKNOWN, 1) and volts:
        return ""
    return words or _AXES.get(axis.kind, "")


def _coherence_of(one: Function, functions: Sequence[Function]) -> Function | None:
    """The coherence that stands beside a response function, if one does."""
    for other in functions:
        if (
            other.kind == COHERENCE
            and other.degrees_of_freedom == one.degrees_of_freedom
            and len(other.x) == len(one.x)
            and np.allclose(other.x, one.x, rtol=1e-6)
        ):
            return other
    return None


def _response(
    chosen: Sequence[Function],
    held: Mapping[str, NDArray[Any]],
    remarks: Sequence[str],
    reading: Reading,
    path: Path,
) -> FrequencyResponse:
    title = chosen[0].title
    columns = Columns(
        path,
        held,
        lambda row: f"point {row + 1}",
        {"title": title, "degrees_of_freedom": chosen[0].degrees_of_freedom},
    )
    response = response_of(columns, reading)
    if reading.level_vpk is not None:
        remarks = [text for text in remarks if not text.startswith("the third axis")]
    return remarked(response, *remarks) if remarks else response
