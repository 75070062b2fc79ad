"""Bringing the SR785 into swept sine, its source off, with every setting proven.

Owns the order of the set-up. The source drives nothing when it is done: a swept sine drives only
while it runs, the switch is off, level and offset are 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from daq.analyser import PointSettings
from daq.errors import InstrumentError
from daq.plan import SweepPlan
from daq.sr785.dialogue import Dialogue
from daq.sr785.levels import LevelScale, is_zero, scale_of
from daq.sr785.settings import (
    MODELS,
    START,
    Numbers,
    Setting,
    check_drive,
    level_command,
    offset_command,
    point_settings,
    standing_settings,
)
from daq.sr785.status import ENABLED_EVENTS, SWEPT

__all__ = [
    "SetUp", "Timing", "apply_all", "check_sweep", "confirm_all", "enter_swept_sine",
    "planned_settings",
]  # fmt: skip

_PROBES_V = (0.01, 0.04)
"""Two levels that are set and read back while nothing is driven."""


@dataclass(frozen=True, slots=True)
class Timing:
    """Bounds of waits.

    A sweep may take `margin` times its cycles and `overhead_s` on top, and `point_s` a point for
    ranging. A whole trace has the time that its line needs on top of `block_s`.
    """

    reply_s: float = 5.0
    block_s: float = 10.0
    overhead_s: float = 15.0
    margin: float = 1.5
    point_s: float = 2.0


@dataclass(frozen=True, slots=True)
class SetUp:
    """What the instrument was set to and proved to have."""

    settings: PointSettings
    start_hz: float
    stop_hz: float
    table: tuple[tuple[Setting, float], ...]
    numbers: Numbers
    scale: LevelScale


def planned_settings(
    start_hz: float, stop_hz: float, settings: PointSettings, numbers: Numbers
) -> list[tuple[Setting, float]]:
    """Everything that will be set, in order, each value checked against its range.

    Raises
    ------
    LimitError
        If any value is out of range; nothing was sent.
    """
    check_drive(settings)
    for frequency_hz in (start_hz, stop_hz):
        START.command(frequency_hz)
    table = [*standing_settings(numbers), *point_settings(settings)]
    for setting, value in table:
        setting.command(value)
    return table


def check_sweep(
    plan: SweepPlan,
    slew_vpk_per_s: float,
    input_range_vpk: tuple[float | None, float | None],
) -> None:
    """Refuse a sweep that the instrument cannot be set to, before anything is opened for it.

    Raises
    ------
    LimitError
        If any value is out of range.
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
        lowest_hz, highest_hz = min(plan.frequencies_hz), max(plan.frequencies_hz)
        planned_settings(lowest_hz, highest_hz, settings, MODELS["SR785"])


def enter_swept_sine(dialogue: Dialogue, numbers: Numbers) -> LevelScale:
    """Switch the source off, make FFT harmless, enter swept sine; what levels read back as.

    The fixed sines of FFT would start with a change to that group while the source is on, so the
    switch is proven off before any change of group.

    Raises
    ------
    InstrumentError
        If anything does not read back as it should.
    """
    dialogue.recover()
    # Enables that survive a power failure let it show in the next serial poll.
    for line in ("*CLS", "*PSC 0", f"*ESE {ENABLED_EVENTS}", f"DSPE {SWEPT}", "*SRE 0"):
        dialogue.command(line)
    dialogue.command("SRCO 0")
    dialogue.command("PAUS")
    _confirm_off(dialogue)
    dialogue.command("MGRP 2,0")
    dialogue.command("DISP 2,1")  # a display that is off-line refuses to be set
    for display in (0, 1):
        # Units of density can be switched in FFT alone, and stay on in swept sine.
        dialogue.command(f"PSDU {display},0")
    for mnemonic in ("S1AM", "S2AM"):
        dialogue.command(level_command(mnemonic, 0.0))
        _confirm_zero(dialogue, mnemonic)
    dialogue.command(offset_command(0.0))
    _confirm_off(dialogue)
    dialogue.command(f"MGRP 2,{numbers.swept_sine}")
    if dialogue.ask_integer("MGRP? 0") != numbers.swept_sine:
        raise InstrumentError("swept sine was chosen and MGRP? 0 does not say so")
    dialogue.command("DISP 2,1")
    dialogue.command("SSAL 0")
    scale = _prove_scale(dialogue)
    dialogue.command(level_command("SSAM", 0.0))
    _confirm_zero(dialogue, "SSAM")
    _confirm_off(dialogue)
    return scale


def _prove_scale(dialogue: Dialogue) -> LevelScale:
    """Nothing is driven: a swept sine drives while it runs, and the switch is off."""
    replies = []
    for level_v in _PROBES_V:
        dialogue.command(level_command("SSAM", level_v))
        replies.append((level_v, dialogue.ask("SSAM?")))
    return scale_of(*replies)


def _confirm_off(dialogue: Dialogue) -> None:
    if dialogue.ask_integer("SRCO?") != 0:
        raise InstrumentError(
            "SRCO 0 was sent and SRCO? does not read 0; switch the source off by hand"
        )


def _confirm_zero(dialogue: Dialogue, mnemonic: str) -> None:
    reply = dialogue.ask(f"{mnemonic}?")
    if not is_zero(reply):
        raise InstrumentError(
            f"{mnemonic} was set to 0 mV and reads back {reply!r}; switch the source off by hand"
        )


def apply_all(dialogue: Dialogue, table: Sequence[tuple[Setting, float]]) -> dict[str, str]:
    """Send a table of settings, then read every one back, by name.

    All are read after all are sent, so a setting that a later one moved is caught.

    Raises
    ------
    InstrumentError
        If the instrument refuses any, or reads back something else.
    """
    for setting, value in table:
        dialogue.command(setting.command(value))
    return confirm_all(dialogue, table)


def confirm_all(dialogue: Dialogue, table: Sequence[tuple[Setting, float]]) -> dict[str, str]:
    """Read settings back and compare; of one that was set twice the last value counts.

    Raises
    ------
    InstrumentError
        If any reads back as something else.
    """
    shown: dict[str, str] = {}
    for setting, value in dict(table).items():
        for question in setting.questions:
            found = dialogue.parsed(question, setting.value_of)
            shown[setting.name] = setting.shown(found)
            if not setting.accepts(value, found):
                raise InstrumentError(
                    f"{setting.name} was set to {value:g} and {question} reads back "
                    f"{shown[setting.name]}; the set-up is not what was asked for"
                )
    return shown
