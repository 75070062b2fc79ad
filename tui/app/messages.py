"""What workers tell the application; nothing else passes between threads.

Owns the messages only. Each carries finished records, never a widget or a
live object of a session.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

from textual.message import Message

from daq.analyser import Identity, SourceState
from daq.session_events import SessionEvent
from daq.store_records import StoredPoint

__all__ = [
    "AnalysisDone",
    "AnalysisFailed",
    "AnalysisProgressed",
    "InstrumentFailed",
    "InstrumentFound",
    "InstrumentsListed",
    "Job",
    "SessionEnded",
    "SessionPreloaded",
    "SessionRefused",
    "SessionTold",
    "SourceStopped",
    "WorkDone",
]

Job = Literal["result", "band", "diagnosis", "stored diagnosis", "report", "judgement"]
"""What an analysis works on."""


class SessionTold(Message):
    """A session told something."""

    def __init__(self, event: SessionEvent) -> None:
        super().__init__()
        self.event = event


class SessionPreloaded(Message):
    """The points that the measurement to go on with has already."""

    def __init__(self, points: Sequence[StoredPoint]) -> None:
        super().__init__()
        self.points = points


class SessionRefused(Message):
    """A session was not begun; nothing was sent and nothing stored."""

    def __init__(self, error: Exception) -> None:
        super().__init__()
        self.error = error


class SessionEnded(Message):
    """A session is over and its connection closed; `error` is the fault that ended it, if any."""

    def __init__(self, error: Exception | None) -> None:
        super().__init__()
        self.error = error


class InstrumentFound(Message):
    """An instrument answered at an address."""

    def __init__(self, url: str, identity: Identity, source: SourceState) -> None:
        super().__init__()
        self.url, self.identity, self.source = url, identity, source


class InstrumentFailed(Message):
    """None did, or not as it should."""

    def __init__(self, url: str, error: Exception) -> None:
        super().__init__()
        self.url, self.error = url, error


class InstrumentsListed(Message):
    """Addresses that were found on this machine, as (address, what is known of it)."""

    def __init__(self, found: Sequence[tuple[str, str]], notes: Sequence[str]) -> None:
        super().__init__()
        self.found, self.notes = found, notes


class SourceStopped(Message):
    """The safe-off recipe ran outside of a session."""

    def __init__(self, state: SourceState, text: str) -> None:
        super().__init__()
        self.state, self.text = state, text


class AnalysisProgressed(Message):
    """How far an analysis is, 0 to 1."""

    def __init__(self, job: Job, fraction: float, text: str) -> None:
        super().__init__()
        self.job, self.fraction, self.text = job, fraction, text


class AnalysisDone(Message):
    """What an analysis of a measurement gave; it may come in parts."""

    def __init__(self, job: Job, measurement: int, result: Any) -> None:
        super().__init__()
        self.job, self.measurement, self.result = job, measurement, result


class AnalysisFailed(Message):
    """Why an analysis gave nothing."""

    def __init__(self, job: Job, measurement: int, error: Exception) -> None:
        super().__init__()
        self.job, self.measurement, self.error = job, measurement, error


class WorkDone(Message):
    """What work beside the screen gave, or the error that ended it."""

    def __init__(self, kind: str, result: Any, error: Exception | None) -> None:
        super().__init__()
        self.kind, self.result, self.error = kind, result, error
