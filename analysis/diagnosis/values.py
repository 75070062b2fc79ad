"""The answer to which values of a drive are other than believed.

Owns the runs of the causes that change these values, the verdict that their probabilities give, and
when it stands in place of what was searched. It searches for no causes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from analysis.checking.cross_validation import hold_out
from analysis.checking.goodness_of_fit import judge_adequacy
from analysis.checking.rejection import find_rejection
from analysis.commissioning.changes import Causes, Changes
from analysis.diagnosis.question import Question
from analysis.diagnosis.search import Answer
from analysis.emulation.datasheet_range import range_about
from analysis.emulation.fitted_model import FittedModel
from analysis.emulation.likelihood import TEMPERATURE
from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.datasheet_spread import spread_of
from analysis.ensemble.model import Hypothesis
from analysis.ensemble.runs import DatasheetRange
from analysis.estimate.datasheet_posterior import DatasheetValue
from analysis.execution.executor import Executor
from analysis.inference.model_pool import ModelPool
from analysis.observation.observation import Observation
from analysis.selection.credible_set import require_credible_set
from analysis.selection.verdict import Judged, Verdict, Word, is_by_chance
from sim.unit import Unit

__all__ = ["answer_by_values"]

_HELD, _MOST = 0.99, 5
"""Sets that are simulated hold this share of the probability; at most so many."""

_GROUPS = 8
_WIDE, _LEAST_REACH = 2.0, 0.01
"""Runs lie within so many standard deviations, and at least so far, as a share of a range."""

_LEAST_RANK = 0.005
"""Of some hundred simulated drives; ranks of a misfit nearer to 0 or 1 are not told apart."""


def answer_by_values(question: Question, changes: Changes, searched: Answer | None) -> Answer:
    """Which values are other than believed, or what was searched if that tells more.

    Parameters
    ----------
    searched
        What the search of the catalogue says; None where values alone explain the drive.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    rng, unit = np.random.default_rng(question.seed), question.unit
    observation = question.observed if searched is None else searched.observation
    with question.record.stage("values"):
        candidates = _changed_models(unit, observation, changes, rng, question.executor)
        verdict = _verdict(candidates, observation, changes)
        if searched and not _is_less(searched, verdict.baseline, changes, rng):
            return searched
    summary = question.posterior.summary(observation, unit.tolerances)
    base, sharp = (
        _posterior(one.candidate.hypothesis, changes) for one in (verdict.baseline, verdict.best)
    )
    learned = _learned(changes, verdict.best.effects)
    was = searched is not None
    return Answer(candidates, observation, summary, verdict, base, sharp, rng, was, learned)


def _is_less(searched: Answer, plain: Judged, changes: Changes, rng: np.random.Generator) -> bool:
    """Whether what the search says is less than that no value has changed.

    It may be too coarse to see that: it then finds no cause, names values alone, or a cause that
    explains no more, but for chance, than the plain model where its values truly lie.
    """
    verdict, known = searched.verdict, changes.named()
    said = (verdict.best, *verdict.rivals)
    if verdict.word == "unexplained" or all(one.effects in known for one in said):
        return True
    best = verdict.best.candidate.best.log_likelihood
    if best <= max(one.candidate.best.log_likelihood for one in (plain, verdict.baseline)):
        return True
    fitted = judge_adequacy(plain.candidate, rng)
    if find_rejection(plain.candidate, plain.held_out, fitted):
        return False
    return is_by_chance(plain.candidate, verdict.best.candidate, rng)


def _learned(changes: Changes, causes: Causes) -> tuple[DatasheetValue, ...]:
    """Every value but those that the causes change, as believed and as the sweeps leave it."""
    unit, shares = changes.belief.coordinates.unit, changes.shares
    before, after = np.sqrt(np.diag(changes.belief.common)), changes.posterior(causes)
    sized = {parameter.name for _, parameter in Hypothesis(unit, causes).parameters}
    found = []
    for i, symbol in enumerate(changes.belief.coordinates.symbols):
        if not unit.tolerances.get(symbol) or symbol in sized:
            continue
        known, factor = unit.parameters[symbol], float(np.exp(shares[i] * after.mean[i]))
        std = factor * float(shares[i] * after.std[i])
        found.append(
            DatasheetValue(symbol, known, float(shares[i] * before[i]), known * factor, std)
        )
    return tuple(sorted(found, key=lambda one: one.std / one.tolerance))


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
    pool.simulate_about(starts, _GROUPS, {key: _range(key, changes) for key in keys})
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
    rank = np.clip(changes.identified.misfit_rank, _LEAST_RANK, 1.0 - _LEAST_RANK)
    best = replace(judged[0], misfit=float(ndtri(rank)))
    word: Word = "explained" if best.effects else "consistent"
    baseline = baseline if best.effects else best
    return require_credible_set(Verdict(word, best, (best, *judged[1:]), baseline))


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


def _range(causes: Causes, changes: Changes) -> DatasheetRange:
    """Where the other values lie if these causes alone changed theirs."""
    coordinates, found = changes.belief.coordinates, changes.posterior(causes)
    unit = coordinates.unit
    spread = spread_of(unit)
    sized = {symbol for _, p in Hypothesis(unit, causes).parameters for symbol in (p.name, *p.of)}
    place = {symbol: i for i, symbol in enumerate(coordinates.symbols) if symbol not in sized}
    back = np.zeros((len(coordinates), len(spread)))
    for symbol, row in zip(spread.symbols, spread.back, strict=True):
        if symbol in place:
            back[place[symbol]] = changes.shares[place[symbol]] * row
    centre = back.T @ found.mean
    std = np.sqrt(np.einsum("ik,ij,jk->k", back, found.covariance, back))
    return range_about(centre, np.maximum(std, _LEAST_REACH * spread.sigmas), spread.sigmas)


def _judged(candidate: FittedModel, observation: Observation, probability: float) -> Judged:
    score = TEMPERATURE * float(np.log(max(probability, 1e-12)))
    held_out = hold_out(candidate, observation)
    return Judged(candidate, held_out, score, np.nan, np.nan, probability, "")
