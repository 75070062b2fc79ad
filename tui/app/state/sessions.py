"""What the screens read of a bench's history, as functions that run beside them.

Owns which sessions a screen lists, how one is read, and how its remarks are corrected. It draws
nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from daq.errors import LashbenchError
from daq.servers.place import HistoryPlace, is_there
from tui.app.state.listing import Listed

if TYPE_CHECKING:
    from analysis.acceptance import Judgement, LimitSet
    from daq.frf import FrequencyResponse
    from daq.store_records import HistoryLine, Measurement
    from tui.judging import LimitsChoice

__all__ = [
    "audit_trail",
    "correct_session",
    "judge_sessions",
    "latest_complete",
    "one_session",
    "recent_sessions",
    "responses_of",
    "rows_of_history",
]

_RECENT = 20
_LISTED = 200


def recent_sessions(db: HistoryPlace) -> list[HistoryLine]:
    """The latest sessions with points, interrupted ones first; none where there is no history.

    One more than a screen lists, which may leave out the one that is under way.

    Raises
    ------
    LashbenchError
        As `daq.store.Store`.
    """
    from daq.store import Store

    if not is_there(db):
        return []
    with Store(db, read_only=True) as store:
        lines = store.lines(last=_RECENT + 1, with_points=True)
    return sorted(lines, key=lambda line: (line.state != "interrupted", -line.id))


def one_session(db: HistoryPlace, measurement: int) -> Measurement:
    """A stored measurement; raises as `daq.store.Store`."""
    from daq.store import Store

    with Store(db, read_only=True) as store:
        return store.measurement(measurement)


def latest_complete(
    db: HistoryPlace, unit: str, serial: str, but: int | None
) -> tuple[int, FrequencyResponse] | None:
    """The latest complete session of a unit, of the same serial number before others.

    Raises
    ------
    LashbenchError
        As `daq.store.Store`.
    """
    from daq.store import Store

    if not is_there(db):
        return None
    with Store(db, read_only=True) as store:
        for of in (serial, None):
            lines = store.lines(unit, of, with_points=True)
            found = [one.id for one in lines if one.state == "complete" and one.id != but]
            if found:
                return found[-1], store.response(found[-1])
    return None


def responses_of(db: HistoryPlace, measurements: list[int]) -> list[FrequencyResponse]:
    """The responses of stored measurements, in that order; raises as `daq.store.Store`."""
    from daq.store import Store

    with Store(db, read_only=True) as store:
        return [store.response(measurement) for measurement in measurements]


def audit_trail(db: HistoryPlace, measurement: int) -> list[str]:
    """What was corrected of a measurement, a line each; raises as `daq.store.Store`."""
    from daq.store import Store
    from tui.measurements.history_rows import correction_words

    with Store(db, read_only=True) as store:
        trail = store.corrections(measurement)
    return [f"#{measurement}: {correction_words(one)}" for one in trail]


def correct_session(
    db: HistoryPlace, measurement: int, person: str, changes: Mapping[str, str]
) -> list[str]:
    """Correct serial number, operator or notes; names of what was, once it is committed.

    Raises
    ------
    LashbenchError
        As `daq.store.Store.correct`; nothing was corrected.
    """
    from daq.store import Store

    with Store(db) as store:
        return [one.field for one in store.correct(measurement, person, changes)]


def rows_of_history(
    db: HistoryPlace, unit: str | None, search: str, choice: LimitsChoice
) -> Listed:
    """The latest sessions with points, of one unit or of all, and the trends in words.

    Parameters
    ----------
    search
        Words that each has (`daq.store.listing.Choice`); empty for all.
    choice
        What they are judged by, and what alarms of a trend are about.
    """
    from daq.store import Store
    from tui.measurements.history_rows import Trends, measurement_row, trend_lines

    if not is_there(db):
        return Listed()
    with Store(db, read_only=True) as store:
        lines = store.lines(unit, last=_LISTED, with_points=True, search=search)
    rows = [measurement_row(line) for line in lines]
    limits, fault = None, ""
    try:
        limits = choice.read()
    except LashbenchError as error:
        fault = str(error)
    # A unit's own limits are not those of another.
    is_for_all = limits is not None and (not limits.unit or limits.unit == unit)
    trends = Trends(rows, limits.limits if limits is not None and is_for_all else None)
    told = [line for line in trend_lines(trends.rows()) if line]
    return Listed(lines, rows, told, limits, fault)


def judge_sessions(
    db: HistoryPlace, lines: Sequence[HistoryLine], limits: LimitSet
) -> dict[int, Judgement]:
    """Judge sessions by what the history holds, by number; raises as `daq.store.Store`."""
    from daq.store import Store
    from tui.measurements.judging import judge_line

    with Store(db, read_only=True) as store:
        return {line.id: judge_line(store, line, limits) for line in lines}
