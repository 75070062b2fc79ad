"""How much of the total backlash sits in each gear stage, and how sure that is.

Owns the two forms of the estimate: the fit of a whole response at all its
levels, and the paper's, from one anti-resonance and one resonance. Both give a
posterior of the contribution ratio; neither looks for causes of a misfit
(`analysis.diagnosis` does), but both warn of one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.answer import CALL_FOR_DIAGNOSIS
from analysis.ensemble.datasheet_belief import HINT, believed_document, believed_lines, trusts_much
from analysis.ensemble.machine import Machine
from analysis.estimate.backlash import Backlash, Uncertain, backlash_of_places
from analysis.estimate.datasheet_posterior import DatasheetValue, datasheet_lines
from analysis.estimate.design import RATIO, Axis
from analysis.estimate.frequency_scale import REFUTED, frequency_doubt
from analysis.estimate.from_features import IndexCurve, index_curve_of_response
from analysis.estimate.posterior import Posterior, fit_posterior, match_runs, robust_rms
from analysis.estimate.settings import doubt_settings
from analysis.execution.blas import on_one_core
from analysis.execution.executor import Executor
from analysis.execution.progress import Progress
from analysis.observation.joint import check_together, sweep_document, sweep_lines
from analysis.observation.observation import observe
from analysis.observation.rounding import settled
from analysis.observation.stated_error import error_doubts
from analysis.observation.thinning import thin_responses
from analysis.resonance.samples import refuse_levels
from daq.errors import InputError
from daq.frf import FrequencyResponse
from sim.engine.effort import counting
from sim.unit import Unit

__all__ = ["Estimate", "Uncertain", "estimate_features", "estimate_response", "free_axes"]

_WIDE_RESIDUAL = 1.35
"""Robust residual, in standard deviations, from which the model is said to lack something."""


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """The estimate of both stages' backlash.

    `curve` is the paper's error index over the ratio, None where the response
    shows no pair of features. `simulated_s` says how many seconds of motion
    were simulated for it; `sweeps` what was swept, where it was a response. `refuted`: whether
    the plain model does not fit, so that its numbers are no answer before a diagnosis. `datasheet`:
    what a response says of each value of it.
    """

    unit: str
    contribution_ratio: Uncertain
    b1_deg: Uncertain
    b2_deg: Uncertain
    b_t_deg: Uncertain
    curve: IndexCurve | None
    warnings: tuple[str, ...]
    simulated_s: float
    sweeps: tuple[dict[str, Any], ...] = ()
    refuted: bool = False
    believed: Mapping[str, Any] = field(default_factory=dict)
    datasheet: tuple[DatasheetValue, ...] = ()
    b3_deg: Uncertain | None = None

    def to_json(self) -> dict[str, Any]:
        """The document of ``estimate --json``."""
        return {
            "unit": self.unit,
            **self._backlash().to_json(),
            "error_index": None if self.curve is None else self.curve.to_json(),
            "sweeps": list(self.sweeps),
            **self.believed,
            "datasheet": {one.symbol: one.to_json() for one in self.datasheet},
            "refuted": self.refuted,
            "warnings": list(self.warnings),
            "simulated_s": self.simulated_s,
        }

    def _backlash(self) -> Backlash:
        numbers = self.contribution_ratio, self.b1_deg, self.b2_deg, self.b_t_deg
        return Backlash(*numbers, self.b3_deg)

    def summary(self) -> list[str]:
        """Lines of text for a person."""
        told = self._backlash()
        head = ", by the plain model, which does not fit" if self.refuted else ""
        lines = [f"{self.unit}: backlash by stage{head}", *told.lines("  ")]
        lines += [f"  {text}" for text in sweep_lines(self.sweeps)]
        lines += [f"  {text}" for text in believed_lines(self.believed)]
        if not self.refuted:
            lines += [f"  {text}" for text in datasheet_lines(self.to_json())]
        if self.curve is not None:
            lines.append(self.curve.summary())
        lines.append(f"  motion simulated for this: {self.simulated_s:.0f} s")
        lines += [f"  warning: {warning}" for warning in self.warnings]
        return lines


@on_one_core()
def estimate_response(
    response: FrequencyResponse,
    unit: Unit,
    total_backlash_unknown: bool = False,
    progress: Progress | None = None,
    seed: int = 0,
    cache: Path | None = None,
    executor: Executor | None = None,
    further: Sequence[FrequencyResponse] = (),
) -> Estimate:
    """Estimate from a whole response at all its source levels, or from several together.

    Parameters
    ----------
    response
        Measured or simulated, one level or more; phase and errors may be missing.
    further
        Other sweeps of the same unit. The error index is that of the first.
    unit
        The unit under test.
    total_backlash_unknown
        Fit the total backlash too, over 0.5 to 2 times the unit's. A drive
        with one stage has nothing to share out: there the total is what is
        estimated, over 0.2 to 3 times the unit's, and the ratio is 1.
    progress
        Told the share done and what is being done.
    seed
        Of the starts and places of the simulations.
    cache
        Folder that keeps what was simulated for a unit and a plan.
    executor
        Where it is simulated; on this machine's cores if not given.

    Raises
    ------
    AnalysisError
        If no usable point is left, or nothing simulated comes near the response.
    InputError
        If the responses are said to be of different units or specimens, or one is there twice.
    """
    responses: tuple[FrequencyResponse, ...] = (response, *further)
    check_together(responses)
    for one in responses:
        refuse_levels(one)
    responses, doubts = thin_responses(tuple(map(settled, responses)))
    observation, axes = observe(*responses), free_axes(unit, total_backlash_unknown)
    with counting() as effort:
        posterior = fit_posterior(
            unit, observation, axes, seed=seed, cache=cache, executor=executor, progress=progress
        )
    simulated_s = effort.simulated_s
    curve = index_curve_of_response(responses[0], observation, posterior.draws)
    warnings = doubts + error_doubts(responses)
    misfit = robust_rms(posterior.match)
    if misfit > _WIDE_RESIDUAL:
        doubt = frequency_doubt(
            observation,
            posterior.draws,
            lambda seen, runs: robust_rms(match_runs(unit, seen, axes, runs, seed)),
        )
        if not doubt and misfit >= REFUTED:
            with counting() as further_effort:
                other = doubt_settings(
                    responses, unit, axes, seed=seed, executor=executor, progress=progress
                )
            simulated_s += further_effort.simulated_s
            doubt = "" if other is None else other.warning
        warnings = ([doubt] if doubt else []) + warnings
        warnings.append(
            f"the model leaves {misfit:.1f} standard deviations of the response unexplained; "
            f"{CALL_FOR_DIAGNOSIS}"
        )
        if trusts_much(believed_document(unit)):
            warnings.append(HINT)
    found = _from_posterior(unit, posterior, curve, tuple(warnings), simulated_s)
    return replace(
        found,
        sweeps=tuple(sweep_document(plan) for plan, _ in observation.plans),
        refuted=misfit > _WIDE_RESIDUAL,
        datasheet=posterior.datasheet,
    )


@on_one_core()
def estimate_features(
    arf_hz: float, rf_hz: float, unit: Unit, progress: Progress | None = None, seed: int = 0
) -> Estimate:
    """Estimate from one anti-resonance and one resonance, the paper's way.

    Raises
    ------
    InputError
        If the frequencies are not positive or not in order, or the unit has one gear stage.
    AnalysisError
        If the simulated unit shows no such features anywhere near.
    """
    if unit.stages == 1:
        raise InputError(
            f"unit {unit.name} has one gear stage: two frequencies share nothing out; "
            "estimate from a whole response"
        )
    from analysis.estimate.from_features import fit_features

    with counting() as effort:
        fitted = fit_features(arf_hz, rf_hz, unit, seed=seed, progress=progress)
    warnings = list(fitted.warnings)
    b_t = unit.backlash.b_t_deg
    found = _assemble(
        unit,
        fitted.ratios,
        np.full_like(fitted.ratios, b_t),
        fitted.weight,
        fitted.curve,
        tuple(warnings),
        effort.simulated_s,
    )
    return replace(found, refuted=bool(fitted.warnings))


def free_axes(unit: Unit, total_backlash_unknown: bool = False) -> tuple[Axis, ...]:
    """What is free in an estimate of a unit (see `estimate_response`)."""
    if unit.stages == 1:
        return (_play_axis(unit),)
    if total_backlash_unknown:
        return replace(RATIO, coarse=17, scale=0.12), total_axis(unit)
    return (RATIO,)


def total_axis(unit: Unit) -> Axis:
    """The total backlash as a second axis of an estimate, which a grid runs through."""
    b_t = unit.backlash.b_t_deg

    def put(machine: Machine, value: float) -> Machine:
        return replace(machine, b_t_deg=value)

    return Axis("b_t_deg", 0.5 * b_t, 2.0 * b_t, 9, 0.2 * b_t, put)


def _play_axis(unit: Unit) -> Axis:
    """The total backlash of a drive with one stage, which holds all of it."""
    b_t = unit.backlash.b_t_deg

    def put(machine: Machine, value: float) -> Machine:
        return replace(machine, ratio=1.0, b_t_deg=value)

    return Axis("b_t_deg", 0.2 * b_t, 3.0 * b_t, 33, 0.2 * b_t, put)


def _from_posterior(
    unit: Unit,
    posterior: Posterior,
    curve: IndexCurve | None,
    warnings: tuple[str, ...],
    simulated_s: float,
) -> Estimate:
    mesh = list(np.meshgrid(*posterior.values, indexing="ij"))
    if unit.stages == 1:
        mesh = [np.ones_like(mesh[0]), *mesh]
    ratios = mesh[0].ravel()
    total = mesh[1].ravel() if len(mesh) > 1 else np.full(ratios.shape, unit.backlash.b_t_deg)
    weight = posterior.weight.ravel()
    return _assemble(unit, ratios, total, weight, curve, warnings, simulated_s)


def _assemble(
    unit: Unit,
    ratios: NDArray[np.float64],
    total_deg: NDArray[np.float64],
    weight: NDArray[np.float64],
    curve: IndexCurve | None,
    warnings: tuple[str, ...],
    simulated_s: float,
) -> Estimate:
    """Equations (15) and (20) applied to every place of the posterior."""
    found = backlash_of_places(unit, ratios, total_deg, weight)
    return Estimate(
        unit=unit.name,
        contribution_ratio=found.contribution_ratio,
        b1_deg=found.b1_deg,
        b2_deg=found.b2_deg,
        b_t_deg=found.b_t_deg,
        curve=curve,
        warnings=warnings,
        simulated_s=simulated_s,
        believed=believed_document(unit),
        b3_deg=found.b3_deg,
    )
