"""Which instruments can be simulated: every room of this floor that has a module `model`.

Owns the search for them and the choice of one by the scheme of its driver. A new simulated
instrument is a folder beside `sim/analyser35670a` with a `model.py` in it; nothing else names it.
"""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from daq.errors import ConfigurationError, InputError
from sim.faults import Fault, FaultBoard, FaultKind, parse_fault

if TYPE_CHECKING:
    from sim.instrument.bus import Instrument
    from sim.instrument.plant import Plant

__all__ = ["Bench", "Model", "model_named", "model_of", "models"]


@dataclass(frozen=True, slots=True)
class Bench:
    """What a simulated instrument is asked to be; `options` None stands for all that it may have.

    `noise_v` is the noise of the device's output: standard deviation of each component of a
    reading averaged over 30 cycles, V. `converter_noise` is that of the converter, per component
    and cycle, relative to the input range.
    """

    seed: int = 0
    noise_v: float = 0.5e-3
    converter_noise: float = 1e-5
    options: str | None = None
    faults: Sequence[Fault] = ()

    @property
    def board(self) -> FaultBoard:
        """The faults, armed."""
        return FaultBoard(self.faults)


@dataclass(frozen=True, slots=True)
class Model:
    """An instrument that can be simulated."""

    name: str
    """As people and ``serve --model`` call it."""
    scheme: str
    """That of its driver in `daq.drivers`; empty for the preset."""
    build: Callable[[Plant, Bench], Instrument]
    """Makes one with a device under test behind it; imports what it needs."""
    faults: Mapping[str, FaultKind]
    """What can go wrong with it, by name."""
    has_options: bool = False
    """Whether it lists options that may be installed."""
    has_serial: bool = False
    """Whether it has an RS-232 interface (`sim.instrument.serial_line.SerialInstrument`)."""

    def parse_fault(self, text: str) -> Fault:
        """Read ``NAME`` or ``NAME:key=value,...``; raises `InputError` for one it cannot have."""
        return parse_fault(text, self.faults)


@cache
def models() -> tuple[Model, ...]:
    """Every model there is, the preset first."""
    import sim

    rooms = sorted(found.name for found in pkgutil.iter_modules(sim.__path__) if found.ispkg)
    names = [f"sim.{room}.model" for room in rooms]
    modules = [importlib.import_module(name) for name in names if importlib.util.find_spec(name)]
    return tuple(sorted((module.MODEL for module in modules), key=lambda model: model.scheme))


def model_of(scheme: str) -> Model:
    """The model whose driver has that scheme.

    Raises
    ------
    ConfigurationError
        If none is simulated.
    """
    for model in models():
        if model.scheme == scheme:
            return model
    raise ConfigurationError(f"instrument '{scheme}:sim:' cannot be simulated")


def model_named(name: str) -> Model:
    """The model that people call so, in any case.

    Raises
    ------
    InputError
        If there is none; lists those there are.
    """
    for model in models():
        if model.name.lower() == name.lower():
            return model
    known = ", ".join(model.name for model in models())
    raise InputError(f"model {name!r} is not simulated; use one of: {known}")
