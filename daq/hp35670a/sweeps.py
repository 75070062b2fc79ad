"""Taking points with the HP 35670A: one by one from the host, or in a sweep on the box.

Owns both ways and the assembly of a point from response, variances and
status. It expects an instrument that is set up and driving; starting and
quieting the source is the driver's matter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.analyser import SweepPoint
from daq.driving.driven import Guard
from daq.driving.scpi_connection import Dialogue
from daq.driving.settings import Setting
from daq.driving.variance import gain_standard_error
from daq.errors import InputError
from daq.frf import PointFlag
from daq.hp35670a.settings import (
    DC_OFFSET,
    DIRECTION,
    GRID_HZ,
    LEVEL,
    MANUAL_FREQUENCY,
    RESOLUTION,
    SPACING,
    START,
    STEPPING,
    STOP,
)
from daq.hp35670a.setup import SetUp, Timing, apply_all, prove_axis
from daq.hp35670a.status import DeviceState, Voltage, polled
from daq.hp35670a.trace import Picture, nearest_row, read_picture
from daq.transports.base import Deadline

__all__ = ["check_grid", "on_box", "point_by_point"]

_FULL_DISPLAYS = (401, 801)
"""Numbers of points for which every displayed point is a measured one (table 18-3)."""

_HELD_BACK = 2
"""Newest displayed points not believed while the sweep runs: the next one may move them."""

_LOOK_EVERY = 3
"""Polls between two looks at the picture of a running sweep."""


def point_by_point(
    dialogue: Dialogue,
    setup: SetUp,
    timing: Timing,
    frequencies_hz: Sequence[float],
    guard: Guard,
) -> Iterator[SweepPoint]:
    """Measure each frequency by itself, in the order given; any frequencies in the band."""
    for frequency_hz in frequencies_hz:
        guard()
        # The read-back carries its unit; what the instrument made of the frequency counts.
        actual_hz = float(dialogue.apply(MANUAL_FREQUENCY, frequency_hz).split()[0])
        what = f"point at {frequency_hz:g} Hz"
        dialogue.send("ABOR;:INIT;*OPC")
        bound = Deadline.after(_bound_s(setup, timing, [frequency_hz]))
        for _ in polled(dialogue, what, bound, longest_pause_s=0.1):
            guard()
        flags = _flags(_read_voltage(dialogue))
        picture = read_picture(dialogue, setup.axis_hz)
        keys = _device_state(dialogue) & DeviceState.KEY_PRESSED
        dialogue.check(what)
        if keys:
            _confirm_unchanged(dialogue, setup)
        _confirm_drive(dialogue, setup)
        yield _point(setup, picture, nearest_row(picture.frequency_hz, actual_hz), actual_hz, flags)


def check_grid(frequencies_hz: Sequence[float]) -> tuple[str, str]:
    """Spacing and direction of frequencies that the instrument can sweep by itself.

    Returns
    -------
    tuple of str
        ``"LIN"`` or ``"LOG"``, and ``"UP"`` or ``"DOWN"``.

    Raises
    ------
    InputError
        If they are not 401 or 801 evenly spaced ones. With any other number
        the display holds more points than were measured, and nothing says
        which.
    """
    visited = np.asarray(frequencies_hz, dtype=float)
    if len(visited) not in _FULL_DISPLAYS:
        raise InputError(
            f"a sweep on the analyser itself has 401 or 801 points, not {len(visited)}: for any "
            "other number its display holds points that were not measured; go point by point"
        )
    direction = "UP" if visited[-1] > visited[0] else "DOWN"
    ascending = visited if direction == "UP" else visited[::-1]
    first, last, count = ascending[0], ascending[-1], len(ascending)
    if np.allclose(ascending, np.linspace(first, last, count), rtol=0, atol=GRID_HZ):
        return "LIN", direction
    if np.allclose(ascending, np.geomspace(first, last, count), rtol=0, atol=GRID_HZ):
        return "LOG", direction
    raise InputError(
        "a sweep on the analyser itself has frequencies spaced evenly, linear or logarithmic; "
        "go point by point for these"
    )


def on_box(
    dialogue: Dialogue,
    setup: SetUp,
    timing: Timing,
    frequencies_hz: Sequence[float],
    guard: Guard,
) -> Iterator[SweepPoint]:
    """Let the analyser sweep by itself, and yield each point when the display has it for sure.

    The frequencies are those of the displayed axis, which may differ from the
    ones asked for by up to a step: whether the last point measured is the stop
    is UNVERIFIED.
    """
    spacing, direction = check_grid(frequencies_hz)
    setup = _set_up_sweep(dialogue, setup, frequencies_hz, spacing, direction)
    progress = _Progress(upward=direction == "UP")
    dialogue.send("ABOR;:INIT;*OPC")
    bound = Deadline.after(_bound_s(setup, timing, frequencies_hz))
    for polls in polled(dialogue, "sweep", bound, longest_pause_s=0.5):
        guard()
        if polls % _LOOK_EVERY == 0:
            yield from _new_points(dialogue, setup, progress, _HELD_BACK)
    yield from _new_points(dialogue, setup, progress, 0)
    dialogue.check("sweep")


@dataclass(slots=True)
class _Progress:
    """How far a sweep on the box has come, as seen from here."""

    upward: bool
    done: set[int] = field(default_factory=set)
    held: dict[int, Voltage] = field(default_factory=dict)
    """Rows held back at the last look, with the status bits that were seen then."""


def _set_up_sweep(
    dialogue: Dialogue,
    setup: SetUp,
    frequencies_hz: Sequence[float],
    spacing: str,
    direction: str,
) -> SetUp:
    changed: dict[Setting, Any] = {
        START: min(frequencies_hz),
        STOP: max(frequencies_hz),
        SPACING: spacing,
        STEPPING: "AUTO",
        DIRECTION: direction,
        RESOLUTION: len(frequencies_hz),
    }
    apply_all(dialogue, "sweep set-up", list(changed.items()))
    axis_hz = prove_axis(dialogue)
    if len(axis_hz) != len(frequencies_hz):
        raise InputError(
            f"the analyser displays {len(axis_hz)} points for {len(frequencies_hz)} measured "
            "ones; go point by point"
        )
    kept = [(setting, value) for setting, value in setup.table if setting not in changed]
    table = (*kept, *changed.items())
    return SetUp(setup.settings, setup.start_hz, setup.stop_hz, table, axis_hz)


def _new_points(
    dialogue: Dialogue, setup: SetUp, progress: _Progress, held_back: int
) -> Iterator[SweepPoint]:
    """Points that the display has and that were not yielded yet, in the order of the sweep."""
    state = _device_state(dialogue)
    if state & DeviceState.KEY_PRESSED:
        _confirm_unchanged(dialogue, setup)
    if held_back and not state & DeviceState.DISPLAY_READY:
        return
    picture = read_picture(dialogue, setup.axis_hz)
    # Read after the picture: an overload of the next point may count for these, none is lost.
    seen = _read_voltage(dialogue)
    _confirm_drive(dialogue, setup)
    rows = np.flatnonzero(picture.measured) if held_back else np.arange(len(picture.measured))
    ordered = (rows if progress.upward else rows[::-1]).tolist()
    sure = ordered[: len(ordered) - held_back]
    held, progress.held = progress.held, dict.fromkeys(ordered[len(sure) :], seen)
    for row in sure:
        if row not in progress.done:
            progress.done.add(row)
            flags = _flags(seen | held.get(row, Voltage(0)))
            yield _point(setup, picture, row, float(picture.frequency_hz[row]), flags)


def _point(
    setup: SetUp, picture: Picture, row: int | None, frequency_hz: float, flags: PointFlag
) -> SweepPoint:
    """One row of a picture; a row that holds nothing stays, flagged as spoilt."""
    if row is None or not picture.measured[row]:
        return SweepPoint(frequency_hz, complex(np.nan, np.nan), flags=flags | PointFlag.SPOILT)
    variances = _variances(picture.variance_1[row], picture.variance_2[row])
    error = None
    if variances is not None:
        error = gain_standard_error(*variances, setup.settings.integrate_cycles)
    gain_std_db, phase_std_deg = error if error is not None else (None, None)
    return SweepPoint(
        frequency_hz=frequency_hz,
        gain=complex(picture.response[row]),
        gain_std_db=gain_std_db,
        phase_std_deg=phase_std_deg,
        flags=flags,
        variances=variances,
    )


def _variances(one: np.float64, two: np.float64) -> tuple[float, float] | None:
    return None if np.isnan(one) or np.isnan(two) else (float(one), float(two))


def _read_voltage(dialogue: Dialogue) -> Voltage:
    """Overload and half range since the last look.

    The event register catches what is over already, but latches only when a
    bit rises; a bit that stays up from one point to the next shows in the
    condition register alone. So both are read.
    """
    event = Voltage(dialogue.ask_integer("STAT:QUES:VOLT?"))
    return event | Voltage(dialogue.ask_integer("STAT:QUES:VOLT:COND?"))


def _flags(seen: Voltage) -> PointFlag:
    flags = PointFlag(0)
    if seen & (Voltage.OVERLOAD_1 | Voltage.OVERLOAD_2):
        flags |= PointFlag.OVERLOAD
    half = Voltage.ABOVE_HALF_1 | Voltage.ABOVE_HALF_2
    if seen & half != half:
        flags |= PointFlag.HALF_RANGE_MISSED
    return flags


def _device_state(dialogue: Dialogue) -> DeviceState:
    return DeviceState(dialogue.ask_integer("STAT:DEV?"))


def _confirm_unchanged(dialogue: Dialogue, setup: SetUp) -> None:
    """After a key was pressed at the front panel: raise `InstrumentError` if a setting moved."""
    for setting, value in setup.table:
        dialogue.confirm(setting, value)


def _confirm_drive(dialogue: Dialogue, setup: SetUp) -> None:
    """Raise `InstrumentError` if level or offset moved: no bit tells of another program's hand."""
    dialogue.confirm(LEVEL, setup.settings.source_vpk)
    dialogue.confirm(DC_OFFSET, setup.settings.dc_offset_v)


def _bound_s(setup: SetUp, timing: Timing, frequencies_hz: Sequence[float]) -> float:
    settings = setup.settings
    cycles = settings.settle_cycles + settings.integrate_cycles
    periods_s: NDArray[np.float64] = 1.0 / np.asarray(frequencies_hz, dtype=float)
    ramps_s = 2 * settings.source_vpk / settings.slew_vpk_per_s if settings.slew_vpk_per_s else 0.0
    per_point_s = 2.0 * (len(frequencies_hz) - 1)
    return float(
        timing.overhead_s + per_point_s + ramps_s + timing.margin * cycles * np.sum(periods_s)
    )
