"""A plot without keys and mouse of its own: the screen around it decides what it shows.

Owns the margins that all plots here share.
"""

from __future__ import annotations

from textual_plot import PlotWidget

__all__ = ["LEFT", "Panel"]

LEFT = 7
"""Columns left of the axis, for the labels of its ticks."""


class Panel(PlotWidget, can_focus=False, inherit_bindings=False):
    """Axes and what is drawn on them."""

    def __init__(self, id: str) -> None:
        super().__init__(id=id, allow_pan_and_zoom=False)

    def on_mount(self) -> None:
        """Little room for anything but the plot."""
        super().on_mount()
        self.margin_top, self.margin_bottom, self.margin_left = 0, 1, LEFT
