"""What speaks against a set of causes by itself.

Owns the limits beyond which a set is no explanation, whatever the others do, fixed on simulated
sets before any practice set was judged by them, but for one (`_STRUCTURED`; docs/decisions, 16)
and what a jump is forgiven (the same record). It ranks nothing.
"""

from __future__ import annotations

import numpy as np

from analysis.checking.cross_validation import HeldOut
from analysis.checking.goodness_of_fit import Adequacy, misses_alike
from analysis.checking.plausibility import is_out_of_sight, is_pressed
from analysis.emulation.fitted_model import FittedModel

__all__ = ["FEW", "OUT_OF_SIGHT", "UNLIKE", "find_rejection"]

OUT_OF_SIGHT = "resonates outside the measured band"

UNLIKE, _THREE_UNLIKE = 4.0, 2.0
"""A fit worse than own runs' by more standard deviations than this is no explanation, nor is that
of more than `FEW` causes by more than the second: three lags and gains of the chain make up nearly
any filter. Both threes that were named for what was not there were worse by 2.5; of 147 sets of one
cause or two that were named one was worse by more than 2."""

_STRUCTURED = 2.5
"""Nor is one whose fit leaves more structure than own runs' by so many: of past sets' leaders
22 of 38 wrong ones did, and of 78 right ones a payload alone of which all runs lay beside it."""

_UNPREDICTED = 1.5
"""Nor is one that misses levels not fitted by so many standard deviations, root mean square."""

_NEVER, _SELDOM = 2.0, 0.03
"""The baseline, or a single cause, may miss them by as many as the first of these, where a larger
share of its own runs than the second does so, too: a payload of four parameters, and chatter at
low drive, are not easily told from other levels."""

_WELL_PREDICTED = 1.0
"""Several causes together can fit nearly anything: where they miss levels not fitted by more than
this, some of their own runs must do so, too."""

FEW = 2
"""More causes than this must miss them by no more than that, whatever their own runs do: three
that fitted where one of them was another's stand-in missed them by 1.13 and 1.24."""


def find_rejection(
    candidate: FittedModel, held_out: HeldOut, fitted: Adequacy, rng: np.random.Generator
) -> str:
    """Why a set is no explanation, whatever the others do; empty where it may be one.

    Parameters
    ----------
    candidate, held_out
        The set, and what it predicts of levels not fitted.
    fitted
        How its fit compares with those of its own runs.
    """
    causes, missed = len(candidate.hypothesis.effects), held_out.missed
    several = causes > 1
    if fitted.sigma > (UNLIKE if causes <= FEW else _THREE_UNLIKE):
        return "fits worse than replicates of this model"
    if fitted.structure > _STRUCTURED:
        return "leaves a residual pattern that replicates do not"
    if is_pressed(candidate):
        return "needs a size outside its plausible range"
    if is_out_of_sight(candidate):
        return OUT_OF_SIGHT
    predicted = missed <= (_WELL_PREDICTED if several else _UNPREDICTED)
    if not predicted and (
        missed > (_UNPREDICTED if several else _NEVER)
        or causes > FEW
        or not misses_alike(candidate, held_out, 0.0 if several else _SELDOM, rng)
    ):
        return "does not predict held-out levels"
    return ""
