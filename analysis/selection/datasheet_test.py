"""Whether what is named is off its datasheet for sure, as far as its error bar tells.

Owns the last question before a cause is named. A size that is not significantly different from the
datasheet explains nothing, however well runs of the cause fit: they were given where the
measurement is, and the plain model's were not. It simulates nothing; how well the size is known is
told to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.fitted_model import Effects
from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.model import Hypothesis
from analysis.selection.verdict import (
    WITHIN_TOLERANCE,
    Judged,
    Verdict,
    Word,
    rank_behind,
)
from sim.catalogue import CATALOGUE

Vector = NDArray[np.float64]

__all__ = ["AS_THE_DATASHEET", "compare_with_datasheet"]

AS_THE_DATASHEET = "not significantly different from the datasheet"

_SURELY = 2.0
"""Standard deviations by which a value must be off its datasheet. Of 45 that were rightly named
the least was off by 2.9, with as many runs as it gets; some of causes that were not there by 0.1 to
1.6: a shaft of a servo that hides nothing led the plain model by 72."""


def compare_with_datasheet(verdict: Verdict, found: ParameterPosterior) -> Verdict:
    """A verdict, or what is left of it where a value that it names may be the datasheet's.

    Parameters
    ----------
    verdict
        That names something, or not: then it stays.
    found
        Coordinates (d,) of its best set, and their covariance, from all the runs that it gets.

    Returns
    -------
    Verdict
        If all of it is within the tolerance of the datasheet, that nothing is missing. If the best
        set is of one cause, that nothing is missing, or that nothing explains it where
        the plain model does not. If it is of several, that the rest is named: the whole is the rest
        where it has that value as the datasheet does. Where the rest by its own runs is refused, or
        behind a set that does not hold it, it is a rival of the whole.
    """
    best = verdict.best
    named = verdict.word in ("explained", "ambiguous")
    if named and best.candidate.hypothesis.is_tolerance(found.mean):
        judged = rank_behind(verdict.judged, [best], verdict.baseline, WITHIN_TOLERANCE)
        baseline = _among(judged, ())
        return Verdict("consistent", baseline, judged, baseline)
    unsure = _unsure(best.candidate.hypothesis, found)
    rest = tuple(effect for effect in best.effects if effect not in unsure)
    if not named or not unsure:
        return verdict
    if rest:
        return _with_part(verdict, rest)
    judged = rank_behind(verdict.judged, [best], verdict.baseline, AS_THE_DATASHEET)
    baseline = _among(judged, ())
    word: Word = "consistent" if baseline.adequate else "unexplained"
    return Verdict(word, baseline, judged, baseline)


def _with_part(verdict: Verdict, rest: Effects) -> Verdict:
    """The rest of the best set named before the whole if it leads all others, or its rival.

    Sets that hold the rest are no others: with its sizes as the datasheet has them, each is the
    rest.
    """
    best, judged = verdict.best, verdict.judged
    part = next((one for one in judged if one.effects == rest), None)
    if part is None:
        return verdict
    others = [one for one in judged if one.adequate and not set(one.effects) > set(rest)]
    if part.adequate and part.score >= max(one.score for one in others):
        judged = rank_behind(judged, [best], part, AS_THE_DATASHEET)
        baseline = _among(judged, ())
        apart = (one for one in verdict.rivals if not set(one.effects) > set(rest))
        rivals = tuple(_among(judged, one.effects) for one in apart)
        word: Word = "ambiguous" if rivals else "explained"
        return Verdict(word, _among(judged, rest), judged, baseline, rivals)
    rival = replace(part, objection="")
    judged = tuple(rival if one is part else one for one in judged)
    rivals = tuple(_among(judged, one.effects) for one in (*verdict.rivals, rival))
    return Verdict("ambiguous", best, judged, _among(judged, ()), rivals)


def _among(judged: Sequence[Judged], effects: Effects) -> Judged:
    return next(one for one in judged if one.effects == effects)


def _unsure(hypothesis: Hypothesis, found: ParameterPosterior) -> set[str]:
    """Effects of which every size is a datasheet value, and is not surely off it.

    Of several, those too that are there in proportion to their first size, where that reaches the
    lower end of its range.
    """
    # Off by more than the datasheet may be, too.
    std = np.hypot(np.sqrt(np.diag(found.covariance))[1:], hypothesis.spread)
    # What the datasheet says nothing of is no number, and not near to it.
    near = np.abs(found.mean[1:] - hypothesis.datasheet) <= _SURELY * std
    sure = {effect for (effect, _), one in zip(hypothesis.parameters, near, strict=True) if not one}
    surely_there = sure - _may_be_none(hypothesis, found.mean[1:], std)
    # One of them is there: where each may be none, none is dropped for that.
    return set(hypothesis.effects) - (surely_there or sure)


def _may_be_none(hypothesis: Hypothesis, sizes: Vector, std: Vector) -> set[str]:
    """Effects whose first size, in proportion to which they are there, may be the lowest."""
    first = {effect: CATALOGUE[effect].parameters[0] for effect in hypothesis.effects}
    return {
        effect
        for (effect, one), size, error in zip(hypothesis.parameters, sizes, std, strict=True)
        if one is first[effect]
        and one.allowed[0] == 0.0
        and one.nominal(hypothesis.unit) is None
        and size <= _SURELY * error
    }
