"""The sweep of the demonstration: a real session, drawn as it goes.

Owns the plan and what is shown while it runs. The session, and that it ends
safe, is the engine's.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tui.demonstration.hidden import BAND_HZ
from tui.measurements.running import run_session
from tui.session_words import exit_code
from tui.text.bode_text import Point, bode_lines

if TYPE_CHECKING:
    from daq.session_events import Finished, SessionEvent
    from daq.session_request import SessionRequest
    from sim.unit import Unit
    from tui.text.output import Console

__all__ = ["Picture", "sweep"]

LEVELS_VPK = (1.5, 2.5, 4.0)
POINTS = 21
SETTLE_CYCLES, INTEGRATE_CYCLES = 15, 20


class Picture:
    """What has been measured, as a Bode plot in characters."""

    def __init__(self) -> None:
        self._levels: dict[float, list[Point]] = {}

    def add(self, source_vpk: float, frequency_hz: float, gain: complex) -> None:
        """One more point."""
        self._levels.setdefault(source_vpk, []).append((frequency_hz, gain))

    def lines(self) -> list[str]:
        """The plot, always of one height."""
        return bode_lines(self._levels, BAND_HZ)


def sweep(address: str, unit: Unit, history: Path, console: Console) -> tuple[Finished, Picture]:
    """Measure the unit at an address and keep it in a history.

    Raises
    ------
    LashbenchError
        As a session does; the source is off, or the message says that it may not be.
    """
    picture, request = Picture(), _request(address, unit, history)

    def tell(event: SessionEvent, console: Console) -> None:
        _show(event, picture, console)

    finished, fault = run_session(address, unit, history, request, console, tell)
    if fault is not None:
        raise fault
    exit_code(finished)  # refuses a source that is not proven off
    return finished, picture


def _request(address: str, unit: Unit, history: Path) -> SessionRequest:
    from tui.measure_options import PlanOptions, session_request

    options = PlanOptions(
        LEVELS_VPK, *BAND_HZ, POINTS, settle_cycles=SETTLE_CYCLES, integrate_cycles=INTEGRATE_CYCLES
    )
    remarks = {"serial": "DEMO", "operator": "demo", "notes": "SIMULATED: make demo"}
    return session_request(
        options, unit.name.lower(), unit, address, history,
        recipe=None, bench="default", resume=None, remeasure=None, run_in=None, remarks=remarks,
    )  # fmt: skip


def _show(event: SessionEvent, picture: Picture, console: Console) -> None:
    from daq import session_events as kinds

    match event:
        case kinds.CheckLine():
            console.note(f"  {event.verdict:4}  {event.name}: {event.text}")
        case kinds.LevelStarted():
            console.note(f"  sweeping {event.points} points at {event.source_vpk:g} V peak")
        case kinds.PointStored():
            point = event.stored.point
            picture.add(event.stored.source_vpk, point.frequency_hz, point.gain)
            console.picture(picture.lines())
            text = f"{event.done}/{event.total}  {point.frequency_hz:.2f} Hz"
            console.progress(event.done / event.total, text, event.remaining_s)
        case kinds.Warned():
            console.note(f"  warning: {event.text}")
