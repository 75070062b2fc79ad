"""The search for the sweep that tells most of the unit on the desk, beside the screen.

Owns how far it is, that it can be given up, and for which unit and bench its result holds. The
choice is the analysis's; whether the sweep may be driven, the limits decide when it is taken.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from daq.errors import LashbenchError

if TYPE_CHECKING:
    from analysis.planning import Planned
    from sim.unit import Unit
    from tui.app.state.background import Beside
    from tui.app.state.desk import Desk

__all__ = ["Planner", "PlanSearch", "find_plan"]

Progress = Callable[[float, str], None]
Planner = Callable[["Unit", float, Progress], "Planned"]


def find_plan(unit: Unit, minutes: float, progress: Progress) -> Planned:
    """The sweep of so many minutes; raises as `analysis.planning.plan_sweep`."""
    from analysis.planning import plan_sweep

    return plan_sweep(unit, minutes, progress=progress)


class _GivenUp(Exception):
    """Ends a search that nobody waits for any more."""


class PlanSearch:
    """One search at a time.

    Parameters
    ----------
    planner
        What is called, with a unit within the limits of the bench, minutes and progress.
    """

    def __init__(self, planner: Planner = find_plan) -> None:
        self._planner = planner
        self._given_up = threading.Event()
        self._for: tuple[Unit | None, str] = (None, "")
        self.is_running = False
        self.share = 0.0
        """How far it is, 0 to 1."""
        self.minutes = 0.0
        self.fault = ""
        """Why there is none, in one line."""
        self._found: Planned | None = None

    def begin(self, beside: Beside, desk: Desk, minutes: float, told: Callable[[], None]) -> None:
        """Search for the unit and the bench on a desk; `told` is called when it is over."""
        unit, bench = desk.unit, desk.bench
        if unit is None:
            return
        given_up = self._given_up = threading.Event()
        self._for, self.minutes, self._found, self.fault = (unit, bench), minutes, None, ""
        self.is_running, self.share = True, 0.0

        def progress(share: float, _text: str = "") -> None:
            if given_up.is_set():
                raise _GivenUp
            self.share = share

        def work() -> Planned | None:
            from daq.limits import load_bench
            from tui.unit_under_test import within_bench

            try:
                allowed = within_bench(unit, load_bench(bench).bounds())
                return self._planner(allowed, minutes, progress)
            except _GivenUp:
                return None
            finally:
                if self._given_up is given_up:
                    self.is_running = False

        def over(found: Planned | None) -> None:
            if not given_up.is_set():
                self._found = found
                told()

        def refused(error: LashbenchError) -> None:
            if not given_up.is_set():
                self.fault = str(error)
                told()

        beside.do("best plan", work, over, "No plan was found", refused)

    def stop(self) -> None:
        """End it, at its next word; nothing comes of it."""
        self._given_up.set()
        self.is_running = False

    def found(self, desk: Desk) -> Planned | None:
        """What was found, where the desk still has the unit and the bench that it is for."""
        unit, bench = self._for
        return self._found if unit is desk.unit and bench == desk.bench else None

    def put_away(self) -> None:
        """It was taken, or is not wanted."""
        self._found, self.fault = None, ""
