"""The steps, one screen each, in the order of the way through."""

from collections.abc import Callable
from typing import Any

from textual.screen import Screen

from tui.app.screens.check_screen import CheckScreen
from tui.app.screens.diagnosis_screen import DiagnosisScreen
from tui.app.screens.history_screen import HistoryScreen
from tui.app.screens.instrument_screen import InstrumentScreen
from tui.app.screens.result_screen import ResultScreen
from tui.app.screens.sweep_screen import SweepScreen
from tui.app.screens.unit_screen import UnitScreen

__all__ = ["SCREENS"]

SCREENS: dict[str, Callable[[], Screen[Any]]] = {
    "unit": UnitScreen,
    "instrument": InstrumentScreen,
    "check": CheckScreen,
    "sweep": SweepScreen,
    "result": ResultScreen,
    "diagnosis": DiagnosisScreen,
    "history": HistoryScreen,
}
"""The screen of each step by name."""
