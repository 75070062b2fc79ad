"""What the history of a bench holds, as records: headers, points, events.

Owns the shapes only. Nothing here knows of SQL or of files.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from daq.analyser import Identity, SourceState, SweepPoint
from daq.errors import InputError
from daq.plan import SweepPlan
from daq.untrusted.bounded_text import parse_json

__all__ = [
    "CORRECTABLE",
    "LONGEST_NAME",
    "LONGEST_TEXT",
    "Answer",
    "Correction",
    "Diagnosed",
    "Estimate",
    "HistoryLine",
    "Measurement",
    "MeasurementHeader",
    "MeasurementState",
    "SessionEvent",
    "StoredPoint",
    "plan_from_text",
    "plan_text",
]

LONGEST_NAME, LONGEST_TEXT = 1000, 65536
"""Characters of a name or a serial number, and of notes."""

MeasurementState = Literal["complete", "interrupted", "aborted"]
"""How a measurement stands. One that is still running, or whose program was
killed, is "interrupted": the state is right whenever the machine stops."""


@dataclass(frozen=True, slots=True)
class MeasurementHeader:
    """All that is known of a measurement before its first point.

    Parameters
    ----------
    unit, serial
        Name and serial number of the unit under test.
    plan
        What is to be measured.
    address
        How the instrument was reached.
    software
        Name and version of the program that measures.
    operator, notes
        Free text.
    configurations
        Text of the unit, bench and recipe files as they were used, by kind.
    """

    unit: str
    serial: str
    plan: SweepPlan
    address: str
    software: str
    operator: str = ""
    notes: str = ""
    configurations: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Measurement:
    """A stored measurement without its points."""

    id: int
    header: MeasurementHeader
    instrument: Identity | None
    state: MeasurementState
    source_state: SourceState
    started: str
    """ISO 8601, UTC."""
    ended: str | None
    """ISO 8601, UTC; None while it runs or if its program was killed."""
    readback: Mapping[str, str]
    """What the instrument said of its settings before the first point."""
    points: int
    """Points in force, superseded ones not counted."""
    flagged: int
    """Points in force that carry a flag other than that of being taken a second time."""
    points_version: int = 0
    """Raised whenever a point is added: what was analysed is of one version of the points."""


@dataclass(frozen=True, slots=True)
class StoredPoint:
    """A committed point."""

    id: int
    source_vpk: float
    requested_hz: float
    """Frequency asked for by the plan; `point.frequency_hz` is the one that was driven."""
    point: SweepPoint
    taken: str
    """ISO 8601, UTC."""
    superseded_by: int | None = None
    """Identifier of the point that replaced this one, None while it is in force."""


@dataclass(frozen=True, slots=True)
class SessionEvent:
    """One line of a session's journal."""

    time: str
    kind: str
    text: str
    data: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Estimate:
    """What an estimate said of a measurement, kept so that the history can show it.

    Parameters
    ----------
    measurement
        Identifier of the measurement.
    made
        ISO 8601, UTC; to be shown only, as a clock may be wrong.
    software, edition
        Name and version of the program, and of the inference in it.
    document
        The document of ``estimate --json``, or ``{"failed": reason}``.
    points_version
        `Measurement.points_version` that it is of; None where nobody knows.
    physics
        Digest of the unit's values that it was made with, as the caller makes it.
    elapsed_s
        How long it took, s.
    """

    measurement: int
    made: str
    software: str
    document: Mapping[str, Any]
    points_version: int | None = None
    physics: str = ""
    edition: str = ""
    elapsed_s: float | None = None


@dataclass(frozen=True, slots=True)
class Diagnosed:
    """What a diagnosis said of a measurement, and of those that were diagnosed with it.

    Parameters
    ----------
    points
        `Measurement.points_version` of every measurement that it is of, by identifier.
    as_measured
        Whether the unit's values were those that the measurement was made with.
    document
        The document of ``diagnose --json``.

    The rest is as for `Estimate`.
    """

    measurement: int
    made: str
    software: str
    document: Mapping[str, Any]
    points: Mapping[int, int]
    physics: str = ""
    as_measured: bool = True
    edition: str = ""
    elapsed_s: float | None = None


CORRECTABLE = ("serial", "operator", "notes")
"""What can be corrected of a measurement afterwards."""


@dataclass(frozen=True, slots=True)
class Correction:
    """A line of the audit trail: who corrected what, and what stood there before."""

    time: str
    """ISO 8601, UTC."""
    person: str
    field: str
    """One of `CORRECTABLE`."""
    old: str
    new: str


@dataclass(frozen=True, slots=True)
class Answer:
    """The gist of an estimate or a diagnosis in force: a few fields of its document."""

    made: str
    software: str
    edition: str
    summary: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class HistoryLine:
    """A measurement as a list shows it; the whole of it is a `Measurement`."""

    id: int
    unit: str
    serial: str
    started: str
    ended: str | None
    state: MeasurementState
    source_state: SourceState
    points: int
    flagged: int
    planned: int
    levels_vpk: tuple[float, ...]
    simulated: bool
    operator: str
    notes: str
    corrections: int
    """How many lines its audit trail has."""
    estimate: Answer | None = None
    diagnosis: Answer | None = None


def plan_text(plan: SweepPlan) -> str:
    """A plan as JSON, the same text for the same plan; numbers keep all their digits."""
    return json.dumps(asdict(plan), sort_keys=True, allow_nan=False)


def plan_from_text(text: str) -> SweepPlan:
    """Read what `plan_text` wrote.

    Raises
    ------
    ValueError
        If the text is not a plan.
    """
    try:
        document = parse_json(text)
        for name in ("frequencies_hz", "levels_vpk"):
            document[name] = tuple(document[name])
        return SweepPlan(**document)
    except (TypeError, KeyError, InputError) as error:
        raise ValueError(f"it is no sweep plan: {error}") from error
