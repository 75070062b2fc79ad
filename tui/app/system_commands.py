"""The entries of the command palette: steps, the keys of the step on top, stopping, copying.

Owns their wording. What they do is the application's and the step's.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING

from textual.app import SystemCommand
from textual.screen import Screen

from tui.app.step_screen import STEPS

if TYPE_CHECKING:
    from tui.app.app_state import AppState

__all__ = ["system_commands"]


def system_commands(app: AppState, screen: Screen) -> Iterable[SystemCommand]:
    """Entries of our own, for the screen on top."""
    yield SystemCommand("Source: stop", "End whatever drives", app.action_stop_source)
    yield SystemCommand("Copy: what is shown", "To the clipboard", app.action_copy)
    for number, name in enumerate(STEPS, start=1):
        yield SystemCommand(f"Go to: {name}", f"Step {number}", partial(app.go, number))
    for binding in screen.active_bindings.values():
        if binding.node is screen and binding.binding.description:
            action = partial(screen.run_action, binding.binding.action)
            described = binding.binding.tooltip or f"key {binding.binding.key}"
            yield SystemCommand(f"Step: {binding.binding.description}", described, action)
