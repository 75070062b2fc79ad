"""Whether what is named differs from the datasheet at all.

Owns that question, which is asked before a cause is named: values within tolerance, or not
significantly different from the datasheet, explain nothing, however well runs of them fit. It
simulates nothing; how well the sizes are known is told to it.
"""

from __future__ import annotations

import numpy as np

from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.selection.verdict import WITHIN_TOLERANCE, Verdict, Word, rank_behind

__all__ = ["AS_THE_DATASHEET", "compare_with_datasheet"]

AS_THE_DATASHEET = "not significantly different from the datasheet"

_SURELY = 2.0
"""Standard deviations by which a value must be off its datasheet. Of 45 that were rightly named
the least was off by 2.9; some of causes that were not there by 0.1 to 1.6: a shaft of a servo that
hides nothing led the plain model by 72."""


def compare_with_datasheet(verdict: Verdict, found: ParameterPosterior) -> Verdict:
    """A verdict, or that of the plain model where all that is named may be the datasheet's.

    Parameters
    ----------
    verdict
        That names something, or not: then it stays.
    found
        Coordinates (d,) of its best set, and their covariance, from all the runs that it gets.

    Returns
    -------
    Verdict
        That nothing is missing, where all of it is within tolerance. Where it may be the
        datasheet's by its error bars: what the plain model alone comes to.
    """
    if verdict.word != "explained":
        return verdict
    hypothesis = verdict.best.candidate.hypothesis
    within = hypothesis.is_tolerance(found.mean)
    # Off by more than the datasheet may be, too. A value of which the datasheet says nothing is no
    # number, and near to none.
    std = np.hypot(np.sqrt(np.diag(found.covariance))[1:], hypothesis.spread)
    near = np.abs(found.mean[1:] - hypothesis.datasheet) <= _SURELY * std
    if not (within or near.all()):
        return verdict
    objection = WITHIN_TOLERANCE if within else AS_THE_DATASHEET
    judged = rank_behind(verdict.judged, [verdict.best], verdict.baseline, objection)
    baseline = next(one for one in judged if not one.effects)
    word: Word = "consistent" if within or baseline.adequate else "unexplained"
    return Verdict(word, baseline, judged, baseline)
