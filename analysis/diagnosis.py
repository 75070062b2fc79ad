"""The diagnosis: what a simulation gets wrong against a measurement, and why.

Owns the whole answer as one document: verdict, causes with their sizes and
error bars, rivals, what was gained on levels that the fit had not seen, where
the plain model departs, and what to measure next. The parts are computed
elsewhere; this module puts them together and words them.
"""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.calibration import Calibrated
from analysis.executor import Executor
from analysis.misfit import Departure, describe_departures, find_departures
from analysis.next_measurement import NextMeasurement, propose_measurement
from analysis.observation import Observation, observe
from analysis.progress import Progress, part_of
from analysis.search import search_causes
from analysis.sharpening import sharpen_candidate
from analysis.sizing import size_candidate
from analysis.verdict import Judged, Verdict, judge_candidates
from daq.errors import AnalysisError, InputError
from daq.frf import FrequencyResponse
from sim.catalogue import CATALOGUE
from sim.effort import counting
from sim.unit import Unit

__all__ = ["Cause", "Diagnosis", "Size", "diagnose_response"]


@dataclass(frozen=True, slots=True)
class Size:
    """The fitted value of one parameter of an effect, with one standard deviation.

    `datasheet`: what the unit has without the effect, None where its datasheet does not know.
    """

    name: str
    value: float
    std: float
    unit_symbol: str
    datasheet: float | None


@dataclass(frozen=True, slots=True)
class Cause:
    """One effect of the named set."""

    effect: str
    sizes: tuple[Size, ...]
    probability: float


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """What is wrong, why, how sure that is, and what it gains.

    `ratio_baseline`, `ratio_extended`: contribution ratio and its standard
    deviation under the plain and the extended model. `departures`: of the
    measurement from the plain model; `left`: from the extended one.
    `given_up`: whether the search was left with no explanation, having simulated as much as it
    may. `simulated_s`: seconds of motion that were simulated for it.
    """

    unit: str
    verdict: Verdict
    causes: tuple[Cause, ...]
    ratio_baseline: tuple[float, float]
    ratio_extended: tuple[float, float]
    departures: tuple[Departure, ...]
    left: tuple[Departure, ...]
    shape: str
    next_measurement: NextMeasurement | None
    observation: Observation
    given_up: bool = False
    warnings: tuple[str, ...] = ()
    elapsed_s: float = 0.0
    simulated_s: float = 0.0

    @property
    def sites(self) -> tuple[str, ...]:
        """Where the named causes sit: "plant", "chain"; nowhere if none is named."""
        return tuple(sorted({CATALOGUE[cause.effect].site for cause in self.causes}))

    @property
    def held_out_sigma(self) -> tuple[float, float]:
        """Held-out rms of the plain and of the extended model in the extended one's sigma."""
        best, base = self.verdict.best.held_out, self.verdict.baseline.held_out
        return base.rms_against(best.std), best.rms_sigma

    @property
    def held_out_db(self) -> tuple[float, float]:
        """Held-out rms of the gain, dB, of the plain and of the extended model."""
        return self.verdict.baseline.held_out.rms_db, self.verdict.best.held_out.rms_db

    def to_json(self) -> dict[str, Any]:
        """The document of ``diagnose --json``."""
        sigma, db = self.held_out_sigma, self.held_out_db
        proposal = self.next_measurement
        return {
            "unit": self.unit,
            "verdict": self.verdict.word,
            "causes": [
                {
                    "effect": cause.effect,
                    "parameters": {
                        s.name: {"value": s.value, "std": s.std, "unit": s.unit_symbol}
                        for s in cause.sizes
                    },
                    "probability": cause.probability,
                    "site": CATALOGUE[cause.effect].site,
                    "meaning": CATALOGUE[cause.effect].meaning,
                    "check": CATALOGUE[cause.effect].check,
                }
                for cause in self.causes
            ],
            "rivals": [
                {"causes": list(one.effects), "probability": one.probability}
                for one in self.verdict.judged
                if sorted(one.effects) != sorted(cause.effect for cause in self.causes)
            ],
            "site": list(self.sites),
            "baseline": {"held_out_rms_sigma": sigma[0], "held_out_rms_db": db[0]},
            "extended": {"held_out_rms_sigma": sigma[1], "held_out_rms_db": db[1]},
            "gain": {"held_out_rms_ratio": sigma[1] / sigma[0]},
            "contribution_ratio": {
                "baseline": _uncertain(self.ratio_baseline),
                "extended": _uncertain(self.ratio_extended),
            },
            "residual": [one.to_json() for one in self.departures],
            "residual_after": [one.to_json() for one in self.left],
            "shape": self.shape,
            "misfit_sigma": {
                "baseline": self.verdict.baseline.misfit,
                "extended": self.verdict.best.misfit,
            },
            "structure_sigma": {
                "baseline": self.verdict.baseline.structure,
                "extended": self.verdict.best.structure,
            },
            "next_measurement": None if proposal is None else proposal.to_json(),
            "warnings": list(self.warnings),
            "elapsed_s": self.elapsed_s,
            "simulated_s": self.simulated_s,
        }

    def summary(self) -> list[str]:
        """Lines of text for a person."""
        lines = [f"{self.unit}: {self.verdict.word}. {_sentence(self)}"]
        for cause in self.causes:
            effect = CATALOGUE[cause.effect]
            sizes = ", ".join(_worded(size) for size in cause.sizes)
            lines.append(f"  {cause.effect} ({_WHERE[effect.site]}): {sizes}")
            lines.append(f"    {effect.meaning} On the bench: {effect.bench_cause}.")
            lines.append(f"    To make sure: {effect.check}.")
        base, extended = self.ratio_baseline, self.ratio_extended
        lines.append(f"  contribution ratio, plain model      {base[0]:.3f} +- {base[1]:.3f}")
        if self.causes:
            lines.append(
                f"  contribution ratio, extended model   {extended[0]:.3f} +- {extended[1]:.3f}"
            )
        sigma, db = self.held_out_sigma, self.held_out_db
        lines.append(
            f"  on levels not fitted, plain model    {sigma[0]:.2f} sigma, {db[0]:.2f} dB rms"
        )
        if self.causes:
            lines.append(
                f"  on levels not fitted, extended model {sigma[1]:.2f} sigma, {db[1]:.2f} dB rms"
            )
        lines.append(f"  against the plain model: {self.shape}")
        lines.append("  sets judged, by probability:")
        for one in self.verdict.judged:
            name = " + ".join(one.effects) or "nothing hidden"
            remark = self.verdict.remark(one)
            lines.append(
                f"    {one.probability:6.3f}  {name}" + (f"  ({remark})" if remark else "")
            )
        if self.next_measurement is not None:
            proposal = self.next_measurement
            lines.append(
                f"  to tell {proposal.separates[0]} from {proposal.separates[1]} "
                f"({proposal.expected_sigma:.1f} sigma expected):"
            )
            lines.append(f"    {proposal.command}")
            lines.append("    and then diagnose the files of both measurements together")
        lines.append(f"  motion simulated for this: {self.simulated_s:.0f} s")
        lines += [f"  warning: {text}" for text in self.warnings]
        return lines


_WHERE = {"plant": "in the mechanics", "chain": "in the measuring chain"}


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
        If a response has no usable point, a motion grew without bound, or the unit has one stage.
    InputError
        If the responses are said to be of different units, or of different specimens.
    """
    responses = (response, *further)
    _check_same_unit(responses)
    if unit.stages == 1:
        raise AnalysisError(
            f"unit {unit.name} has one gear stage, and the search shares the backlash out between "
            "two; estimate tells its backlash"
        )
    started = time.perf_counter()
    with counting() as effort:
        found = _diagnose(observe(*responses), unit, without, cache, seed, executor, progress)
    return replace(
        found,
        warnings=_warnings(found),
        elapsed_s=time.perf_counter() - started,
        simulated_s=effort.simulated_s,
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

    def early(share: float, text: str) -> None:
        if progress is not None:
            progress(0.8 * share, text)

    searched = search_causes(
        unit, observed, without=without, cache=cache, seed=seed, executor=executor, progress=early
    )
    candidates = searched.candidates
    observation = candidates[0].surface.observation
    rng = np.random.default_rng(seed)
    verdict = judge_candidates(candidates, observation, rng)
    named = verdict.best if verdict.word in ("explained", "ambiguous") else None
    base = size_candidate(verdict.baseline.candidate, observation, rng)
    best = base
    if verdict.word != "unexplained":
        late = part_of(progress, 0.8, 0.9, "sizing it")
        best = sharpen_candidate(unit, verdict.best.candidate, observation, rng, executor, late)
    departures = find_departures(verdict.baseline.candidate, observation)
    proposal = _proposal(unit, verdict, observation, seed, executor, progress)
    if progress is not None:
        progress(1.0, "done")
    return Diagnosis(
        unit=unit.name,
        verdict=verdict,
        causes=() if named is None else _causes(named, best),
        ratio_baseline=_ratio(base if named is not None else best),
        ratio_extended=_ratio(best),
        departures=departures,
        left=find_departures(verdict.best.candidate, observation),
        shape=describe_departures(departures, observation),
        next_measurement=proposal,
        observation=observation,
        given_up=searched.given_up,
    )


def _ratio(found: Calibrated) -> tuple[float, float]:
    return float(found.mean[0]), float(np.sqrt(found.covariance[0, 0]))


def _causes(named: Judged, found: Calibrated) -> tuple[Cause, ...]:
    hypothesis = named.candidate.hypothesis
    values = hypothesis.values(found.mean)
    # Coordinates are logarithms of the values, stretched over their range.
    stretch = hypothesis.logs[:, 1] - hypothesis.logs[:, 0]
    stds = values * stretch * np.sqrt(np.diag(found.covariance)[1:])
    sizes: dict[str, list[Size]] = {}
    for (effect, parameter), value, std in zip(hypothesis.parameters, values, stds, strict=True):
        known = parameter.nominal(hypothesis.unit)
        size = Size(parameter.name, float(value), float(std), parameter.unit_symbol, known)
        sizes.setdefault(effect, []).append(size)
    return tuple(Cause(e, tuple(of), named.probability) for e, of in sizes.items())


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
        rival = verdict.rivals[0]
    elif len(observation.blocks) == 1 and len(verdict.judged) > 1:
        rival = next(one for one in verdict.judged if one is not verdict.best)
    else:
        return None

    late = part_of(progress, 0.9, 1.0, "choosing the next measurement")
    return propose_measurement(
        unit, verdict.best.candidate, rival.candidate, observation,
        seed=seed, executor=executor, progress=late,
    )  # fmt: skip


def _check_same_unit(responses: Sequence[FrequencyResponse]) -> None:
    """Refuse sweeps of different machines: what differs between them is no cause of either."""
    for what, said in (
        ("units", [one.unit for one in responses]),
        ("specimens", [str(one.provenance.get("serial") or "") for one in responses]),
    ):
        different = sorted({one for one in said if one})
        if len({one.lower() for one in different}) > 1:
            raise InputError(
                f"the responses are of different {what}, {' and '.join(different)}; "
                "diagnose them one by one"
            )


def _warnings(diagnosis: Diagnosis) -> tuple[str, ...]:
    found, observation = [], diagnosis.observation
    if diagnosis.given_up:
        found.append(
            "the search was left with no explanation, having simulated as much motion as it may: "
            "not every set of causes was tried"
        )
    if len(observation.blocks) == 1:
        found.append(
            "the response holds one source level: what was held out are halves of its band; "
            "measure at further levels"
        )
    if not np.any(np.isfinite(observation.values[1])):
        found.append("the response holds no phase: faults of the measuring chain hide there")
    if not np.any(np.isfinite(observation.values[2])):
        found.append("the response states no errors: what its scatter would tell is lost")
    return tuple(found)


def _sentence(diagnosis: Diagnosis) -> str:
    word, names = diagnosis.verdict.word, " with ".join(c.effect for c in diagnosis.causes)
    where = " and ".join(_WHERE[site] for site in diagnosis.sites)
    if word == "consistent":
        return "Nothing beyond tolerance is needed to explain this response."
    if word == "unexplained":
        return "Something is missing that no cause known here explains."
    if word == "ambiguous":
        sets = (" with ".join(one.effects) for one in diagnosis.verdict.rivals)
        rivals = " or ".join(one or "nothing beyond tolerance" for one in sets)
        return f"{names} ({where}) explains it, but so may {rivals}."
    return f"{names} ({where}) explains it."


def _uncertain(pair: tuple[float, float]) -> dict[str, float]:
    return {"value": pair[0], "std": pair[1]}


def _worded(size: Size) -> str:
    symbol = "" if size.unit_symbol == "1" else f" {size.unit_symbol}"
    known = "" if size.datasheet is None else f" (datasheet {size.datasheet:.4g}{symbol})"
    return f"{size.name} = {size.value:.4g} +- {size.std:.2g}{symbol}{known}"
