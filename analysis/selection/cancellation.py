"""What speaks against what is named, once its sizes are known by all the runs that it gets.

Owns the last questions before several causes, or a resonance, are named for sure. Where each of
several causes alone, at its size, takes the machine further from the measurement than it was, what
was measured is a small difference of large ones: something that nobody thought of is likelier than
two faults that happen to cancel. And a resonance may turn out to lie where nothing was measured.
That a value is the datasheet's is `analysis.selection.datasheet_test`'s.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.checking.plausibility import is_out_of_sight
from analysis.checking.rejection import OUT_OF_SIGHT
from analysis.ensemble.model import Hypothesis
from analysis.ensemble.runs import Group, Population, simulate_groups
from analysis.execution.executor import Executor
from analysis.observation.observation import Observation
from analysis.selection.verdict import Verdict

__all__ = ["UNDOING", "cancellation_ratio", "confirm_causes"]

UNDOING = "its causes cancel each other"

_LEFT = 0.65
"""Share of what the least of several causes does alone that is left where they undo one another. Of
sixty pairs drawn at a bench's sizes the least left 0.78, and fifty-six 1.0 or more. A weak
amplifier with a stronger motor, which brakes itself, left 0.47: that was grease in the motor."""

_RUNS, _GROUPS = 5, 2
"""Machines in a group, and groups, which are off the datasheet in opposite ways."""

_FAR = 1.0
"""Log gain, or phase in rad, beyond which a row is as far off as it can be: where a resonance moves
to says more than how deep it is."""

_NOTHING = 1e-6
"""The same, below which two responses are one."""


def confirm_causes(
    verdict: Verdict,
    place: NDArray[np.float64],
    observation: Observation,
    rng: np.random.Generator,
    executor: Executor | None = None,
) -> Verdict:
    """A verdict, or that nothing explains it where sizes speak against what it names for sure.

    Parameters
    ----------
    verdict
        That explains something, or not: then it stays.
    place
        (d,) of its best set, by all the runs that it gets.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    best = verdict.best
    if verdict.word != "explained":
        return verdict
    if is_out_of_sight(best.candidate, place):
        return _refused(verdict, OUT_OF_SIGHT)
    hypothesis = best.candidate.hypothesis
    if len(hypothesis.effects) < 2:
        return verdict
    left = cancellation_ratio(hypothesis, place, observation, rng, executor)
    return verdict if left >= _LEFT else _refused(verdict, UNDOING)


def _refused(verdict: Verdict, objection: str) -> Verdict:
    refused = replace(verdict.best, objection=objection)
    judged = tuple(refused if one is verdict.best else one for one in verdict.judged)
    return replace(verdict, word="unexplained", best=refused, judged=judged)


def cancellation_ratio(
    hypothesis: Hypothesis,
    place: NDArray[np.float64],
    observation: Observation,
    rng: np.random.Generator,
    executor: Executor | None = None,
) -> float:
    """What several causes at a place (d,) do together, as a share of what the least does alone.

    Root mean squares over all rows, of how far gain and phase are from those of the plain model.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    alone = [(effect,) for effect in hypothesis.effects]
    asked = [(), *alone, hypothesis.effects]
    groups = []
    for effects in asked:
        part = Hypothesis(hypothesis.unit, effects)
        ratio, *sizes = hypothesis.part(effects, place)
        group = Group(part, np.full(_RUNS, ratio), np.array(sizes))
        groups += [group] * _GROUPS
    made = simulate_groups(hypothesis.unit, groups, observation, rng, executor)
    plain, *parts, whole = (_shown(made[effects], observation) for effects in asked)
    least = min(distance(part, plain) for part in parts)
    # What does nothing alone is undone by nothing.
    return distance(whole, plain) / max(least, _NOTHING)


def _shown(population: Population, observation: Observation) -> NDArray[np.float64]:
    """Log gain and phase (2, rows), the median of some runs."""
    log_gain, phase, _ = np.moveaxis(population.channels(observation), 1, 0)
    # Angles have no median; those of neighbours are near one another.
    about = np.angle(np.exp(1j * phase).mean(axis=0))
    off = np.angle(np.exp(1j * (phase - about)))
    return np.array([np.median(log_gain, axis=0), about + np.median(off, axis=0)])


def distance(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Root mean square of how far two responses (2, rows) are apart."""
    off = one - other
    off[1] = np.angle(np.exp(1j * off[1]))
    return float(np.sqrt(np.mean(np.minimum(np.hypot(*off), _FAR) ** 2)))
