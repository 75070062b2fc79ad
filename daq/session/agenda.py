"""What a session still has to measure: missing points, the run-in before them, time left.

Owns the bookkeeping of points by level and frequency asked for. It drives
nothing and stores nothing; it is told what is stored.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence

from daq.plan import SweepPlan
from daq.store_records import StoredPoint

__all__ = ["Agenda", "Pace"]


class Agenda:
    """The points of a plan, those stored and those to come.

    Parameters
    ----------
    plan
        What is to be measured.
    stored
        Points in force from an earlier session.
    remeasure_hz
        Band whose points are to be measured again although they are stored.
    """

    def __init__(
        self,
        plan: SweepPlan,
        stored: Iterable[StoredPoint] = (),
        remeasure_hz: tuple[float, float] | None = None,
    ) -> None:
        self._plan = plan
        self._cycles = plan.settle_cycles + plan.integrate_cycles
        self._stored = {(point.source_vpk, point.requested_hz): point for point in stored}
        self._missing: set[tuple[float, float]] = set()
        self._left_s = 0.0
        self.again = 0
        """Stored points that are to be measured again."""
        if remeasure_hz is not None:
            low_hz, high_hz = remeasure_hz
            self._add(key for key in self._stored if low_hz <= key[1] <= high_hz)
            self.again = len(self._missing)
        for level in plan.levels_vpk:
            self.extend(level, [float(hz) for hz in plan.visited_hz])

    @property
    def total(self) -> int:
        """Points stored and missing, of the plan and of refinement so far."""
        return len(self._stored.keys() | self._missing)

    @property
    def done(self) -> int:
        """Points that need not be measured any more."""
        return self.total - len(self._missing)

    @property
    def finished(self) -> bool:
        """Whether nothing is missing of what was asked for so far."""
        return not self._missing

    @property
    def remaining_cycles_s(self) -> float:
        """Driving time of the missing points without the instrument's overhead, s."""
        return max(0.0, self._left_s) if self._missing else 0.0

    def extend(self, source_vpk: float, frequencies_hz: Iterable[float]) -> None:
        """Take in points that are asked for; those that are stored need nothing."""
        places = ((source_vpk, hz) for hz in frequencies_hz)
        self._add(place for place in places if place not in self._stored)

    def store(self, point: StoredPoint) -> None:
        """Take in a point that was committed."""
        place = (point.source_vpk, point.requested_hz)
        self._stored[place] = point
        if place in self._missing:
            self._missing.discard(place)
            self._left_s -= self._cycles / point.requested_hz

    def stored(self, source_vpk: float, requested_hz: float) -> StoredPoint:
        """The stored point of that level and frequency asked for."""
        return self._stored[source_vpk, requested_hz]

    def next_run(self, source_vpk: float, frequencies_hz: Sequence[float]) -> list[float]:
        """The first stretch of missing neighbours, in the order given; empty if none is."""
        run: list[float] = []
        for hz in frequencies_hz:
            if (source_vpk, hz) in self._missing:
                run.append(hz)
            elif run:
                break
        return run

    def first_missing(self) -> tuple[float, float] | None:
        """Level and frequency of the plan's first missing point, None if none is."""
        for level in self._plan.levels_vpk:
            run = self.next_run(level, [float(hz) for hz in self._plan.visited_hz])
            if run:
                return level, run[0]
        return None

    def run_in(self, source_vpk: float, first_hz: float, points: int | None) -> list[float]:
        """Stored frequencies that an unbroken sweep would have visited just before, in order.

        Parameters
        ----------
        points
            At most so many; None for all of the level.
        """
        down = self._plan.direction == "down"
        before = [
            hz
            for level, hz in self._stored
            if level == source_vpk and (hz > first_hz if down else hz < first_hz)
        ]
        nearest = sorted(before, reverse=not down)[:points]
        return nearest[::-1]

    def coarse_run_in(self, source_vpk: float, first_hz: float, points: int) -> list[float]:
        """As `run_in`, of the plan's own frequencies only: refined ones lie too close together."""
        coarse = {float(hz) for hz in self._plan.frequencies_hz}
        lead = [hz for hz in self.run_in(source_vpk, first_hz, None) if hz in coarse]
        return lead[-points:]

    def _add(self, places: Iterable[tuple[float, float]]) -> None:
        for place in places:
            if place not in self._missing:
                self._missing.add(place)
                self._left_s += self._cycles / place[1]


class Pace:
    """How fast driving goes compared with the cycles alone, from the points so far."""

    def __init__(self) -> None:
        self._latest_s: float | None = None
        self._taken_s = 0.0
        self._driven_s = 0.0

    def held(self) -> None:
        """Nothing was measured for a while: the next point comes after work that others do not."""
        self._latest_s = None

    def remaining_s(self, driven_s: float, left_s: float) -> float:
        """Time left, given the cycles of the point just taken and of all points to come, s."""
        now_s = time.monotonic()
        # The first point came after set-up work that the others will not repeat.
        if self._latest_s is not None:
            self._taken_s += now_s - self._latest_s
            self._driven_s += driven_s
        self._latest_s = now_s
        return left_s * self._taken_s / self._driven_s if self._driven_s > 0 else left_s
