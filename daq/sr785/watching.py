"""Whether a sweep on the SR785 is still the one that was asked for: state, drive, displays, inputs.

Owns what is looked at while a sweep runs and in its end, as no bit tells of another program's
hand. It changes nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

from daq.errors import InstrumentError, MeasurementError
from daq.frf import PointFlag
from daq.sr785.dialogue import Dialogue
from daq.sr785.settings import SWEEP_SETTINGS, Setting, shown_settings
from daq.sr785.setup import SetUp, confirm_all
from daq.sr785.status import Input, Instrument

__all__ = ["Watching"]

_LEVEL_SLACK_V = 1e-4
_LEVEL_SHARE = 2e-3


class Watching:
    """One sweep's set-up, with every setting and the value asked for in `table`."""

    def __init__(
        self, dialogue: Dialogue, setup: SetUp, table: Sequence[tuple[Setting, float]]
    ) -> None:
        self._dialogue, self._setup, self._table = dialogue, setup, table

    def state(self) -> None:
        """Raise if somebody paused the sweep, or moved a setting or the drive."""
        if Instrument(self._dialogue.ask_integer("INST?") & 0x60) & Instrument.PAUSED:
            raise MeasurementError(
                "the sweep was paused at the front panel or by another program; it ends here"
            )
        self.keys()
        self.drive()

    def keys(self) -> None:
        """Raise `InstrumentError` if somebody touched the panel and a setting moved."""
        if self._dialogue.key_pressed:
            self._dialogue.key_pressed = False
            confirm_all(self._dialogue, self._table)

    def readings(self) -> None:
        """Raise `InstrumentError` if the bins are not what was asked for."""
        confirm_all(self._dialogue, shown_settings(self._setup.numbers))
        for setting, value in self._table:
            if setting in SWEEP_SETTINGS:
                question = setting.questions[0]
                found = self._dialogue.parsed(question, setting.value_of)
                if not setting.accepts(value, found):
                    raise InstrumentError(
                        f"{setting.name} was set to {value:g} and {question} reads back "
                        f"{setting.shown(found)}; somebody changed the sweep while it ran"
                    )
        self.level()

    def group(self) -> None:
        """Raise `InstrumentError` if this is not swept sine: another group drives at once."""
        if self._dialogue.ask_integer("MGRP? 0") != self._setup.numbers.swept_sine:
            raise InstrumentError(
                "the instrument is not in swept sine any more; was it switched off and on?"
            )

    def level(self) -> None:
        """Raise `InstrumentError` if level or offset moved."""
        dialogue, settings = self._dialogue, self._setup.settings
        found_v = dialogue.parsed("SSAM?", self._setup.scale.volts)
        slack_v = max(_LEVEL_SLACK_V, _LEVEL_SHARE * settings.source_vpk)
        if abs(found_v - settings.source_vpk) > slack_v:
            raise InstrumentError(
                f"the source level was set to {settings.source_vpk:g} V peak and reads back "
                f"{found_v:g} V; the set-up is not what was asked for"
            )
        offset = dialogue.ask_number("SOFF?")
        # Its unit is not known: V or mV.
        due_v = settings.dc_offset_v
        if min(abs(offset - due_v), abs(offset - 1000 * due_v) / 1000) > _LEVEL_SLACK_V:
            raise InstrumentError(
                f"the source offset was set to {due_v:g} V and reads back {offset:g}; "
                "the set-up is not what was asked for"
            )

    def drive(self) -> None:
        """Raise `InstrumentError` if level, offset or switch moved."""
        self.level()
        if self._dialogue.ask_integer("SRCO?") != 1:
            raise InstrumentError("the source was switched off by somebody; the sweep ends here")

    def inputs(self) -> int:
        """The input word since the last look; raises if a range that was fixed has moved."""
        bits = self._dialogue.ask_integer("INPS?")
        for channel, fixed in enumerate(self._setup.settings.input_range_vpk):
            if fixed is not None and Input(bits >> 8 * channel & 0x1E) & Input.RANGED:
                confirm_all(self._dialogue, self._table)
        return bits

    @staticmethod
    def flags(bits: int) -> PointFlag:
        """Overload and half range, from the input words of all looks since a point began."""
        flags = PointFlag(0)
        for channel in (0, 1):
            seen = Input(bits >> 8 * channel & 0x1E)
            if seen & (Input.OVERLOAD | Input.FORCED_DOWN):
                flags |= PointFlag.OVERLOAD
            if not seen & Input.ABOVE_HALF:
                flags |= PointFlag.HALF_RANGE_MISSED
        return flags
