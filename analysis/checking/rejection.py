"""What speaks against a set of causes by itself.

Owns the limits beyond which a set is no explanation, whatever the others do (docs/decisions, 16).
It ranks nothing and simulates nothing.
"""

from __future__ import annotations

from analysis.checking.cross_validation import HeldOut
from analysis.checking.goodness_of_fit import Adequacy
from analysis.checking.plausibility import is_out_of_sight, is_pressed
from analysis.emulation.fitted_model import FittedModel

__all__ = ["OUT_OF_SIGHT", "find_rejection"]

OUT_OF_SIGHT = "resonates outside the measured band"

_UNLIKE = 4.0
"""A fit worse than own runs' by more standard deviations than this is no explanation."""

_STRUCTURED = 2.5
"""Nor is one whose fit leaves more structure than own runs' by so many: of past sets' leaders
22 of 38 wrong ones did, and of 78 right ones a payload alone of which all runs lay beside it."""

_UNPREDICTED = 1.5
"""Nor is one that misses levels not fitted by so many standard deviations, root mean square."""


def find_rejection(candidate: FittedModel, held_out: HeldOut, fitted: Adequacy) -> str:
    """Why a set is no explanation, whatever the others do; empty where it may be one.

    Parameters
    ----------
    candidate, held_out
        The set, and what it predicts of levels not fitted.
    fitted
        How its fit compares with those of its own runs.
    """
    if fitted.sigma > _UNLIKE:
        return "fits worse than replicates of this model"
    if fitted.structure > _STRUCTURED:
        return "leaves a residual pattern that replicates do not"
    if is_pressed(candidate):
        return "needs a size outside its plausible range"
    if is_out_of_sight(candidate):
        return OUT_OF_SIGHT
    if held_out.missed > _UNPREDICTED:
        return "does not predict held-out levels"
    return ""
