"""What a Bode plot draws: traces with errors and marks, made from points or responses.

Owns the record of a trace and how points become one. It draws nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from daq.frf import FrequencyResponse, PointFlag

if TYPE_CHECKING:
    from daq.store_records import StoredPoint

__all__ = [
    "FLAG_MARKS", "LEVEL_MARKS", "Prediction", "Trace", "continuous_phase", "legend",
    "traces_of_points", "traces_of_response", "traces_of_sessions",
]  # fmt: skip

LEVEL_MARKS = "\u25cf\u25a0\u25b2\u25c6\u25bc\u2605"
"""Marker of each source level in ascending order; the shape tells the level, not the colour."""

FLAG_MARKS: tuple[tuple[PointFlag, str, str], ...] = (
    (PointFlag.SPOILT, "?", "spoilt"),
    (PointFlag.OVERLOAD, "!", "overload"),
    (PointFlag.NOT_PERIODIC, "~", "not periodic"),
    (PointFlag.HALF_RANGE_MISSED, "-", "coarse"),
)
"""Marker of a point that carries a flag; the first that holds is shown."""

_WORTH_A_BAR_DB = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """One curve; arrays of shape (points,) in ascending frequency.

    Parameters
    ----------
    name
        For the legend.
    frequency_hz, gain_db, gain_std_db, phase_deg
        Phase wrapped to (-180, 180]; NaN where unknown.
    flags
        `PointFlag` bits.
    mark, colour
        Character of a clean point, and the number of its colour.
    reference
        Drawn behind the others as a line without marks.
    series
        What the legend says once in place of the names; empty: it says the name.
    """

    name: str
    frequency_hz: NDArray[np.float64]
    gain_db: NDArray[np.float64]
    gain_std_db: NDArray[np.float64]
    phase_deg: NDArray[np.float64]
    flags: NDArray[np.int64]
    mark: str
    colour: int
    reference: bool = False
    series: str = ""

    @property
    def marks(self) -> list[str]:
        """The character of each point."""
        return [flag_mark(int(flags)) or self.mark for flags in self.flags]

    @property
    def runs(self) -> list[slice]:
        """Stretches of usable neighbours: a line must not bridge a spoilt point."""
        edges = np.flatnonzero(np.diff(np.concatenate(([0], self.usable.astype(int), [0]))))
        return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Which points are no spoilt reading."""
        return ((self.flags & PointFlag.SPOILT) == 0) & np.isfinite(self.gain_db)

    @property
    def bars_db(self) -> NDArray[np.float64]:
        """Half lengths of the error bars, dB; 0 where unknown or too small to see."""
        std = np.where(np.isfinite(self.gain_std_db), self.gain_std_db, 0.0)
        return np.where(std > _WORTH_A_BAR_DB, std, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Prediction:
    """What a model says of one source level; arrays of shape (points,), ascending frequency.

    `gain_band_db`, `phase_band_deg`: low and high edge of the band about it, (2, points).
    """

    name: str
    frequency_hz: NDArray[np.float64]
    gain_db: NDArray[np.float64]
    gain_band_db: NDArray[np.float64]
    phase_deg: NDArray[np.float64]
    phase_band_deg: NDArray[np.float64]
    colour: int


def continuous_phase(phases_deg: Sequence[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    """Phases without jumps of 360 degrees, all on the same turn as the first.

    Parameters
    ----------
    phases_deg
        Phases over ascending frequency, each (points,); NaN where unknown.
    """
    found: list[NDArray[np.float64]] = []
    level = None
    for phase in phases_deg:
        smooth = np.array(phase, dtype=float)
        known = np.isfinite(smooth)
        if known.any():
            smooth[known] = np.unwrap(smooth[known], period=360.0)
            middle = float(np.median(smooth[known]))
            if level is None:
                # The median within a turn that ends at 0: a lag reads as a lag.
                level = middle - 360.0 * np.ceil(middle / 360.0 - 0.25)
            smooth -= 360.0 * np.round((middle - level) / 360.0)
        found.append(smooth)
    return found


def flag_mark(flags: int) -> str:
    """The character that flags call for; empty for a clean point."""
    return next((mark for flag, mark, _ in FLAG_MARKS if flags & flag), "")


def traces_of_response(response: FrequencyResponse, reference: str = "") -> list[Trace]:
    """A trace per source level; as references under a name, if one is given."""
    traces = []
    for index, level in enumerate(response.levels_vpk.tolist()):
        part = response.at_level(level)
        traces.append(
            Trace(
                f"{reference} {level:g} V".strip(),
                part.frequency_hz,
                part.gain_db,
                part.gain_std_db,
                part.phase_deg,
                part.flags,
                LEVEL_MARKS[index % len(LEVEL_MARKS)],
                index,
                bool(reference),
            )
        )
    return traces


def traces_of_sessions(responses: Mapping[int, FrequencyResponse]) -> list[Trace]:
    """Traces of several measurements, by number: a mark and a colour each, for all its levels.

    As many can be told apart as there are `LEVEL_MARKS`.
    """
    return [
        replace(
            trace, name=f"#{number} {trace.name}", series=f"#{number}",
            mark=LEVEL_MARKS[index % len(LEVEL_MARKS)], colour=index,
        )
        for index, (number, response) in enumerate(responses.items())
        for trace in traces_of_response(response)
    ]  # fmt: skip


def traces_of_points(points: Iterable[StoredPoint], levels_vpk: Sequence[float]) -> list[Trace]:
    """A trace per source level of a plan, of the points that are there so far."""
    rows: dict[float, list[StoredPoint]] = {level: [] for level in sorted(levels_vpk)}
    for point in points:
        rows.setdefault(point.source_vpk, []).append(point)
    traces = []
    for index, (level, stored) in enumerate(rows.items()):
        if stored:
            traces.append(_trace(index, level, sorted(stored, key=lambda p: p.point.frequency_hz)))
    return traces


def _trace(index: int, level: float, stored: Sequence[StoredPoint]) -> Trace:
    points = [entry.point for entry in stored]
    gain = np.array([point.gain for point in points], dtype=complex)
    with np.errstate(divide="ignore"):
        gain_db = 20.0 * np.log10(np.abs(gain))
    return Trace(
        f"{level:g} V",
        np.array([point.frequency_hz for point in points]),
        gain_db,
        np.array([np.nan if p.gain_std_db is None else p.gain_std_db for p in points]),
        np.degrees(np.angle(gain)),
        np.array([int(point.flags) for point in points], dtype=np.int64),
        LEVEL_MARKS[index % len(LEVEL_MARKS)],
        index,
    )


def legend(traces: Sequence[Trace], predictions: Sequence[Prediction] = ()) -> str:
    """What the marks mean, in words; flags only where there are such points."""
    told = [f"{one.mark} {one.series or one.name}" for one in traces if not one.reference]
    parts = list(dict.fromkeys(told))
    parts += [f"line {trace.name}" for trace in traces if trace.reference]
    parts += dict.fromkeys(f"band {one.name}" for one in predictions)
    seen = {mark for trace in traces if not trace.reference for mark in trace.marks}
    parts += [f"{mark} {words}" for _, mark, words in FLAG_MARKS if mark in seen]
    return "  ".join(parts)
