"""Executing one message unit: find the command, check that it may run, run it.

Owns the tree of all commands and the order of the checks. It keeps no state
but the path of the message under way.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any

from sim.analyser35670a.commands import calculate as commands_calculate
from sim.analyser35670a.commands import kept as commands_kept
from sim.analyser35670a.commands import sense as commands_sense
from sim.analyser35670a.commands import source as commands_source
from sim.analyser35670a.commands import status as commands_status
from sim.analyser35670a.commands import system as commands_system
from sim.analyser35670a.commands.registry import Answer, Arguments, Command, Numbers
from sim.analyser35670a.commands.source import OUTPUT
from sim.analyser35670a.commands.tokens import read_arguments, split_header
from sim.analyser35670a.commands.tree import CommandTree, Path, key_of
from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.kinds import Number
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.settings import Setting
from sim.analyser35670a.units import Quantity

__all__ = ["Dispatcher", "all_settings", "is_query"]

Leaf = Command | Setting

_OPTION_TEXTS = {
    "1D3": (-200, "OPTION 1D3 Curve Fit/Synthesis not installed."),
    "1D4": (-200, "OPTION 1D4 Arbitrary Source not installed."),
    "1C2": (-200, "InstrumentCore BASIC not installed."),
}
_FOUR_CHANNELS = (-241, "OPTION AY6 Add 2 Input Channels not installed.")
_CHANNEL_HEADS = ("INPut#", "[SENSe]:VOLTage#", "[SENSe]:WINDow#")


def all_settings() -> Iterator[Setting]:
    """Every declared setting; the cw frequency has an alias."""
    for module in (
        commands_sense,
        commands_source,
        commands_calculate,
        commands_system,
        commands_kept,
    ):
        yield from module.SETTINGS


@cache
def command_tables() -> tuple[CommandTree[Leaf], dict[str, Command]]:
    """Every command of the instrument by its path, and the common ones by their name."""
    tree: CommandTree[Leaf] = CommandTree()
    common = {}
    for setting in all_settings():
        tree.add(setting.pattern, setting)
        if setting.pattern == "SOURce:FREQuency:[CW]":
            tree.add("SOURce:FREQuency:FIXed", setting)
    for module in (
        commands_sense,
        commands_source,
        commands_calculate,
        commands_status,
        commands_system,
        commands_kept,
    ):
        for command in module.COMMANDS:
            if command.pattern.startswith("*"):
                common[command.pattern] = command
            else:
                # A command overrules a setting that is declared for its preset alone.
                tree.add(command.pattern, command)
    return tree, common


def is_query(unit: bytes) -> bool:
    """Whether a unit will be answered, by the look of its header."""
    head = unit.strip().split(None, 1)
    return bool(head) and head[0].endswith(b"?")


class Dispatcher:
    """Executes units for one instrument."""

    def __init__(self, instrument: InstrumentCore) -> None:
        self._instrument = instrument
        self._tree, self._common = command_tables()
        self._path: Path[Leaf] = self._tree.root

    def new_message(self) -> None:
        """Back to the root of the tree."""
        self._path = self._tree.root

    def run(self, unit: bytes) -> Answer:
        """Execute one unit.

        Raises
        ------
        ScpiError
            If it is refused; nothing was changed then.
        """
        if not unit.strip():
            return None
        header, rest = split_header(unit)
        query = header.endswith("?")
        leaf, numbers = self._find(header.removesuffix("?"))
        self._check(leaf, numbers)
        arguments = read_arguments(rest)
        if isinstance(leaf, Setting):
            if query:
                return self._show(leaf, numbers, arguments)
            self._keep(leaf, numbers, arguments)
            return None
        form = leaf.ask if query else leaf.act
        if form is None and not query:
            raise ScpiError(-100, "Command is query only.")
        if form is None:
            raise ScpiError(-113)
        answer = form(self._instrument, numbers, arguments)
        if leaf.measured and not query:
            self._instrument.measurement.spoilt = True
        return answer

    def _find(self, header: str) -> tuple[Leaf, Numbers]:
        if header.startswith("*"):
            if header not in self._common:
                raise ScpiError(-113)
            return self._common[header], ()
        found = self._tree.find(header, self._path)
        if found is None:
            raise ScpiError(-113)
        self._path = found.path
        return found.leaf, found.suffixes

    def _check(self, leaf: Leaf, numbers: Numbers) -> None:
        instrument = self._instrument
        if leaf.option and leaf.option not in instrument.installed:
            raise ScpiError(*_OPTION_TEXTS[leaf.option])
        beyond = bool(numbers) and numbers[0] > 2 and leaf.pattern.startswith(_CHANNEL_HEADS)
        if beyond and "AY6" not in instrument.installed:
            raise ScpiError(*_FOUR_CHANNELS)
        chosen = leaf.pattern == OUTPUT and instrument.choices.output_in_sine
        if instrument.settings.mode not in leaf.modes and not chosen:
            raise ScpiError(*leaf.refusal)

    def _kind(self, setting: Setting) -> Any:
        """The setting's kind, with steps and bounds that depend on other settings."""
        kind, settings = setting.kind, self._instrument.settings
        if isinstance(kind, Number) and setting.step_from:
            kind = replace(kind, step=settings.get(setting.step_from).value)
        if isinstance(kind, Number) and setting.bounds is not None:
            low, high = setting.bounds(self._instrument)
            kind = replace(kind, low=low, high=high)
        return kind

    def _keep(self, setting: Setting, numbers: Numbers, arguments: Arguments) -> None:
        instrument, key = self._instrument, key_of(setting.pattern)
        if setting.applies is not None and not setting.applies(instrument, numbers):
            raise ScpiError(-221, "Measurement data has no such unit.")
        kept = instrument.settings.get(key, *numbers)
        value = self._kind(setting).read(arguments, kept)
        if setting.check is not None:
            value = setting.check(instrument, numbers, value)
        instrument.settings.put(key, value, *numbers)
        if setting.overlapped:
            instrument.traces.change_over(numbers[0], key, str(kept))
        if setting.measured:
            instrument.measurement.spoilt = True
        if setting.changed is not None:
            setting.changed(instrument, numbers)

    def _show(self, setting: Setting, numbers: Numbers, arguments: Arguments) -> Answer:
        instrument = self._instrument
        if setting.applies is not None and not setting.applies(instrument, numbers):
            return '""'
        value = instrument.settings.get(key_of(setting.pattern), *numbers)
        kind = self._kind(setting)
        if not arguments:
            return str(kind.show(value))
        if len(arguments) > 1:
            raise ScpiError(-104)
        word = arguments[0].text
        if arguments[0].kind not in ("word", "string") or not isinstance(value, Quantity):
            raise ScpiError(-104)
        if word.upper() == "UNIT":
            return instrument.shown_unit(value.unit)
        if word in ("MIN", "MAX", "MINIMUM", "MAXIMUM"):
            return str(kind.show(kind.read(arguments, value)))
        raise ScpiError(-141)
