"""The diagnosis: what a simulation gets wrong against a measurement, and why.

Owns the way to the whole answer: verdict, causes with their sizes and error
bars, rivals, what was gained on levels that the fit had not seen, where the
plain model departs, and what to measure next. The parts are computed elsewhere,
and what they say together is worded elsewhere; this module puts them together.
"""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from analysis.commissioning.belief import (
    Belief,
    believed_by_datasheet,
    believed_since_commissioning,
)
from analysis.commissioning.changes import find_changes
from analysis.diagnosis.datasheet import learn_datasheet
from analysis.diagnosis.experiment_design import NextMeasurement, propose_measurement
from analysis.diagnosis.harmonics import compare_harmonics
from analysis.diagnosis.question import Question
from analysis.diagnosis.remaining_models import find_remaining_models
from analysis.diagnosis.residuals import describe_residuals, find_residuals
from analysis.diagnosis.result import Cause, Diagnosis, Size
from analysis.diagnosis.search import Answer, search_catalogue
from analysis.diagnosis.values import answer_by_values
from analysis.emulation.fitted_model import FittedModel
from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.datasheet_belief import HINT, believed_document, is_usually_off, trusts_much
from analysis.estimate.backlash import ratio_of
from analysis.execution.blas import on_one_core
from analysis.execution.executor import Executor
from analysis.execution.progress import Progress, part_of, remaining
from analysis.inference.exclusion import ExclusionLimit
from analysis.inference.posterior import Posterior, limits
from analysis.observation.excitation import refuse_signal
from analysis.observation.joint import check_together, unit_doubts
from analysis.observation.observation import Observation, observe
from analysis.observation.rounding import settled
from analysis.observation.stated_error import error_doubts
from analysis.observation.thinning import thin_responses
from analysis.selection.verdict import Verdict
from daq.errors import AnalysisError
from daq.frf import FrequencyResponse
from sim.catalogue import CATALOGUE
from sim.engine.effort import counting
from sim.unit import Unit

__all__ = ["Cause", "Diagnosis", "Size", "diagnose_response"]

_FEWEST, _FEW = 8, 20
"""Frequencies without which there is no diagnosis, and below which small causes hardly show."""

_ASKED = 0.4
"""Share of the work that asks which values are other than believed, where that is asked."""

_RIVALS = 3
"""How many rivals the next measurement is to tell from what is named."""


@on_one_core()
def diagnose_response(
    response: FrequencyResponse,
    unit: Unit,
    *,
    further: Sequence[FrequencyResponse] = (),
    without: Collection[str] = (),
    cache: Path | None = None,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnose a measured response, or several of one unit together.

    Parameters
    ----------
    response
        Measured, one level or more; phase and errors may be missing.
    further
        Other sweeps of the same unit, such as the one that a first diagnosis proposed.
    unit
        The unit under test, as its datasheet says.
    without
        Effects to leave out of the catalogue.
    cache
        Folder that keeps what was simulated for a unit and a plan.
    seed
        Of the starts and places of the simulations.
    executor
        Where runs are simulated; on this machine's cores if not given.
    progress
        Told the share done and what is being done, from the calling thread.

    Raises
    ------
    AnalysisError
        If a response has no usable point, all hold too few frequencies, a
        motion grew without bound.
    InputError
        If the responses are said to be of different units or specimens, or one is there twice.
    """
    responses: tuple[FrequencyResponse, ...] = (response, *further)
    check_together(responses)
    responses, doubts = thin_responses(tuple(map(settled, responses)))
    refuse_signal(responses)
    observed = observe(*responses)
    _refuse_few(observed)
    started = time.perf_counter()
    with counting() as effort:
        found = _diagnose(observed, unit, without, cache, seed, executor, progress)
        if found.verdict.word == "unexplained":
            best, rng = found.verdict.best.candidate, np.random.default_rng(seed)
            harmonics = compare_harmonics(responses, found.observation, best, rng)
            found = replace(found, harmonics=harmonics)
    return replace(
        found,
        warnings=(
            *doubts,
            *unit_doubts(responses, unit),
            *error_doubts(responses),
            *_warnings(found),
        ),
        elapsed_s=time.perf_counter() - started,
        simulated_s=effort.simulated_s,
    )


def _refuse_few(observed: Observation) -> None:
    """Anything fits a few points: "consistent" would say nothing of the servo."""
    frequencies = len(np.unique(observed.frequency_hz))
    if frequencies < _FEWEST:
        held = "1 usable frequency" if frequencies == 1 else f"{frequencies} usable frequencies"
        raise AnalysisError(
            f"the response holds {held}, and nearly anything explains so few; measure {_FEWEST} at "
            "least, better thirty or more from below ARF to above RF"
        )


def _diagnose(
    observed: Observation,
    unit: Unit,
    without: Collection[str],
    cache: Path | None,
    seed: int,
    executor: Executor | None,
    progress: Progress | None,
) -> Diagnosis:
    posterior = Posterior.find(unit, cache, executor)
    if posterior is None:
        raise AnalysisError(
            f"no posterior for unit {unit.name} was trained, nor for one like it; run: "
            "lashbench prepare --unit FILE"
        )
    question = Question(observed, unit, posterior, without, seed, executor)
    answer = _answer(question, progress)
    record = question.record
    record.verdict = verdict = answer.verdict
    candidates, observation, summary = answer.candidates, answer.observation, answer.summary
    base, sharp, rng = answer.base, answer.sharp, answer.rng
    named = verdict.word in ("explained", "ambiguous")
    best = base if sharp is None else sharp
    departures = find_residuals(verdict.baseline.candidate, observation)
    left = find_residuals(verdict.best.candidate, observation)
    unseen: tuple[ExclusionLimit, ...] = ()
    if verdict.word != "unexplained":
        unseen = limits(posterior, summary, verdict.best.effects if named else (), without)
    with record.stage("next measurement"):
        proposal = _proposal(unit, verdict, observation, seed, executor, progress)
    with record.stage("models"):
        # Chance of its own: sizing what is left beside the answer does not change the answer.
        models = find_remaining_models(
            verdict, best, base if named else best, observation, rng.spawn(1)[0]
        )
    if progress is not None:
        progress(1.0, "done")
    accepted = verdict.word in ("consistent", "explained")
    learned = answer.learned
    if learned is None:
        learned = learn_datasheet(verdict.best.candidate, best)
    return Diagnosis(
        unit=unit.name,
        verdict=verdict,
        causes=_causes(verdict, best, candidates) if named else (),
        ratio_baseline=ratio_of(unit, base if named else best),
        ratio_extended=ratio_of(unit, best),
        departures=departures,
        left=left,
        shape=describe_residuals(departures, observation),
        left_shape=describe_residuals(left, observation),
        next_measurement=proposal,
        observation=observation,
        unseen=unseen,
        models=models,
        believed=believed_document(unit),
        datasheet=learned if accepted else (),
        lent_by=posterior.lent_by if answer.searched else "",
        stages=tuple(record.stages),
    )


def _answer(question: Question, progress: Progress | None) -> Answer:
    """By the values of the drive where these are asked first, else by search of the catalogue.

    The catalogue is searched where values do not suffice.
    """
    belief = _belief(question.unit, question.posterior)
    if belief is None:
        return search_catalogue(question, progress)
    with question.record.stage("changes"):
        changes = find_changes(
            belief, question.observed, without=question.without, seed=question.seed,
            executor=question.executor,
            progress=part_of(progress, 0.0, _ASKED, "asking which values differ"),
        )  # fmt: skip
    searched = None
    if not changes.likeliest and not changes.suffice:
        searched = search_catalogue(question, remaining(progress, _ASKED))
        if changes.likeliest is None:
            return searched
    return answer_by_values(question, changes, searched)


def _belief(unit: Unit, posterior: Posterior) -> Belief | None:
    """What is believed of the values, if these are asked first.

    A posterior of the unit's own has learned what its values do; a borrowed one has not.
    """
    if unit.commissioning is not None:
        return believed_since_commissioning(unit)
    return believed_by_datasheet(unit) if posterior.lent_by else None


def _causes(
    verdict: Verdict, found: ParameterPosterior, candidates: Sequence[FittedModel]
) -> tuple[Cause, ...]:
    """What is named, first what costs most to leave out."""
    hypothesis = verdict.best.candidate.hypothesis
    values = hypothesis.values(found.mean)
    # Coordinates are logarithms of the values, stretched over their range.
    stretch = hypothesis.logs[:, 1] - hypothesis.logs[:, 0]
    stds = values * stretch * np.sqrt(np.diag(found.covariance)[1:])
    sizes: dict[str, list[Size]] = {}
    for (effect, parameter), value, std in zip(hypothesis.parameters, values, stds, strict=True):
        known = parameter.nominal(hypothesis.unit)
        size = Size(
            parameter.name, float(value), float(std), parameter.symbol_of(hypothesis.unit), known
        )
        sizes.setdefault(effect, []).append(size)
    likelihood = {c.hypothesis.effects: c.best.log_likelihood for c in candidates}

    def without(effect: str) -> float:
        # What was not simulated, as nobody thought it near, is behind all that was.
        rest = tuple(e for e in hypothesis.effects if e != effect)
        return likelihood.get(rest, -math.inf)

    # What its datasheet may be off by anyway is in the model, and no cause.
    beyond = hypothesis.beyond_tolerance(found.mean) or tuple(sizes)
    strongest_first = sorted(beyond, key=without)
    return tuple(Cause(e, tuple(sizes[e]), verdict.probability) for e in strongest_first)


def _proposal(
    unit: Unit,
    verdict: Verdict,
    observation: Observation,
    seed: int,
    executor: Executor | None,
    progress: Progress | None,
) -> NextMeasurement | None:
    """A sweep that would decide, where something is left to decide."""
    if verdict.word == "ambiguous":
        # What is no explanation need not be told from what may be one, if others may be, too.
        may = [one for one in verdict.rivals if not one.refused]
        rivals = may[:_RIVALS] or verdict.rivals[:1]
    elif len(observation.levels) == 1 and len(verdict.judged) > 1:
        rivals = [next(one for one in verdict.judged if one is not verdict.best)]
    else:
        return None

    late = part_of(progress, 0.95, 1.0, "choosing the next measurement")
    return propose_measurement(
        unit, verdict.best.candidate, [one.candidate for one in rivals], observation,
        seed=seed, executor=executor, progress=late,
    )  # fmt: skip


def _warnings(diagnosis: Diagnosis) -> tuple[str, ...]:
    found, observation = [], diagnosis.observation
    if diagnosis.verdict.word == "unexplained":
        found.append(
            "the contribution ratio is that of the plain model, which does not explain what was "
            "measured: it may be off by far more than its error"
        )
    near = (is_usually_off(s.value, s.datasheet) for c in diagnosis.causes for s in c.sizes)
    if trusts_much(diagnosis.believed) and (diagnosis.verdict.word == "unexplained" or any(near)):
        found.append(HINT)
    if diagnosis.lent_by:
        own = CATALOGUE.own_of(diagnosis.verdict.baseline.candidate.hypothesis.unit)
        unasked = f", and did not ask for {', '.join(own)}" if own else ""
        found.append(
            f"no posterior was trained for unit {diagnosis.unit}: that of {diagnosis.lent_by} "
            f"chose which causes were simulated together, and may have missed some{unasked}; train "
            "its own: lashbench prepare --unit FILE"
        )
    if len(observation.levels) == 1:
        halves = len(observation.blocks) == 1
        held_out = "halves of its band" if halves else "whole sweeps at that level"
        found.append(
            f"the response holds one source level: what was held out are {held_out}; "
            "measure at further levels"
        )
    if (frequencies := len(np.unique(observation.frequency_hz))) < _FEW:
        found.append(
            f"the response holds {frequencies} frequencies: that nothing is named says little, as "
            "small causes do not show in so few; measure more"
        )
    if not np.any(np.isfinite(observation.values[1])):
        found.append(
            "the response holds no phase: faults of the measuring chain hide there; measure it too"
        )
    if not np.any(np.isfinite(observation.values[2])):
        found.append(
            "the response states no cycle-to-cycle scatter: what that would tell is lost; give one "
            "standard error of each gain, as lashbench measure does"
        )
    return tuple(found)
