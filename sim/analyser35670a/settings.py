"""What the instrument is set to: one set of values per instrument mode, some shared by all.

Owns the declaration of a setting and the store of values with the two resets.
It reads no message and checks no range.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from sim.analyser35670a.commands.tree import key_of
from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.kinds import Kind
from sim.analyser35670a.modes import (
    ALL_MODES,
    MODE_CONFLICT,
    OTHER_MODES,
    SINE_ONLY,
    Mode,
    Scope,
)
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.units import Quantity

__all__ = [
    "ALL_MODES",
    "MODE_CONFLICT",
    "OTHER_MODES",
    "SINE_ONLY",
    "Mode",
    "Scope",
    "Setting",
    "Settings",
]


class _Same(Enum):
    SAME = 0


Numbers = tuple[int, ...]
Check = Callable[[InstrumentCore, Numbers, Any], Any]


@dataclass(frozen=True, slots=True)
class Setting:
    """A command with a query form that keeps a value.

    Parameters
    ----------
    pattern
        Header, as for `CommandTree`.
    kind
        How the value is read and shown.
    preset
        Value after ``SYST:PRES``; a mapping gives it by mode, a function by
        the numbers in the header.
    reset
        Value after ``*RST`` where it differs.
    modes, refusal
        Modes in which the command exists, and the error in the others.
    option
        Option that must be installed.
    measured
        Whether a change means that a paused measurement cannot go on.
    check
        Coerces a value to the instrument's grid, or refuses it.
    changed
        Called after the value was stored.
    step_from
        Key of the setting that says what UP and DOWN change.
    bounds
        Gives what MIN and MAX mean where that depends on other settings.
    overlapped
        Whether the trace shows the old value for a moment.
    applies
        Whether there is anything to be set now; else a query gives a null string.
    """

    pattern: str
    kind: Kind
    preset: Any
    scope: Scope = Scope.MODE
    reset: Any = _Same.SAME
    modes: frozenset[Mode] = ALL_MODES
    refusal: tuple[int, str] = MODE_CONFLICT
    option: str = ""
    measured: bool = False
    check: Check | None = None
    changed: Callable[[InstrumentCore, Numbers], None] | None = None
    step_from: str = ""
    bounds: Callable[[InstrumentCore], tuple[float, float]] | None = None
    overlapped: bool = False
    applies: Callable[[InstrumentCore, Numbers], bool] | None = None

    def original(self, mode: Mode, numbers: Numbers, after_reset: bool) -> Any:
        """The value that a reset gives."""
        value = self.preset
        if after_reset and not isinstance(self.reset, _Same):
            value = self.reset
        if isinstance(value, Mapping):
            value = value[mode] if mode in value else value[None]
        return value(numbers) if callable(value) else value


def _full(key: str, numbers: Numbers) -> str:
    return f"{key} {','.join(map(str, numbers))}" if numbers else key


class Settings:
    """All values, and the mode that is selected."""

    def __init__(self, declared: Iterable[Setting]) -> None:
        self._declared = {key_of(setting.pattern): setting for setting in declared}
        self._shared: dict[str, Any] = {}
        self._kept: dict[str, Any] = {}
        self._by_mode: dict[Mode, dict[str, Any]] = {mode: {} for mode in Mode}
        self._after_reset = False
        self.mode = Mode.FFT

    def declared(self, key: str) -> Setting:
        """The setting kept under a key such as ``SOUR:VOLT``."""
        return self._declared[_plain(key)]

    def _values(self, setting: Setting, mode: Mode) -> dict[str, Any]:
        match setting.scope:
            case Scope.MODE:
                return self._by_mode[mode]
            case Scope.SHARED:
                return self._shared
        return self._kept

    def get(self, key: str, *numbers: int, mode: Mode | None = None) -> Any:
        """A value, of the present mode unless another is named."""
        setting = self.declared(key)
        mode = mode or self.mode
        stored = self._values(setting, mode)
        full = _full(_plain(key), numbers)
        if full in stored:
            return stored[full]
        return setting.original(mode, numbers, self._after_reset)

    def put(self, key: str, value: Any, *numbers: int) -> None:
        """Store a value for the present mode."""
        stored = self._values(self.declared(key), self.mode)
        stored[_full(_plain(key), numbers)] = value

    def reset(self, after_reset: bool) -> None:
        """``*RST`` (True) or ``SYST:PRES`` (False): every mode's values, and FFT mode."""
        self._shared.clear()
        for values in self._by_mode.values():
            values.clear()
        self._after_reset = after_reset
        self.mode = Mode.FFT

    def forget(self) -> None:
        """Lose everything, as by a power failure."""
        self.reset(after_reset=False)
        self._kept.clear()

    def dump(self) -> bytes:
        """The whole state, for ``SYST:SET?``."""
        document = {
            "state": "35670A",
            "mode": self.mode.value,
            "after_reset": self._after_reset,
            "shared": _to_plain(self._shared),
            "modes": {mode.value: _to_plain(self._by_mode[mode]) for mode in Mode},
        }
        text = json.dumps(document, separators=(",", ":")).encode("ascii")
        return b"%08X" % zlib.crc32(text) + text

    def load(self, data: bytes) -> None:
        """Take over a state that `dump` wrote.

        Raises
        ------
        ScpiError
            -161 if it is none, or damaged; nothing is changed then.
        """
        text = data[8:]
        if data[:8] != b"%08X" % zlib.crc32(text) or not text.startswith(b'{"state":"35670A"'):
            raise ScpiError(-161, "Data block does not contain a STATE.")
        try:
            document = json.loads(text)
            mode, after_reset = Mode(document["mode"]), document["after_reset"]
            shared = _from_plain(document["shared"])
            by_mode = {mode: _from_plain(document["modes"][mode.value]) for mode in Mode}
        except (ValueError, TypeError, LookupError, AttributeError, RecursionError) as error:
            raise ScpiError(-161, "Data block does not contain a STATE.") from error
        self.mode, self._after_reset = mode, after_reset
        self._shared, self._by_mode = shared, by_mode


def _plain(key: str) -> str:
    return key.replace("#", "1")


def _to_plain(values: dict[str, Any]) -> dict[str, Any]:
    return {
        key: [value.value, value.unit] if isinstance(value, Quantity) else value
        for key, value in values.items()
    }


def _from_plain(values: dict[str, Any]) -> dict[str, Any]:
    return {
        key: Quantity(float(value[0]), str(value[1])) if isinstance(value, list) else value
        for key, value in values.items()
    }
