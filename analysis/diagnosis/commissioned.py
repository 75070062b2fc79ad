"""The verdict on a commissioned drive of which values have changed.

Owns the runs of the causes that change these values, about where commissioning says they are, and
the verdict that their probabilities give. It compares no other causes: `refine` does.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.checking.cross_validation import hold_out
from analysis.commissioning.changes import Causes, Changes
from analysis.diagnosis.search import Answer
from analysis.diagnosis.stages import Record
from analysis.emulation.fitted_model import FittedModel
from analysis.emulation.likelihood import TEMPERATURE
from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.model import Hypothesis
from analysis.execution.executor import Executor
from analysis.inference.model_pool import ModelPool
from analysis.inference.posterior import Posterior
from analysis.observation.observation import Observation
from analysis.selection.credible_set import require_credible_set
from analysis.selection.verdict import Judged, Verdict, Word
from sim.unit import Unit

__all__ = ["answer_by_changes", "corrected_by_changes"]

_HELD, _MOST = 0.99, 5
"""Sets that are simulated hold this share of the probability; at most so many."""

_GROUPS = 8
_WIDE, _LEAST_REACH = 2.0, 0.01
"""Runs lie within so many standard deviations, and at least so far, as a share of a range."""


def answer_by_changes(
    changes: Changes,
    observed: Observation,
    unit: Unit,
    posterior: Posterior,
    seed: int,
    executor: Executor | None,
    record: Record,
) -> Answer:
    """What has changed in a commissioned drive, where values alone explain it.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    rng = np.random.default_rng(seed)
    with record.stage("refine"):
        candidates = _changed_models(unit, observed, changes, rng, executor)
    verdict = _verdict(candidates, observed, changes)
    summary = posterior.summary(observed, unit.tolerances)
    return _answer(changes, verdict, candidates, observed, summary, rng)


def corrected_by_changes(answer: Answer, changes: Changes) -> Answer:
    """The same candidates with the verdict that changes of values give."""
    verdict = _verdict(answer.candidates, answer.observation, changes)
    return _answer(
        changes, verdict, answer.candidates, answer.observation, answer.summary, answer.rng
    )


def _answer(
    changes: Changes,
    verdict: Verdict,
    candidates: Sequence[FittedModel],
    observation: Observation,
    summary: NDArray[np.float32],
    rng: np.random.Generator,
) -> Answer:
    base = _posterior(verdict.baseline.candidate.hypothesis, changes)
    sharp = _posterior(verdict.best.candidate.hypothesis, changes)
    return Answer(candidates, observation, summary, verdict, base, sharp, rng)


def _changed_models(
    unit: Unit,
    observation: Observation,
    changes: Changes,
    rng: np.random.Generator,
    executor: Executor | None,
) -> list[FittedModel]:
    """The likeliest sets of causes and the plain model, with runs where their values lie."""
    ranked = sorted(changes.named().items(), key=lambda item: -item[1])
    held = np.cumsum([probability for _, probability in ranked])
    count = min(int(np.searchsorted(held, _HELD * held[-1])) + 1, _MOST)
    keys: list[Causes] = list(dict.fromkeys([*(key for key, _ in ranked[:count]), ()]))
    pool = ModelPool(unit, observation, rng, executor, None)
    starts = {key: _placed(Hypothesis(unit, key), changes) for key in keys}
    pool.simulate_about(starts, _GROUPS)
    return list(pool.found.values())


def _verdict(
    candidates: Sequence[FittedModel], observation: Observation, changes: Changes
) -> Verdict:
    """What the probabilities of changes say of candidates; others count for nothing.

    Nothing speaks against a set: that values explain the sweep was asked before.
    """
    believed = changes.named()
    known = [one for one in candidates if one.hypothesis.effects in believed]
    total = sum(believed[one.hypothesis.effects] for one in known)
    judged = sorted(
        (_judged(one, observation, believed[one.hypothesis.effects] / total) for one in known),
        key=lambda one: -one.probability,
    )
    (baseline,) = (one for one in judged if not one.effects)
    best = judged[0]
    word: Word = "explained" if best.effects else "consistent"
    return require_credible_set(Verdict(word, best, tuple(judged), baseline))


def _posterior(hypothesis: Hypothesis, changes: Changes) -> ParameterPosterior:
    """Mean (d,) and covariance (d, d) of a hypothesis's coordinates if only its values changed."""
    found = changes.given(hypothesis.effects)
    stretch = np.concatenate([[1.0], np.ptp(hypothesis.logs, axis=1)])
    covariance = found.covariance / np.outer(stretch, stretch)
    known = [parameter.nominal(hypothesis.unit) or 1.0 for _, parameter in hypothesis.parameters]
    place = hypothesis.place(found.ratio, (np.array(known) * np.exp(found.changes)).tolist())
    return ParameterPosterior(np.clip(place, 0.0, 1.0), covariance + 1e-12 * np.eye(len(place)))


def _placed(
    hypothesis: Hypothesis, changes: Changes
) -> tuple[NDArray[np.float64], tuple[float, NDArray[np.float64]]]:
    found = _posterior(hypothesis, changes)
    reach = np.maximum(_WIDE * np.sqrt(np.diag(found.covariance)), _LEAST_REACH)
    return np.clip(found.mean, 0.02, 0.98), (float(reach[0]), reach[1:])


def _judged(candidate: FittedModel, observation: Observation, probability: float) -> Judged:
    score = TEMPERATURE * float(np.log(max(probability, 1e-12)))
    held_out = hold_out(candidate, observation)
    return Judged(candidate, held_out, score, np.nan, np.nan, probability, "")
