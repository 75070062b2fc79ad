"""What a session tells those who watch it, as frozen records.

Owns the records only. Everything in them is already in the store when they
are seen, and nothing that a watcher does with them reaches the session.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from daq.analyser import SourceState, SweepPoint
from daq.plan import SweepPlan
from daq.store_records import MeasurementState, StoredPoint

__all__ = [
    "CheckLine",
    "Finished",
    "GoingOn",
    "LevelStarted",
    "Opened",
    "Paused",
    "PointStored",
    "RunIn",
    "SessionEvent",
    "SourceSafe",
    "Warned",
]


@dataclass(frozen=True, slots=True)
class Opened:
    """The measurement has its place in the store; nothing was sent yet."""

    measurement: int
    plan: SweepPlan
    done: int
    """Points already in the store; above 0 for one that is resumed."""
    total: int
    """Points of the plan; refinement may add some."""
    duration_s: float
    """How long the rest drives the source, without the instrument's overhead."""


@dataclass(frozen=True, slots=True)
class CheckLine:
    """One check before the sweep."""

    name: str
    verdict: Literal["pass", "note", "fail"]
    text: str


@dataclass(frozen=True, slots=True)
class LevelStarted:
    """The source is about to drive at a level."""

    source_vpk: float
    points: int
    """Points to be taken in this run at this level."""


@dataclass(frozen=True, slots=True)
class RunIn:
    """A stored point driven again so that the motion arrives as in an unbroken sweep; not kept."""

    source_vpk: float
    point: SweepPoint
    stored: SweepPoint


@dataclass(frozen=True, slots=True)
class PointStored:
    """A point is committed."""

    stored: StoredPoint
    done: int
    total: int
    elapsed_s: float
    """Since the session began."""
    remaining_s: float
    """Estimated from the plan and the pace so far, pauses left out."""


@dataclass(frozen=True, slots=True)
class Paused:
    """The session holds; the source was made safe."""

    source_state: SourceState


@dataclass(frozen=True, slots=True)
class GoingOn:
    """The session goes on after a pause."""


@dataclass(frozen=True, slots=True)
class SourceSafe:
    """The source was made safe."""

    state: SourceState


@dataclass(frozen=True, slots=True)
class Warned:
    """Something that a person should know; the session goes on."""

    text: str


@dataclass(frozen=True, slots=True)
class Finished:
    """The session is over and the source was made safe."""

    measurement: int
    state: MeasurementState
    source_state: SourceState
    points: int
    """Points in force."""
    flagged: int
    """Those that carry a flag which touches their quality."""
    elapsed_s: float
    reason: str
    """Why it ended, in words; "all points are taken" if it is complete."""
    error: Exception | None = None
    """The fault that ended it; raised after this record."""


SessionEvent = (
    Opened
    | CheckLine
    | LevelStarted
    | RunIn
    | PointStored
    | Paused
    | GoingOn
    | SourceSafe
    | Warned
    | Finished
)
"""Any of the records."""
