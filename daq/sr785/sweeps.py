"""Running sweeps on the SR785 and reading points out of them, as early as they are there for sure.

Owns starting, waiting, reading and the proof that nobody interfered. It expects an instrument that
is set up; level and switch are set here, last of all. What sweeps there are is `plan`'s matter.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from daq.analyser import SweepPoint
from daq.driving.driven import Guard
from daq.driving.variance import gain_standard_error
from daq.errors import BenchTimeout, InstrumentError, MeasurementError
from daq.frf import DB_PER_NEPER, PointFlag
from daq.sr785.dialogue import Dialogue
from daq.sr785.plan import Grid, Repeats, cycles_at, duration_s
from daq.sr785.settings import (
    INTEGRATE,
    POINTS,
    SETTLE,
    SPACING,
    START,
    STOP,
    display_settings,
    level_command,
    offset_command,
    variance_settings,
)
from daq.sr785.setup import SetUp, Timing, apply_all
from daq.sr785.status import SWEPT
from daq.sr785.traces import read_axis, read_bin, read_length, read_trace, response_of
from daq.sr785.watching import Watching
from daq.transports.base import Deadline

__all__ = ["Knowledge", "measure", "quiet"]

_FIRST_PAUSE_S = 0.0005
_LONGEST_PAUSE_S = 0.25
_WORD_EVERY = 12
"""Polls between two looks at the display word itself: a power failure takes its enables away."""
_LOOK_EVERY = 4
"""Polls between two looks at the data of a running sweep."""
_MOST_NEW = 20
"""Points read in one look, so that none waits for long behind others."""
_HELD_BACK = 1
"""Newest points not believed while a sweep runs."""
_OFF_AXIS = 0.25
"""Part of a step by which the axis may differ from what was asked for."""
_STANDS = 1e-4
"""How well what was read early must agree with what stands there in the end."""


@dataclass(slots=True)
class Knowledge:
    """What was learned of this instrument."""

    data_survive: bool | None = None
    """Whether a display keeps its data when its measurement is changed; None while unknown."""
    axes: dict[tuple[float, float, int, bool], NDArray[np.float64]] = field(default_factory=dict)
    """Axes that were read, by start, stop, points and spacing."""


def measure(
    dialogue: Dialogue,
    setup: SetUp,
    timing: Timing,
    knowledge: Knowledge,
    sweeps: Sequence[Grid],
    guard: Guard,
) -> Iterator[SweepPoint]:
    """Run sweeps one after the other and yield what was asked for in the order of driving."""
    for grid in sweeps:
        run = _Run(dialogue, setup, timing, knowledge, grid, guard)
        yield from run.points()


def quiet(dialogue: Dialogue) -> None:
    """Switch off, stop, level and offset to 0; nothing is proven here."""
    for line in ("SRCO 0", "PAUS", level_command("SSAM", 0.0), offset_command(0.0)):
        dialogue.send(line)


@dataclass(slots=True)
class _Row:
    """One bin as it was read while the sweep ran."""

    response: complex
    flags: PointFlag


class _Run:
    """One sweep."""

    def __init__(
        self,
        dialogue: Dialogue,
        setup: SetUp,
        timing: Timing,
        knowledge: Knowledge,
        grid: Grid,
        guard: Guard,
    ) -> None:
        self._dialogue, self._setup, self._timing = dialogue, setup, timing
        self._knowledge, self._grid, self._guard = knowledge, grid, guard
        self._told: dict[int, _Row] = {}
        """Rows that were yielded while the sweep ran."""
        self._next = 0
        self._early = False
        self._inputs = 0
        """Input words since the last points were yielded."""
        table = dict(setup.table) | {
            SETTLE: grid.settle_cycles,
            INTEGRATE: grid.integrate_cycles,
            START: grid.start_hz,
            STOP: grid.stop_hz,
            SPACING: int(grid.is_log),
            POINTS: grid.points,
        }
        self._table = list(table.items())
        self._watching = Watching(dialogue, setup, self._table)

    def points(self) -> Iterator[SweepPoint]:
        """Drive the sweep and yield its points."""
        dialogue, grid = self._dialogue, self._grid
        changed = (START, STOP, SPACING, POINTS, SETTLE, INTEGRATE)
        apply_all(dialogue, [(each, value) for each, value in self._table if each in changed])
        read_length(dialogue, grid.points)
        self._find_rows()
        self._start()
        for polls in self._until_swept():
            self._guard()
            if self._early and polls % _LOOK_EVERY == 0:
                yield from self._new_points()
        yield from self._finish()

    # ------------------------------------------------------------ set-up and start

    def _find_rows(self) -> None:
        """Which bin holds which point: the axis tells, whatever order it may have."""
        grid, known = self._grid, self._knowledge.axes
        key = grid.start_hz, grid.stop_hz, grid.points, grid.is_log
        every = np.arange(grid.points)
        if isinstance(grid, Repeats):
            ends = read_axis(self._dialogue, np.array([0, grid.points - 1]))
            axis = np.linspace(ends[0], ends[1], grid.points)
        elif key in known:
            axis = known[key]
            some = np.array([0, grid.points // 2, grid.points - 1])
            if not np.allclose(read_axis(self._dialogue, some), axis[some], rtol=1e-6, atol=0):
                raise InstrumentError("the axis of the sweep is not the one of before")
        else:
            axis = known[key] = read_axis(self._dialogue, every)
        due = grid.frequencies_hz
        rows = np.array([int(np.argmin(np.abs(axis - hz))) for hz in due])
        step_hz = np.abs(np.diff(due)).min()
        off_hz = np.abs(axis[rows] - due)
        if len(set(rows.tolist())) < grid.points or np.any(off_hz > _OFF_AXIS * step_hz):
            worst = int(np.argmax(off_hz))
            raise InstrumentError(
                f"the sweep has a point at {axis[rows[worst]]:.7g} Hz where {due[worst]:.7g} Hz "
                "was asked for; take fewer points, or a wider band"
            )
        self._rows, self._axis = rows, axis

    def _start(self) -> None:
        """Clear the events of earlier; then offset, level, switch and start, each allowed."""
        dialogue, settings = self._dialogue, self._setup.settings
        dialogue.check("sweep set-up")
        dialogue.command("*CLS")
        dialogue.key_pressed = False
        for line in ("INPS?", "INST?", "DSPS?"):
            dialogue.ask_integer(line)
        # The last moments to learn that somebody else has the bench by now.
        self._guard()
        dialogue.command(offset_command(settings.dc_offset_v))
        self._guard()
        dialogue.command(level_command("SSAM", settings.source_vpk))
        self._watching.level()
        self._watching.group()
        dialogue.check("source level")
        self._guard()
        dialogue.command("SRCO 1")
        self._guard()
        dialogue.command("STRT")
        self._watching.drive()
        # Where the data of an earlier sweep stand until they are written over, nothing can be
        # told to be new before the end. A run of repeats is short and is read in the end.
        last = int(self._rows[-1])
        empty = np.isnan(self._response(last))
        self._early = bool(
            empty and self._knowledge.data_survive and not isinstance(self._grid, Repeats)
        )

    def _until_swept(self) -> Iterator[int]:
        """Wait for both displays to have swept, yielding after each fruitless look."""
        dialogue, due = self._dialogue, SWEPT
        bound_s = (
            self._timing.overhead_s
            + self._timing.point_s * self._grid.points
            + self._timing.margin * duration_s(self._grid, self._setup.settings)
        )
        deadline, pause_s, polls = Deadline.after(bound_s), _FIRST_PAUSE_S, 0
        while due:
            waits = dialogue.events_wait()
            if waits is None or waits or polls % _WORD_EVERY == _WORD_EVERY - 1:
                due &= ~dialogue.ask_integer("DSPS?")
                dialogue.check("sweep")
            if not due:
                return
            polls += 1
            if polls % _LOOK_EVERY == 0 or pause_s >= _LONGEST_PAUSE_S:
                self._watching.state()
            if deadline.expired:
                raise dialogue.failure(
                    BenchTimeout(f"sweep: its end was not reported within {bound_s:.3g} s")
                )
            yield polls
            dialogue.pause(pause_s)
            pause_s = min(1.5 * pause_s, _LONGEST_PAUSE_S)

    # ------------------------------------------------------------ reading

    def _response(self, row: int) -> complex:
        real, imaginary = (read_bin(self._dialogue, display, row) for display in (0, 1))
        return complex(response_of(np.array([real]), np.array([imaginary]))[0])

    def _new_points(self) -> Iterator[SweepPoint]:
        """Points that stand on the display and were not yielded yet."""
        found: list[tuple[int, complex]] = []
        left = self._grid.points - 1 - self._next
        while len(found) < min(left, _MOST_NEW):
            row = int(self._rows[self._next + len(found)])
            response = self._response(row)
            if np.isnan(response):
                break
            found.append((row, response))
        # Read after the bins: an overload of the next point may count for these, none is lost.
        seen = self._watching.inputs()
        self._watching.readings()
        sure = found[: len(found) - _HELD_BACK]
        if not sure:
            self._inputs |= seen
            return
        variances = self._variances([row for row, _ in sure])
        flags, self._inputs = self._watching.flags(seen | self._inputs), seen
        for (row, response), pair in zip(sure, variances, strict=True):
            self._told[row] = _Row(response, flags)
            place, self._next = self._next, self._next + 1
            if self._is_asked(place):
                yield self._point(row, response, pair, flags)

    def _variances(self, rows: Sequence[int]) -> list[tuple[float, float]]:
        """Normalised variances of both channels at some bins, which keep their data."""
        with_variances = variance_settings(self._setup.numbers)
        for setting, value in with_variances:
            self._dialogue.command(setting.command(value))
        found = [
            (read_bin(self._dialogue, 0, row), read_bin(self._dialogue, 1, row)) for row in rows
        ]
        self._show_response()
        return found

    def _show_response(self) -> None:
        for setting, value in display_settings(self._setup.numbers):
            self._dialogue.command(setting.command(value))

    def _finish(self) -> Iterator[SweepPoint]:
        """Read everything as it stands in the end, compare, and yield what is left."""
        dialogue, grid = self._dialogue, self._grid
        dialogue.command("SRCO 0")
        flags = self._watching.flags(self._watching.inputs() | self._inputs)
        parts = [read_trace(dialogue, display, grid.points) for display in (0, 1)]
        response = response_of(parts[0], parts[1])
        dialogue.check("sweep")
        self._watching.keys()
        self._watching.readings()
        for row, early in self._told.items():
            if not abs(response[row] - early.response) <= _STANDS * abs(early.response):
                raise MeasurementError(
                    f"the point at {self._axis[row]:.7g} Hz read {early.response:.5g} while the "
                    f"sweep ran and {complex(response[row]):.5g} after it; its readings are not "
                    "to be trusted, measure it again"
                )
        variances = self._final_variances(response)
        if isinstance(grid, Repeats):
            yield self._repeated(response, flags)
            return
        for place in range(self._next, grid.points):
            row = int(self._rows[place])
            if self._is_asked(place):
                yield self._point(row, complex(response[row]), variances[row], flags)

    def _is_asked(self, place: int) -> bool:
        kept = self._grid.points if self._grid.kept is None else self._grid.kept
        return self._grid.skipped <= place < self._grid.skipped + kept

    def _final_variances(self, response: NDArray[np.complex128]) -> list[tuple[float, float]]:
        """Those of all bins; and whether the displays keep their data when asked for them."""
        dialogue, count = self._dialogue, self._grid.points
        unknown = [(math.nan, math.nan)] * count
        if self._knowledge.data_survive is False:
            return unknown
        if self._knowledge.data_survive and isinstance(self._grid, Repeats):
            return unknown
        for setting, value in variance_settings(self._setup.numbers):
            dialogue.command(setting.command(value))
        pairs = np.column_stack([read_trace(dialogue, place, count) for place in (0, 1)])
        self._show_response()
        row = int(self._rows[-1])
        again = self._response(row)
        self._knowledge.data_survive = bool(
            abs(again - response[row]) <= _STANDS * abs(response[row])
        )
        if not self._knowledge.data_survive:
            return unknown
        return [(float(one), float(two)) for one, two in pairs]

    # ------------------------------------------------------------ points

    def _point(
        self, row: int, response: complex, variances: tuple[float, float], flags: PointFlag
    ) -> SweepPoint:
        frequency_hz = float(self._axis[row])
        if np.isnan(response):
            return SweepPoint(frequency_hz, response, flags=flags | PointFlag.SPOILT)
        _, cycles = cycles_at(frequency_hz, self._grid.settle_cycles, self._grid.integrate_cycles)
        pair = None if np.isnan(variances).any() else variances
        error = None if pair is None else gain_standard_error(*pair, cycles)
        gain_std_db, phase_std_deg = (None, None) if error is None else error
        detail = {"integrated_cycles": float(cycles)}
        return SweepPoint(frequency_hz, response, gain_std_db, phase_std_deg, flags, pair, detail)

    def _repeated(self, response: NDArray[np.complex128], flags: PointFlag) -> SweepPoint:
        """The mean of the repeats, and its standard error from their scatter."""
        rows = self._rows[self._grid.skipped :]
        frequency_hz = float(np.mean(self._axis[rows]))
        values = response[rows]
        detail = {"repeats": float(len(values))}
        if np.isnan(values).any():
            return SweepPoint(
                frequency_hz, complex(np.nan, np.nan), flags=flags | PointFlag.SPOILT,
                detail=detail,
            )  # fmt: skip
        mean, count = complex(values.mean()), len(values)
        scatter = float(np.sum(np.abs(values - mean) ** 2)) / (count - 1)
        relative = math.sqrt(scatter / (2.0 * count)) / abs(mean)
        if scatter == 0:  # as without any noise, or where one value fills all bins
            return SweepPoint(frequency_hz, mean, flags=flags, detail=detail)
        std_db, std_deg = float(DB_PER_NEPER * relative), math.degrees(relative)
        return SweepPoint(frequency_hz, mean, std_db, std_deg, flags, detail=detail)
