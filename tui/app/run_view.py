"""What is known of a session from the records it told: points, checks, progress, the source.

Owns that memory, for any screen to draw from. It talks to no instrument, opens
no history and knows no widget, so that a recorded session can be shown by the
same means.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from daq import session_events as kinds
from daq.analyser import SourceState

if TYPE_CHECKING:
    from daq.plan import SweepPlan
    from daq.store_records import StoredPoint

__all__ = ["Phase", "RunView", "source_words"]

Phase = Literal["none", "checking", "ready", "sweeping", "paused", "ending", "over"]
"""``ready``: the checks have passed and the session holds, source off, for the word to start."""

_OFF_BY_HAND = "switch it off by hand"


def source_words(state: SourceState | None, source_vpk: float | None = None) -> str:
    """What is known of the source, in words that need no colour."""
    match state:
        case SourceState.CONFIRMED_OFF:
            return "SOURCE OFF (confirmed)"
        case SourceState.ON if source_vpk is not None:
            return f"SOURCE ON at {source_vpk:g} V peak"
        case SourceState.ON:
            return f"SOURCE ON: {_OFF_BY_HAND}"
        case SourceState.UNCONFIRMED:
            return f"SOURCE UNCONFIRMED: {_OFF_BY_HAND}"
        case SourceState.UNKNOWN:
            return f"SOURCE UNKNOWN: {_OFF_BY_HAND}"
    return "SOURCE not asked yet"


@dataclass(slots=True)
class RunView:
    """One session as seen so far; `take` every record of it in order.

    Parameters
    ----------
    hold
        Whether the session was asked to hold after its checks.
    """

    hold: bool = False
    phase: Phase = "none"
    measurement: int | None = None
    plan: SweepPlan | None = None
    points: dict[tuple[float, float], StoredPoint] = field(default_factory=dict)
    """Points in force, by level and frequency asked for."""
    checks: list[kinds.CheckLine] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    done: int = 0
    total: int = 0
    duration_s: float = 0.0
    """Driving time to come when the session was opened."""
    elapsed_s: float = 0.0
    remaining_s: float | None = None
    source: SourceState | None = None
    source_vpk: float | None = None
    """The level that drives, None where none does."""
    latest: StoredPoint | None = None
    run_in: int = 0
    """Points driven again before the sweep goes on, in the run-in under way."""
    finished: kinds.Finished | None = None
    fault: Exception | None = None
    """What ended the session before it could say so itself."""
    stop_asked: bool = False

    @property
    def live(self) -> bool:
        """Whether a session is under way, holding ones included."""
        return self.phase in ("checking", "ready", "sweeping", "paused", "ending")

    @property
    def passed(self) -> bool:
        """Whether all checks of this session passed."""
        return self.phase in ("ready", "sweeping", "paused") or (
            self.finished is not None and self.finished.state == "complete"
        )

    @property
    def source_text(self) -> str:
        """The state of the source in words."""
        text = source_words(self.source, self.source_vpk)
        return f"STOP REQUESTED, {text}" if self.stop_asked and self.live else text

    def preload(self, points: Iterable[StoredPoint]) -> None:
        """Take in points of an earlier session of the same measurement."""
        self.points |= {(point.source_vpk, point.requested_hz): point for point in points}

    def begin(self) -> None:
        """The session is on its way; nothing was told yet."""
        self.phase = "checking"

    def take(self, event: kinds.SessionEvent) -> None:
        """Remember what a record says."""
        match event:
            case kinds.Opened():
                self.measurement, self.plan = event.measurement, event.plan
                self.done, self.total = event.done, event.total
                self.duration_s = event.duration_s
            case kinds.CheckLine():
                self._check(event)
            case kinds.LevelStarted():
                self.phase, self.run_in = "sweeping", 0
                self.source, self.source_vpk = SourceState.ON, event.source_vpk
            case kinds.RunIn():
                self.run_in += 1
            case kinds.PointStored():
                self._point(event)
            case kinds.Paused():
                started = self.phase == "sweeping" or not self.hold
                self.phase = "paused" if started else "ready"
                self.source, self.source_vpk = event.source_state, None
            case kinds.GoingOn():
                self.phase, self.hold = "sweeping", False
            case kinds.SourceSafe():
                self.source, self.source_vpk = event.state, None
                self.phase = "ending"
            case kinds.Warned():
                self.warnings.append(event.text)
            case kinds.Finished():
                self.finished, self.phase = event, "over"
                self.source, self.source_vpk = event.source_state, None
                self.elapsed_s = event.elapsed_s

    def end(self, error: Exception | None) -> None:
        """The session is gone, whether or not it said how it ended."""
        self.phase = "over"
        if self.finished is None:
            self.fault = error
            self.source_vpk = None
            if self.source is SourceState.ON:
                self.source = SourceState.UNKNOWN

    def _check(self, line: kinds.CheckLine) -> None:
        self.phase = "checking"
        self.checks.append(line)
        if line.name != "source":
            return
        if line.verdict == "pass":
            # What follows at once is the trial point, and nobody tells when it is over
            # before the source was made safe again: say "on" rather than too little.
            self.source = SourceState.CONFIRMED_OFF
            if self.plan is not None and self.done < self.total and not self.stop_asked:
                self.source, self.source_vpk = SourceState.ON, min(self.plan.levels_vpk)
        elif line.verdict == "fail":
            self.source = SourceState.UNCONFIRMED

    def _point(self, event: kinds.PointStored) -> None:
        stored = event.stored
        self.points[stored.source_vpk, stored.requested_hz] = stored
        self.latest, self.run_in = stored, 0
        self.done, self.total = event.done, event.total
        self.elapsed_s, self.remaining_s = event.elapsed_s, event.remaining_s
