"""Pictures of one or several responses, with the model beside them.

Owns what such a picture shows and how it is written. It estimates nothing and opens no window.
"""

from __future__ import annotations

from analysis.drawing.picture import PICTURES, checked_picture, save_picture
from analysis.plots.overlay import Curve, draw_overlay, save_overlay
from analysis.plots.predicted import predicted

__all__ = [
    "PICTURES",
    "Curve",
    "checked_picture",
    "draw_overlay",
    "predicted",
    "save_overlay",
    "save_picture",
]
