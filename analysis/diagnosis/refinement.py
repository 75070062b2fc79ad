"""Closer looks at a named candidate, for its parameters alone.

Owns how many further runs the answer gets once it is known which hypothesis it
is. They take no part in the judgement: more runs fit better, and the rivals
have none of these.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from analysis.emulation.datasheet_range import datasheet_range
from analysis.emulation.fitted_model import FittedModel
from analysis.emulation.model_parameters import estimate_parameters, widen_if_open
from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.runs import simulate_groups
from analysis.execution.executor import Executor
from analysis.inference.run_design import runs_around_estimate
from analysis.observation.observation import Observation
from sim.engine.effort import counting
from sim.unit import Unit

__all__ = ["refine_parameters"]

_ROUNDS, _GROUPS = 12, 8
_SHARP = 0.035
"""Standard deviation of every coordinate from which on nothing more is simulated."""
_WORTHWHILE, _BACK = 0.9, 2
"""Nor where two rounds left the largest of them above this share of what it was. What few runs say
of their error is uncertain itself, so that a single round may seem worthless by chance."""

_BLUNT, _ENOUGH = 0.025, 720
"""While the contribution ratio is known no better than this neither counts, up to so many runs:
from then on it ends as soon as these lie far enough apart.
Little of it is in the data then, and what is told is as much chance of where runs lie: of sixteen
hundred about the answer to one practice set, hundreds told ratios 0.04 apart in standard deviation,
or 0.01 where all of them took part."""

_SWEEPS, _LEAST_S = 180, 27_600.0
"""There is no further round after so many machines, or so many seconds of motion where these are
more. It is motion of a plain unit: what takes longer to step costs more (`sim.engine.effort`)."""

_APART = 1.5
"""Nor is either believed while the runs lie closer together than so many of those standard
deviations: what is learned from runs is never more wrong than they are apart. Runs drawn evenly
over three standard deviations on either side lie 1.7 apart."""


def refine_parameters(
    unit: Unit,
    candidate: FittedModel,
    observation: Observation,
    rng: np.random.Generator,
    executor: Executor | None = None,
    progress: Callable[[float], None] | None = None,
) -> ParameterPosterior:
    """Mean (d,) and covariance (d, d) of the coordinates, after runs about where they lie.

    The ratio of a drive with one stage is 1 wherever they lie: its plain model gets no runs.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    key = candidate.hypothesis.effects
    about = {key: datasheet_range(candidate)}
    found = estimate_parameters(candidate, observation, rng, _ENOUGH)
    one_stage = unit.stages == 1
    free = slice(1, None) if one_stage else slice(None)
    widest: list[float] = []
    most_s = max(_SWEEPS * sum(plan.duration_s for plan, _ in observation.plans), _LEAST_S)
    with counting() as effort:
        while len(widest) < _ROUNDS and effort.worth_s <= most_s:
            std = np.sqrt(np.diag(found.covariance))[free]
            if not std.size:
                break
            widest.append(std.max())
            if not one_stage and std[0] > _BLUNT:
                learned = len(candidate.population) >= _ENOUGH
            else:
                stalled = len(widest) > _BACK and widest[-1] > _WORTHWHILE * widest[-1 - _BACK]
                learned = widest[-1] <= _SHARP or stalled
            apart = candidate.population.places.std(axis=0)[free]
            if learned and np.all(apart > _APART * std):
                break
            groups = list(runs_around_estimate(candidate.hypothesis, found, _GROUPS, rng))
            made = simulate_groups(unit, groups, observation, rng, executor, about=about)[key]
            # The surface stays as it was judged; sizing asks it for its widths alone.
            candidate = replace(candidate, population=candidate.population.joined(made))
            found = estimate_parameters(candidate, observation, rng, _ENOUGH)
            if progress is not None:
                progress(len(widest) / _ROUNDS)
    return widen_if_open(found, candidate, observation, rng, _ENOUGH)
