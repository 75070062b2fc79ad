"""Bringing the HP 35670A into swept sine, quiet in both modes, with every setting proven.

Owns the order of the set-up. The source drives nothing when it is done: level
and offset are 0, and are the sweep's matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.analyser import PointSettings
from daq.driving.replies import QueueEntry
from daq.driving.scpi_connection import Dialogue
from daq.driving.settings import Setting
from daq.errors import InputError, InstrumentError
from daq.hp35670a.settings import (
    CALCULATE,
    CONTINUOUS,
    DC_OFFSET,
    GRID_HZ,
    LEVEL,
    MODE,
    RESOLUTION,
    SPACING,
    SPAN,
    START,
    STEPPING,
    STOP,
    check_drive,
    point_settings,
    standing_settings,
)
from daq.hp35670a.status import Questionable, arm_events, wait_until_done
from daq.hp35670a.trace import prove_byte_order, read_axis
from daq.plan import SweepPlan
from daq.transports.base import Deadline

__all__ = [
    "SetUp",
    "apply_all",
    "Timing",
    "calibrate",
    "check_sweep",
    "enter_swept_sine",
    "parks_at_zero",
    "planned_settings",
    "prove_axis",
    "select_traces",
]

_RESET_S = 30.0
_CALIBRATION_S = 180.0
_TRACES_S = 20.0
_DISPLAYED = 401
"""Points on the display while points are measured one by one."""


@dataclass(frozen=True, slots=True)
class Timing:
    """Bounds of waits.

    A point may take `margin` times its cycles and `overhead_s` on top; how
    long one really takes is known from a single example in the manuals.
    """

    reply_s: float = 5.0
    block_s: float = 10.0
    overhead_s: float = 30.0
    margin: float = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class SetUp:
    """What the instrument was set to and proved to have.

    `table` holds every setting with the value asked for, `axis_hz` the
    displayed X axis, shape (displayed,).
    """

    settings: PointSettings
    start_hz: float
    stop_hz: float
    table: tuple[tuple[Setting, Any], ...]
    axis_hz: NDArray[np.float64]


def parks_at_zero(entry: QueueEntry) -> bool:
    """Whether an error only says that a level of 0 keeps the sweep from starting."""
    return entry.number == -221 and "LEVEL IS 0" in entry.text.upper()


def planned_settings(
    start_hz: float, stop_hz: float, settings: PointSettings
) -> list[tuple[Setting, Any]]:
    """Everything that will be set, in order, each value checked against its range.

    Raises
    ------
    LimitError
        If any value is out of range; nothing was sent.
    """
    check_drive(settings)
    table = [
        *standing_settings(),
        (START, start_hz),
        (STOP, stop_hz),
        (SPACING, "LIN"),
        (STEPPING, "MAN"),
        (RESOLUTION, _DISPLAYED),
        *point_settings(settings),
    ]
    for setting, value in table:
        setting.command(value)
    return table


def check_sweep(
    plan: SweepPlan,
    slew_vpk_per_s: float,
    input_range_vpk: tuple[float | None, float | None],
    *,
    may_repeat: bool = False,
) -> None:
    """Refuse a sweep that the instrument cannot be set to, before anything is opened for it.

    Parameters
    ----------
    may_repeat
        Let frequencies be that fall on one step, as in a measurement that was begun so.

    Raises
    ------
    LimitError
        If any value is out of range.
    InputError
        If two frequencies fall on one of the steps in which they are set.
    """
    for source_vpk in plan.levels_vpk:
        settings = PointSettings(
            source_vpk=source_vpk,
            settle_cycles=plan.settle_cycles,
            integrate_cycles=plan.integrate_cycles,
            dc_offset_v=plan.dc_offset_v,
            slew_vpk_per_s=slew_vpk_per_s,
            input_range_vpk=input_range_vpk,
        )
        planned_settings(min(plan.frequencies_hz), max(plan.frequencies_hz), settings)
    asked = sorted(plan.frequencies_hz)
    for lower, upper in pairwise(asked):
        if not may_repeat and round(lower / GRID_HZ) == round(upper / GRID_HZ):
            raise InputError(
                f"{lower:.10g} and {upper:.10g} Hz would both be measured at "
                f"{round(lower / GRID_HZ) * GRID_HZ:g} Hz, as the analyser sets frequencies in "
                "steps of 1/64 Hz; take fewer points or a wider band"
            )


def enter_swept_sine(dialogue: Dialogue) -> None:
    """Reset, make FFT mode harmless, enter swept sine and take its level away at once.

    FFT mode is where the safe-off recipe falls back to, so its own settings
    are zeroed and its output proven off before it is left. The settings that
    swept sine kept from earlier can only be zeroed inside it: that is done in
    the same message that enters it, with continuous measuring off before.

    Raises
    ------
    InstrumentError
        If anything does not read back as it should.
    """
    arm_events(dialogue)
    dialogue.send("*RST")
    dialogue.send("*OPC")
    wait_until_done(dialogue, "reset", Deadline.after(_RESET_S))
    dialogue.send(CONTINUOUS.command(False))
    dialogue.send(MODE.command("FFT"))
    dialogue.send(LEVEL.command(0.0))
    dialogue.send(DC_OFFSET.command(0.0))
    dialogue.send("OUTP OFF")
    _confirm_quiet(dialogue, "FFT")
    if dialogue.ask_integer("OUTP?") != 0:
        raise InstrumentError(
            "OUTP OFF was sent in FFT mode and OUTP? does not read 0; switch the source off by hand"
        )
    dialogue.check("FFT mode made harmless")
    dialogue.send("INST:SEL SINE;:SOUR:VOLT 0 VPK;:SOUR:VOLT:OFFS 0 V;:INIT:CONT OFF")
    dialogue.check("swept sine", harmless=parks_at_zero)
    _confirm_quiet(dialogue, "SINE")


def _confirm_quiet(dialogue: Dialogue, mode: str) -> None:
    dialogue.confirm(MODE, mode)
    for setting in (LEVEL, DC_OFFSET):
        value = setting.value_of(*dialogue.read_back(setting))
        if value != 0:
            raise InstrumentError(
                f"{setting.name} was set to 0 in {mode} mode and reads back {value:g}; "
                "switch the source off by hand"
            )


def calibrate(dialogue: Dialogue) -> None:
    """Calibrate once; automatic calibration stays off so that none falls into a sweep.

    Raises
    ------
    InstrumentError
        If the calibration fails.
    """
    dialogue.send("CAL:AUTO ONCE")
    dialogue.send("*OPC")
    wait_until_done(dialogue, "calibration", Deadline.after(_CALIBRATION_S))
    dialogue.check("calibration", harmless=parks_at_zero)
    if dialogue.ask_integer("STAT:QUES:COND?") & Questionable.CALIBRATION_FAILED:
        raise InstrumentError(
            "the calibration failed: its data would be uncalibrated; let it warm up for "
            "15 minutes, or have it serviced"
        )


def apply_all(
    dialogue: Dialogue, block: str, table: Sequence[tuple[Setting, Any]]
) -> dict[str, str]:
    """Send a table of settings, then read every one back, by name.

    All are read after all are sent, so a setting that a later one moved is
    caught. The start cannot pass 51.2 kHz minus the span, so the span is made
    small first, whatever band was set before.

    Raises
    ------
    InstrumentError
        If the instrument complains, or any setting reads back as something else.
    """
    dialogue.send(SPAN.command(1.0))
    for setting, value in table:
        dialogue.send(setting.command(value))
    dialogue.check(block, harmless=parks_at_zero)
    return {setting.name: dialogue.confirm(setting, value) for setting, value in table}


def select_traces(dialogue: Dialogue) -> dict[str, str]:
    """Choose what the traces hold; these commands overlap, so their end is waited for."""
    for setting, value in CALCULATE:
        dialogue.send(setting.command(value))
    dialogue.send("*OPC")
    wait_until_done(dialogue, "choice of traces", Deadline.after(_TRACES_S))
    return {setting.name: dialogue.confirm(setting, value) for setting, value in CALCULATE}


def prove_axis(dialogue: Dialogue) -> NDArray[np.float64]:
    """Read the X axis, shape (displayed,), and prove on it that bytes come as they should."""
    axis_hz = read_axis(dialogue)
    start_hz = START.value_of(*dialogue.read_back(START))
    stop_hz = STOP.value_of(*dialogue.read_back(STOP))
    prove_byte_order(axis_hz, start_hz, stop_hz)
    return axis_hz
