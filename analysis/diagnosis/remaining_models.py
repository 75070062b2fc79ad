"""The models of a unit that a diagnosis leaves, each with the backlash that it tells.

Owns which of the judged sets may be true beside the one that is accepted, and the sizing of
those. It judges none of them and simulates nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.answer import model_name
from analysis.emulation.model_parameters import estimate_parameters, widen_if_open
from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.estimate.backlash import Backlash, backlash_of_sizes
from analysis.observation.observation import Observation
from analysis.selection.verdict import Judged, Verdict, Word

__all__ = ["Model", "backlash_document", "backlash_lines", "find_remaining_models"]

_OPEN = 0.05
"""So much must be believed of another set to stay open: what is left of a probability of 0.95."""

_RUNS = 720
"""Most runs that take part in sizing a set beside the accepted one."""


@dataclass(frozen=True, slots=True)
class Model:
    """A set of causes that may be true (none: the plain model), its probability, its backlash."""

    causes: tuple[str, ...]
    probability: float
    backlash: Backlash

    def to_json(self) -> dict[str, Any]:
        """One entry of ``models``."""
        return {
            "causes": list(self.causes),
            "probability": self.probability,
            **self.backlash.to_json(),
        }


def find_remaining_models(
    verdict: Verdict,
    best: ParameterPosterior,
    plain: ParameterPosterior,
    observation: Observation,
    rng: np.random.Generator,
) -> tuple[Model, ...]:
    """The accepted or likeliest model first, then every other one that is left.

    None is left where nothing explains the response, and one where a diagnosis explains it.

    Parameters
    ----------
    best, plain
        Ratio and sizes of the set that stands first, and those of the plain model.
    """
    if verdict.word == "unexplained":
        return ()
    first = verdict.best
    found = [_model(first, verdict.probability if first.effects else first.probability, best)]
    for one in _others(verdict):
        sized = plain if not one.effects else _sized(one, observation, rng)
        found.append(_model(one, one.probability, sized))
    return tuple(found)


def backlash_document(
    models: Sequence[Model],
    word: Word,
    baseline: tuple[float, float],
    extended: tuple[float, float],
) -> dict[str, Any]:
    """The backlash in the document of a diagnosis with that word, null where none is accepted.

    Parameters
    ----------
    baseline, extended
        Contribution ratio and its standard deviation by the plain model and by the named causes.
    """
    accepted = _accepted(models, word)
    ratios = {
        name: {"value": value, "std": std}
        for name, (value, std) in (("baseline", baseline), ("extended", extended))
    }
    stages: dict[str, Any] = dict.fromkeys(("b1_deg", "b2_deg", "b_t_deg"))
    if accepted is not None:
        numbers = accepted.backlash.to_json()
        ratios["extended"] |= {"interval95": numbers["contribution_ratio"]["interval95"]}
        stages = {name: number for name, number in numbers.items() if name != "contribution_ratio"}
    return {
        "contribution_ratio": ratios,
        **stages,
        "models": [one.to_json() for one in models],
    }


def backlash_lines(models: Sequence[Model], word: Word) -> list[str]:
    """The backlash by the accepted model, or by each one that is left, for a person."""
    accepted = _accepted(models, word)
    if accepted is not None:
        model = "extended model" if accepted.causes else "plain model"
        return [f"backlash by stage, {model}:", *accepted.backlash.lines("  ")]
    if not models:
        return ["backlash by stage: none told, as no model explains the response"]
    lines = ["backlash by stage, by each model that is left:"]
    for one in models:
        lines.append(f"  {model_name(one.causes)} (probability {one.probability:.2f}):")
        lines += one.backlash.lines("    ")
    return lines


def _accepted(models: Sequence[Model], word: Word) -> Model | None:
    return models[0] if models and word in ("consistent", "explained") else None


def _others(verdict: Verdict) -> tuple[Judged, ...]:
    """Rivals, and what else is likely; none where a diagnosis explains, as it then names one."""
    if verdict.word == "explained":
        return ()
    rivals = verdict.rivals if verdict.word == "ambiguous" else ()
    return tuple(
        one
        for one in verdict.judged
        if one is not verdict.best
        and (one in rivals or one.adequate and one.probability >= _OPEN)
        and not verdict.is_equivalent(one)
    )


def _sized(one: Judged, observation: Observation, rng: np.random.Generator) -> ParameterPosterior:
    found = estimate_parameters(one.candidate, observation, rng, _RUNS)
    return widen_if_open(found, one.candidate, observation, rng, _RUNS)


def _model(one: Judged, probability: float, found: ParameterPosterior) -> Model:
    backlash = backlash_of_sizes(one.candidate.hypothesis, found)
    return Model(one.effects, probability, backlash)
