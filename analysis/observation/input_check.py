"""Whether a response can be one of the unit, or looks like one that was written down wrongly.

Owns the test for each mistake of `analysis.observation.usual_mistakes`: the response is held
against a wide family of linear machines about the unit, as it is and with each mistake undone. It
is done before anything is simulated, within a second, and alters no response. What a cause of the
catalogue does is no mistake; only what is far outside is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.observation.excitation import excitation_doubt
from analysis.observation.linear_family import Family, draw_machines, neighbours
from analysis.observation.usual_mistakes import GAIN, MISTAKES, Curve, quantities
from analysis.resonance.samples import refuse_levels
from daq.errors import AnalysisError, InputError
from daq.frf import DB_PER_NEPER, FrequencyResponse, PointFlag
from sim.unit import Unit

__all__ = ["MISTAKES", "Finding", "check_input", "check_inputs", "doubted"]

Vector = NDArray[np.float64]

_NOT_OF_UNIT = 0.7
"""Distance from which on nothing of the family is near: noise has 0.8, and the furthest of 260
machines that hide causes 0.61."""

_LEVELS, _POINTS, _FEWEST = 2, 40, 8
"""Levels (the highest, where the motion is most like a linear one) and points of each that are
looked at, and points without which nothing is said."""

_MACHINES, _ROUNDS, _PER_ROUND, _BEST = 2000, 3, 500, 8
_SCALE = 0.45
"""Neper and rad that a nonlinear machine is off the nearest linear one."""

_GAINED = 0.08
"""How much nearer a response must be with a mistake undone; of true ones none gains 0.05."""

_TOLD = 0.3
"""How far behind another a mistake may be that a telltale speaks for."""

_CLOSE = 0.06
"""How far behind the likeliest another mistake may be to be named, too."""

_FLAT = 0.02
"""Neper by which the gain of any servo changes over a band at least."""

_LEAST_V = 2e-3
"""Output below which a point may be noise, V."""


@dataclass(frozen=True, slots=True)
class Finding:
    """What a response looks like.

    `mistake`: the name of a likely one (a key of `MISTAKES`), None where there is none;
    `foreign`: whether nothing makes it a response of the unit; `words`: for a person, empty where
    all is well; `distances`: of the response as it is and with each mistake undone, 0 to 1.
    """

    mistake: str | None
    foreign: bool
    words: str
    distances: Mapping[str, float]


def check_input(response: FrequencyResponse, unit: Unit) -> Finding:
    """Hold a response against what any machine near a unit can show.

    Parameters
    ----------
    response
        One level or more; phase may be missing.
    unit
        The unit that it is said to be of.

    Raises
    ------
    InputError
        If it has more source levels than any sweep.
    """
    refuse_levels(response)
    curves = _curves(response)
    if not curves or (unit.sensor is not None and unit.sensor.at == "load"):
        # The family is of what the motor shows.
        return Finding(None, False, "", {})
    if all(_is_constant(curve) for curve in curves):
        return Finding(None, True, _FOREIGN.format(unit=unit.name), {})
    search = _Search(Family(unit))
    distances: dict[str, float] = {}
    offsets: dict[str, float] = {}
    distances["as it is"], _ = search.nearest(curves, lambda c: c, GAIN)
    for name, mistake in MISTAKES.items():
        if mistake.needs_phase and any(curve.phase is None for curve in curves):
            continue
        if not all(map(mistake.possible, curves)):
            continue
        distances[name], offsets[name] = search.nearest(curves, mistake.undo, mistake.gain)
    told = [
        name
        for name in offsets
        if (sign := MISTAKES[name].telltale) is not None
        and all(map(sign, curves))
        and distances[name] < distances["as it is"]
    ]
    return _judged(distances, offsets, told, unit)


def check_inputs(
    responses: Sequence[FrequencyResponse],
    unit: Unit,
    as_is: bool = False,
    way_on: str = "; or take it as it stands with --as-is",
) -> list[str]:
    """Refuse responses that look like a mistake, or like nothing of a unit.

    Parameters
    ----------
    as_is
        Refuse nothing, say it instead.
    way_on
        How a person can have it taken all the same; the end of the error.

    Returns
    -------
    list
        What is to be said of them, each sentence once.

    Raises
    ------
    InputError
        If one is likely written down wrongly; says what to change. If one was not measured with a
        stepped sine.
    AnalysisError
        If one is no response of the unit.
    """
    said = []
    for one in responses:
        if doubt := excitation_doubt(one):
            if not as_is:
                raise InputError(doubt)
            said.append(doubt)
            continue
        found = check_input(one, unit)
        if found.mistake is not None and not as_is:
            raise InputError(f"{found.words}{way_on}")
        if found.foreign and not as_is:
            raise AnalysisError(f"{found.words}{way_on}")
        said += [found.words] if found.words else []
    return list(dict.fromkeys(said))


def doubted(estimate: Mapping[str, Any], said: Sequence[str]) -> dict[str, Any]:
    """The document of an estimate of a response that `check_inputs` has something to say of.

    What was said comes first of its warnings, and its numbers are in force nowhere.
    """
    if not said:
        return dict(estimate)
    warnings = [*said, *(text for text in estimate["warnings"] if text not in said)]
    return {**estimate, "warnings": warnings, "refuted": True}


_FOREIGN = (
    "this is no response of unit {unit}: nothing like that unit shows it, nor does any usual "
    "mistake make it one; see to the unit, the band and the wiring"
)


def _is_better(cured: float, given: float) -> bool:
    """Whether undoing a mistake brings a response clearly nearer than it is."""
    return given - cured > _GAINED and cured < _NOT_OF_UNIT


class _Search:
    """The nearest of many machines to curves; those of one band are computed once."""

    def __init__(self, family: Family) -> None:
        self._family = family
        self._machines = draw_machines(_MACHINES, np.random.default_rng(0))
        self._shown: dict[bytes, NDArray[np.complex128]] = {}

    def nearest(
        self, curves: Sequence[Curve], undo: Callable[[Curve], Curve], gain: float
    ) -> tuple[float, float]:
        """Mean distance of curves to the nearest machine of each, and of their gains, neper."""
        found = [self._nearest(undo(curve), gain) for curve in curves]
        distance, offset = np.mean(found, axis=0)
        return float(distance), float(offset)

    def _nearest(self, curve: Curve, gain: float) -> tuple[float, float]:
        rng = np.random.default_rng(0)
        key = curve.frequency_hz.tobytes()
        if key not in self._shown:
            self._shown[key] = self._family.responses(self._machines[0], curve.frequency_hz)
        logs, free = self._machines
        distance, offset = _distances(self._shown[key], curve, gain)
        for number in range(_ROUNDS + 1):
            best = np.argsort(distance)[:_BEST]
            logs, free, distance, offset = logs[best], free[best], distance[best], offset[best]
            if number == _ROUNDS:
                break
            near, near_free = neighbours(logs, free, 0.25 / 2**number, _PER_ROUND, rng)
            shown = self._family.responses(near, curve.frequency_hz)
            near_distance, near_offset = _distances(shown, curve, gain)
            logs, free = np.concatenate([logs, near]), np.concatenate([free, near_free])
            distance = np.concatenate([distance, near_distance])
            offset = np.concatenate([offset, near_offset])
        return float(distance[0]), float(offset[0])


def _distances(shown: NDArray[np.complex128], curve: Curve, gain: float) -> tuple[Vector, Vector]:
    """Distances (machines,) of a curve, 0 to 1, and by how much its gain is larger, neper.

    Geman's and McClure's: a point that is far off counts as one, however far.
    """
    off = curve.log_gain - shown.real
    offset = np.clip(np.median(off, axis=1), -gain, gain)
    square = ((off - offset[:, None]) / _SCALE) ** 2
    if curve.phase is not None:
        turn = (curve.phase - shown.imag + np.pi) % (2.0 * np.pi) - np.pi
        square += (turn / _SCALE) ** 2
    return np.mean(square / (1.0 + square), axis=1), offset


def _curves(response: FrequencyResponse) -> list[Curve]:
    """The highest levels with enough points, thinned; a level that is not known is one."""
    spoilt = (response.flags & (PointFlag.SPOILT | PointFlag.OVERLOAD)) != 0
    size = np.abs(response.gain)
    level = np.where(np.isfinite(response.source_vpk), response.source_vpk, 0.0)
    loud = (size * level > _LEAST_V) | (level == 0.0)
    usable = ~spoilt & np.isfinite(size) & (size > 0.0) & (response.frequency_hz > 0.0)
    found: list[Curve] = []
    for one in np.unique(level)[::-1]:
        rows = np.flatnonzero((level == one) & usable)
        heard = rows[loud[rows]]
        # Where friction holds the servo there is noise, and nothing wrong.
        if len(heard) < max(_FEWEST, len(rows) // 2):
            continue
        rows = heard
        rows = rows[np.argsort(response.frequency_hz[rows], kind="stable")]
        rows = rows[np.unique(np.linspace(0, len(rows) - 1, _POINTS).round().astype(int))]
        known = bool(np.all(response.phase_known[rows]))
        phase = np.angle(response.gain[rows]) if known else None
        found.append(Curve(response.frequency_hz[rows], np.log(size[rows]), phase))
        if len(found) == _LEVELS:
            break
    return found


def _is_constant(curve: Curve) -> bool:
    """Whether a curve shows nothing that moves: the same gain everywhere."""
    return bool(np.ptp(curve.log_gain) < _FLAT)


def _as_likely(
    distances: Mapping[str, float], offsets: Mapping[str, float], likely: str
) -> list[str]:
    """The mistake that comes next, where it explains nearly as well as the likeliest."""
    others = sorted((n for n in offsets if n != likely), key=lambda n: distances[n])
    better = [n for n in others if _is_better(distances[n], distances["as it is"])]
    return [n for n in better if distances[n] < distances[likely] + _CLOSE][:1]


def _factor(neper: float) -> str:
    decibels = neper * DB_PER_NEPER
    return f"{decibels:+.1f} dB (a factor of {np.exp(neper):.3g})"


def _judged(
    distances: Mapping[str, float],
    offsets: Mapping[str, float],
    told: Sequence[str],
    unit: Unit,
) -> Finding:
    given = distances["as it is"]
    likely = min(offsets, key=lambda name: distances[name], default="")
    for name in told:
        likely = name if distances[name] < distances[likely] + _TOLD else likely
    if likely and (likely in told or _is_better(distances[likely], given)):
        near = [] if likely in told else _as_likely(distances, offsets, likely)
        told_of = quantities("speed" if unit.sensor is None else unit.sensor.reads)
        words = [
            MISTAKES[n].words.format(factor=_factor(offsets[n]), **told_of) for n in (likely, *near)
        ]
        return Finding(likely, False, "; or ".join(words), distances)
    if given > _NOT_OF_UNIT:
        return Finding(None, True, _FOREIGN.format(unit=unit.name), distances)
    return Finding(None, False, "", distances)
