"""The bus as a controller meets it: the interface that every simulated instrument has.

Owns the `Instrument` protocol and what one talk brings. Servers, adapters and the loop-back
are written against it. It knows no command of any instrument.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from sim.instrument.agenda import Agenda
from sim.instrument.damage import Damage

__all__ = ["Instrument", "Talk", "TalkState"]


class TalkState(Enum):
    """What became of being told to talk."""

    DATA = "bytes came"
    WAITING = "a reply is due and not ready"
    NOTHING = "there is nothing to say"


@dataclass(frozen=True, slots=True)
class Talk:
    """Bytes sent, and whether EOI came with the last."""

    state: TalkState
    data: bytes = b""
    end: bool = False


class Instrument(Protocol):
    """A simulated instrument on its bus."""

    agenda: Agenda
    damage: Damage
    remote: bool
    local_lockout: bool

    @property
    def gpib_address(self) -> int:
        """The address that it comes with."""
        ...

    @property
    def measurements_begun(self) -> int:
        """Measurements started since it was built."""
        ...

    @property
    def points_begun(self) -> int:
        """Points begun since it was built."""
        ...

    @property
    def repeats(self) -> bool:
        """Whether it measures again and again by itself."""
        ...

    @property
    def driven_v(self) -> float:
        """Largest magnitude of amplitude and offset at the connector now, V; 0 if off."""
        ...

    def listen(self, data: bytes, end: bool = False) -> int:
        """Take bytes, EOI with the last if `end`; how many were taken before the bus stalled."""
        ...

    def talk(self, limit: int | None = None) -> Talk:
        """Send up to `limit` bytes of a reply."""
        ...

    def serial_poll(self) -> int | None:
        """The status byte; None if nobody answers the poll."""
        ...

    @property
    def service_request(self) -> bool:
        """The service-request line."""
        ...

    @property
    def reply_ready(self) -> bool:
        """Whether a reply could be read now."""
        ...

    @property
    def reply_due(self) -> bool:
        """Whether a reply is there or under way."""
        ...

    def device_clear(self) -> None:
        """Selected device clear."""
        ...

    def trigger(self) -> None:
        """Group trigger."""
        ...
