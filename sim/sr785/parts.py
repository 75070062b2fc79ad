"""What the parts of the SR785 ask of the whole.

Owns this interface. A part is written against it, so that none imports the instrument, which has
them all (`sim.sr785.instrument`). Nothing here does anything.
"""

from __future__ import annotations

from typing import Protocol

from sim.faults import FaultBoard
from sim.instrument.agenda import Agenda
from sim.instrument.output import Source
from sim.instrument.plant import Plant
from sim.sr785.choices import Choices
from sim.sr785.settings import Settings
from sim.sr785.status import Status

__all__ = ["Displays", "InstrumentCore"]


class Displays(Protocol):
    """Both displays, as the measurement sees them (`traces.Traces`)."""

    def keep_all(self) -> None:
        """There are no data any more that a display could have lost."""
        ...


class InstrumentCore(Protocol):
    """The whole instrument, as its parts see it (`instrument.SR785`)."""

    plant: Plant
    choices: Choices
    faults: FaultBoard
    agenda: Agenda
    status: Status
    settings: Settings
    source: Source
    input_now: int
    levelled_vpk: float | None

    @property
    def traces(self) -> Displays:
        """Both displays."""
        ...

    @property
    def group(self) -> str:
        """The measurement group of display A."""
        ...

    @property
    def driven_v(self) -> float:
        """Largest magnitude at the connector now, V."""
        ...

    def begin_point(self) -> None:
        """A point is about to be measured."""
        ...

    def begin_read_out(self) -> None:
        """A trace is about to be read."""
        ...

    def refresh_source(self) -> None:
        """Let the output follow settings and measurement."""
        ...

    def reset(self) -> None:
        """``*RST``."""
        ...
