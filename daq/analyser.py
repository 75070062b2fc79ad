"""What a bench session asks of any analyser, and the records that pass between them.

Owns the `Analyser` protocol. A driver implements it for one instrument; the
session drives any of them. Nothing here talks to a wire.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Protocol

from daq.frf import PointFlag

__all__ = ["Analyser", "Identity", "PointSettings", "SourceState", "SweepPoint"]


class SourceState(StrEnum):
    """What is known about the source; only a read-back earns `CONFIRMED_OFF`."""

    CONFIRMED_OFF = "confirmed-off"
    """Read back: output off, level 0, offset 0."""
    ON = "on"
    """Driving, or free to drive."""
    UNCONFIRMED = "unconfirmed"
    """Told to switch off, but the proof failed: switch off by hand."""
    UNKNOWN = "unknown"
    """The instrument cannot be asked."""


@dataclass(frozen=True, slots=True)
class Identity:
    """Who answered on the wire."""

    maker: str
    model: str
    serial: str
    revision: str
    options: tuple[str, ...] = ()
    simulated: bool = False


@dataclass(frozen=True, slots=True)
class PointSettings:
    """How each point of one level's sweep is taken.

    `input_range_vpk` fixes a channel's range in V peak, None leaves it to
    autorange; the tuple is (channel 1, channel 2).
    """

    source_vpk: float
    settle_cycles: int
    integrate_cycles: int
    dc_offset_v: float = 0.0
    slew_vpk_per_s: float = 10.0
    input_range_vpk: tuple[float | None, float | None] = (None, None)


@dataclass(frozen=True, slots=True)
class SweepPoint:
    """One measured point of V_o/V_i.

    `gain_std_db` and `phase_std_deg` are one standard error of the reading,
    None where the instrument gave nothing to derive it from.
    """

    frequency_hz: float
    gain: complex
    gain_std_db: float | None = None
    phase_std_deg: float | None = None
    flags: PointFlag = PointFlag(0)
    variances: tuple[float, float] | None = None
    """Normalised variance of channels 1 and 2, as read."""
    detail: Mapping[str, float] = field(default_factory=dict)
    """Anything else that was read with the point, by name."""


class Analyser(Protocol):
    """An instrument that measures a frequency response by stepped sine.

    Every method raises `LinkError` when the connection is lost, `BenchTimeout`
    when a wait runs out and `InstrumentError` when the instrument complains.
    """

    @property
    def on_wait(self) -> Callable[[], None] | None:
        """Called in every wait.

        At least five times a second, except in the waits of `make_safe`, and immediately before
        every command that makes the source drive. It may raise, which ends the wait and comes out
        of the method that waited: this is how a session interrupts a point that takes long. None
        does nothing.
        """
        ...

    @on_wait.setter
    def on_wait(self, look: Callable[[], None] | None, /) -> None: ...

    @property
    def on_exchange(self) -> Callable[[float], None] | None:
        """Told before each exchange how long it may take, s.

        Those of `make_safe` are included. A watchdog hears from it that the session lives; it must
        not raise. None does nothing.
        """
        ...

    @on_exchange.setter
    def on_exchange(self, told: Callable[[float], None] | None, /) -> None: ...

    def identify(self) -> Identity:
        """Ask who is there, and refuse an instrument that cannot do the job."""
        ...

    def prepare(
        self, start_hz: float, stop_hz: float, settings: PointSettings
    ) -> Mapping[str, str]:
        """Set everything but the level, read it back, and return what was read."""
        ...

    def sweep(self, frequencies_hz: Sequence[float]) -> Iterator[SweepPoint]:
        """Drive the source and yield each point as it is finished, in the order given.

        Closing the generator early stops the measurement and the source.
        """
        ...

    def source_state(self) -> SourceState:
        """What a read-back says of the source now."""
        ...

    def make_safe(self) -> SourceState:
        """Switch the source off whatever the state, and say what could be proven.

        May be called twice, never raises, and does not depend on what the
        driver believes.
        """
        ...

    def close(self) -> None:
        """Let go of the connection; does not touch the source."""
        ...
