"""Sweeps that go on where it matters: coarse first, then around anti-resonance and resonance.

Owns the choice of the next frequencies by ask and tell, and the budget. Where
the features are and how sure that is, a `judge` says that is handed in from
above; this module knows no physics and drives nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from daq.analyser import SweepPoint
from daq.errors import InputError
from daq.frf import PointFlag
from daq.plan import SweepPlan

__all__ = ["AdaptiveSweep", "Cost", "Feature", "Judge", "Refinement"]


class Feature(NamedTuple):
    """An anti-resonance or resonance as known so far, Hz; NaN where not known."""

    feature_hz: float
    std_hz: float
    width_hz: float
    """Width of the dip or peak: new points go no farther from it than this."""


Judge = Callable[[Sequence[SweepPoint]], Sequence[tuple[float, float, float]]]
"""Finds the features (frequency, its standard deviation, width; Hz) in the points so far."""


@dataclass(frozen=True, slots=True)
class Refinement:
    """When to stop, and how fine to go.

    Parameters
    ----------
    target_std_hz
        Go on until every feature's standard deviation is at or below this, Hz.
    budget_points
        Points in all, those of the coarse sweep included.
    features
        How many features there are to find.
    round_points
        New points per unsettled feature before the judge is asked again.
    grid_hz
        Frequencies closer than this are the same to the instrument, Hz.

    Raises
    ------
    InputError
        If a value cannot be meant.
    """

    target_std_hz: float
    budget_points: int
    features: int = 2
    round_points: int = 4
    grid_hz: float = 1.0 / 64.0

    def __post_init__(self) -> None:
        if not self.target_std_hz > 0 or not math.isfinite(self.target_std_hz):
            raise InputError(f"refinement: target {self.target_std_hz} Hz must be above 0")
        if min(self.budget_points, self.features, self.round_points) < 1 or not self.grid_hz > 0:
            raise InputError("refinement: budget, features, points a round and grid are above 0")


@dataclass(frozen=True, slots=True)
class Cost:
    """Points and driving time of one level of a plan, at least and at most."""

    least_points: int
    most_points: int
    least_s: float
    most_s: float

    def __str__(self) -> str:
        return (
            f"{self.least_points} points in {self.least_s:.0f} s, at most {self.most_points} "
            f"points in {self.most_s:.0f} s"
        )


class AdaptiveSweep:
    """One level of a plan, refined by ask and tell.

    Parameters
    ----------
    plan
        Its frequencies are the coarse sweep.
    refinement
        When to stop.
    judge
        See `Judge`.

    Raises
    ------
    InputError
        If the budget does not cover the coarse sweep.

    Examples
    --------
    >>> plan = SweepPlan((10.0, 20.0, 30.0), (1.0,))
    >>> sweep = AdaptiveSweep(plan, Refinement(0.1, 5), lambda points: [])
    >>> sweep.ask()
    (10.0, 20.0, 30.0)
    """

    def __init__(self, plan: SweepPlan, refinement: Refinement, judge: Judge) -> None:
        if refinement.budget_points < len(plan.frequencies_hz):
            raise InputError(
                f"a budget of {refinement.budget_points} points does not cover the coarse sweep of "
                f"{len(plan.frequencies_hz)}; give more points or a coarser sweep"
            )
        self._plan = plan
        self._refinement = refinement
        self._judge = judge
        self._points: list[SweepPoint] = []
        self._asked = 0
        self.features: tuple[Feature, ...] = ()
        """As last judged."""

    def cost(self, overhead_s: float = 0.0) -> Cost:
        """What it will take, before it starts.

        Parameters
        ----------
        overhead_s
            Time a point takes besides its cycles, s.
        """
        plan, budget = self._plan, self._refinement.budget_points
        coarse = len(plan.frequencies_hz)
        cycles = plan.settle_cycles + plan.integrate_cycles
        least_s = cycles * sum(1.0 / hz for hz in plan.frequencies_hz) + overhead_s * coarse
        slowest_s = cycles / min(plan.frequencies_hz) + overhead_s
        return Cost(coarse, budget, least_s, least_s + (budget - coarse) * slowest_s)

    @property
    def points(self) -> tuple[SweepPoint, ...]:
        """All points told so far."""
        return tuple(self._points)

    @property
    def settled(self) -> bool:
        """Whether every feature was found and is known well enough."""
        known = [self._is_settled(feature) for feature in self.features]
        return len(known) >= self._refinement.features and all(known)

    @property
    def reason(self) -> str | None:
        """Why it is over, None while it is not."""
        if self._asked == 0 or self._asked > len(self._points):
            return None
        if self.settled:
            return "target reached"
        if self._asked >= self._refinement.budget_points:
            return "budget spent"
        return None

    def ask(self) -> tuple[float, ...]:
        """The next frequencies in the order to be visited, Hz; empty when it is over.

        Raises
        ------
        InputError
            If the frequencies asked for before were not all told.
        """
        if self._asked == 0:
            wanted = [float(hz) for hz in self._plan.frequencies_hz]
        elif self._asked > len(self._points):
            missing = self._asked - len(self._points)
            raise InputError(f"adaptive sweep: {missing} points asked for were not told yet")
        elif self.reason is not None:
            return ()
        else:
            wanted = self._refined()
        self._asked += len(wanted)
        return tuple(sorted(wanted, reverse=self._plan.direction == "down"))

    def tell(self, points: Sequence[SweepPoint]) -> None:
        """Take in measured points, spoilt ones included; judged when all asked for are here."""
        self._points.extend(points)
        if len(self._points) >= self._asked:
            self._asked = len(self._points)
            usable = [point for point in self._points if not point.flags & PointFlag.SPOILT]
            usable.sort(key=lambda point: point.frequency_hz)
            self.features = tuple(Feature(*feature) for feature in self._judge(usable))

    def _is_settled(self, feature: Feature) -> bool:
        return feature.std_hz <= self._refinement.target_std_hz  # NaN is not

    def _refined(self) -> list[float]:
        """New frequencies: around each unsettled feature, and anywhere while one is not found."""
        refinement, plan = self._refinement, self._plan
        low_hz, high_hz = min(plan.frequencies_hz), max(plan.frequencies_hz)
        regions = []
        for feature in self.features:
            if math.isfinite(feature.feature_hz) and not self._is_settled(feature):
                regions.append(self._region(feature, low_hz, high_hz))
        found = sum(math.isfinite(feature.feature_hz) for feature in self.features)
        if found < refinement.features or not regions:
            regions.append((low_hz, high_hz))
        left = refinement.budget_points - self._asked
        visits = [point.frequency_hz for point in self._points]
        wanted: list[float] = []
        for turn in range(min(left, refinement.round_points * len(regions))):
            wanted.append(self._next_in(regions[turn % len(regions)], visits + wanted))
        return wanted

    def _region(self, feature: Feature, low_hz: float, high_hz: float) -> tuple[float, float]:
        centre_hz = min(max(feature.feature_hz, low_hz), high_hz)
        width_hz = feature.width_hz if feature.width_hz > 0 else 0.0  # NaN is not
        # Never less than the gaps beside it: the true place may lie in either.
        below = [hz for hz in self._plan.frequencies_hz if hz < centre_hz]
        above = [hz for hz in self._plan.frequencies_hz if hz > centre_hz]
        from_hz = max(low_hz, min(centre_hz - width_hz, below[-1] if below else low_hz))
        to_hz = min(high_hz, max(centre_hz + width_hz, above[0] if above else high_hz))
        return from_hz, to_hz

    def _next_in(self, region: tuple[float, float], visited: Sequence[float]) -> float:
        """The middle of the widest gap; where all are closed, the least visited place again."""
        from_hz, to_hz = region
        grid = self._refinement.grid_hz
        inside = sorted({from_hz, to_hz, *(hz for hz in visited if from_hz <= hz <= to_hz)})
        gaps = [(high - low, low) for low, high in zip(inside, inside[1:], strict=False)]
        widest, low = max(gaps, default=(0.0, from_hz))
        if widest >= 2.0 * grid:
            return low + widest / 2.0
        return min(inside, key=lambda place: sum(abs(hz - place) < grid for hz in visited))
