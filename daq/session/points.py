"""What a session takes of a running sweep: its next point, or an early end.

Owns that a sweep which ends too soon is an error. It drives nothing itself.
"""

from __future__ import annotations

from collections.abc import Iterator

from daq.analyser import SweepPoint
from daq.errors import MeasurementError

__all__ = ["end_early", "next_point"]


def next_point(points: Iterator[SweepPoint], requested_hz: float) -> SweepPoint:
    """The next point of a sweep.

    Raises
    ------
    MeasurementError
        If the sweep has ended.
    """
    point = next(points, None)
    if point is None:
        raise MeasurementError(
            f"the instrument ended its sweep before the point at {requested_hz:g} Hz"
        )
    return point


def end_early(points: Iterator[SweepPoint]) -> None:
    """End a sweep before its last point; one that ended takes no notice."""
    close = getattr(points, "close", None)
    if close is not None:
        close()
