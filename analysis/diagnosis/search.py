"""The answer to what explains a response, by search of the whole catalogue.

Owns the order of the search: refinement, verdict, size of what is named, credible set. What comes
of it beside the verdict is put together elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.diagnosis.question import Question
from analysis.diagnosis.refinement import refine_parameters
from analysis.emulation.fitted_model import FittedModel
from analysis.emulation.model_parameters import estimate_parameters, widen_if_open
from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.estimate.datasheet_posterior import DatasheetValue
from analysis.execution.progress import Progress, part_of
from analysis.inference.refine import refine
from analysis.observation.observation import Observation
from analysis.selection.credible_set import require_credible_set
from analysis.selection.datasheet_test import compare_with_datasheet
from analysis.selection.verdict import Judged, Verdict, judge_candidates

__all__ = ["Answer", "search_catalogue"]


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """Candidates and the verdict on them.

    `base`, `sharp`: coordinates of the plain model and of the best set, None where that is no
    explanation. `summary` (1, hidden): what the network makes of the observation. `rng`: for what
    is computed later. `searched`: whether the catalogue was searched. `learned`: what it says of
    the datasheet's values, None where that is to be asked of the best set.
    """

    candidates: Sequence[FittedModel]
    observation: Observation
    summary: NDArray[np.float32]
    verdict: Verdict
    base: ParameterPosterior
    sharp: ParameterPosterior | None
    rng: np.random.Generator
    searched: bool
    learned: tuple[DatasheetValue, ...] | None = None


def search_catalogue(question: Question, progress: Progress | None) -> Answer:
    """What explains an observation.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    seed, executor, record = question.seed, question.executor, question.record

    def early(share: float, text: str) -> None:
        if progress is not None:
            progress(0.8 * share, text)

    with record.stage("refine"):
        refined = refine(
            question.posterior, question.observed, without=question.without, seed=seed,
            executor=executor, progress=early,
        )  # fmt: skip
    candidates = refined.candidates
    observation = candidates[0].surface.observation
    rng = np.random.default_rng(seed)
    with record.stage("judge"):
        verdict = record.verdict = judge_candidates(candidates, observation, rng, refined.log_odds)
        base = estimate_parameters(verdict.baseline.candidate, observation, rng)

    def sharpened(one: Judged) -> ParameterPosterior:
        late = part_of(progress, 0.8, 0.9, "sizing it")
        return refine_parameters(question.unit, one.candidate, observation, rng, executor, late)

    sharp = None
    if verdict.word != "unexplained":
        with record.stage("sharpen"):
            sharp = sharpened(verdict.best)
            held = compare_with_datasheet(verdict, sharp)
            if held.best is not verdict.best and held.word != "unexplained":
                sharp = sharpened(held.best)
            record.verdict = held
        with record.stage("criticise"):
            # Last, as what shares its probability is no reason to name what is the datasheet's.
            verdict = record.verdict = require_credible_set(held)
        sharp = None if verdict.word == "unexplained" else sharp
    base = widen_if_open(base, verdict.baseline.candidate, observation, rng)
    return Answer(candidates, observation, refined.summary, verdict, base, sharp, rng, True)
