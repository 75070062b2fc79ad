"""From candidates to a verdict: consistent, explained or unexplained.

Owns how sets are compared: the posterior odds of each, the likeliest one, and what must hold of it
to be named. `analysis.checking.rejection` owns what speaks against one set, and
`analysis.selection.credible_set` who are its rivals. It simulates nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from analysis.checking.cross_validation import HeldOut, hold_out
from analysis.checking.equivalence import is_equivalent_at_load
from analysis.checking.goodness_of_fit import judge_adequacy, judge_chance
from analysis.checking.rejection import OUT_OF_SIGHT, find_rejection
from analysis.emulation.fitted_model import Effects, FittedModel
from analysis.emulation.likelihood import TEMPERATURE
from analysis.observation.observation import Observation

__all__ = [
    "BY_CHANCE",
    "WITHIN_TOLERANCE",
    "Judged",
    "Verdict",
    "Word",
    "is_by_chance",
    "is_within_tolerance",
    "judge_candidates",
    "rank_behind",
]

Word = Literal["consistent", "explained", "ambiguous", "unexplained"]

_FAR = 3.0 * TEMPERATURE
"""Sets this far behind the first have a twentieth of its probability or less. They are not held
against runs of their own, which takes seconds and changes nothing; the baseline always is, and so
are parts of the first."""

_BY_CHANCE = 0.04
"""In at most this share of replicates of the plain model may causes gain as much."""

_JUDGED = 6

WITHIN_TOLERANCE = "within the tolerance of the datasheet"
BY_CHANCE = "gains no more than by chance where nothing is hidden"
_NOT_ASKED = "too improbable to be checked"


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """A candidate with its score, its probability among those judged and what speaks against it.

    `misfit`, `structure`: standard deviations by which it is fitted worse than
    runs of its own, and by which that leaves more structure; NaN where it was not
    asked of a set far behind. `objection`: why it is no explanation, empty where
    it may be one.
    """

    candidate: FittedModel
    held_out: HeldOut
    score: float
    misfit: float
    structure: float
    probability: float
    objection: str

    @property
    def effects(self) -> tuple[str, ...]:
        """Identifiers of its effects."""
        return self.candidate.hypothesis.effects

    @property
    def adequate(self) -> bool:
        """Whether it may be the explanation, as far as that was asked."""
        return not self.objection

    @property
    def refused(self) -> bool:
        """Whether it was asked, and something speaks against it."""
        return self.objection not in ("", _NOT_ASKED)


@dataclass(frozen=True, slots=True, eq=False)
class Verdict:
    """The word, the best set, every set judged (best first), and the baseline among them.

    `rivals`: sets that may be the explanation in place of the best one, which is then "ambiguous".
    """

    word: Word
    best: Judged
    judged: tuple[Judged, ...]
    baseline: Judged
    rivals: tuple[Judged, ...] = ()

    @property
    def probability(self) -> float:
        """That the causes of the best set are there.

        With what is believed of sets that say the same with more sizes, or hold these causes and
        more.
        """
        return self.best.probability + sum(
            one.probability for one in self.judged if self._has(one) or self.is_equivalent(one)
        )

    def counts_for_best(self, one: Judged) -> bool:
        """Whether what is believed of a set is believed of the best one, and of no further cause.

        Of one that says the same, or has more causes and does no better.
        """
        return self._has(one) and one.score <= self.best.score or self.is_equivalent(one)

    def _has(self, one: Judged) -> bool:
        return bool(self.best.effects) and set(one.effects) > set(self.best.effects)

    def remark(self, one: Judged) -> str:
        """What speaks against a set, or makes it no rival; empty where nothing does."""
        if self.is_equivalent(one):
            return "equivalent, with more parameters"
        if one.effects and is_within_tolerance(one.candidate):
            return WITHIN_TOLERANCE
        return one.objection if one.refused else ""

    def is_equivalent(self, one: Judged) -> bool:
        """Whether a set says with more sizes what the best does."""
        # What swings out of sight is felt as a load or a brake and as nothing else: what is
        # believed of it is believed of that.
        may = one.adequate or one.objection == OUT_OF_SIGHT
        return may and is_equivalent_at_load(one.candidate, self.best.candidate)


def judge_candidates(
    candidates: Sequence[FittedModel],
    observation: Observation,
    rng: np.random.Generator,
    log_odds: Mapping[Effects, float],
) -> Verdict:
    """Judge the leading candidates and the baseline.

    Parameters
    ----------
    log_odds
        Of each candidate; see `analysis.inference.odds`.

    Notes
    -----
    The score is the logarithm of the posterior odds, in units of 1 / `TEMPERATURE`. The network
    pays for further causes, as it has learned how many there are.
    """
    scores = {effects: TEMPERATURE * odds for effects, odds in log_odds.items()}
    chosen = _worth_judging(candidates, scores)
    judged = _ranked([_unasked(c, observation, scores[c.hypothesis.effects]) for c in chosen])
    judged = _ask(judged, rng)
    best = _simplest(judged)
    (baseline,) = (one for one in judged if not one.effects)
    if best.effects and baseline.adequate and is_by_chance(baseline.candidate, best.candidate, rng):
        ahead = [one for one in judged if one.score > baseline.score]
        judged = rank_behind(judged, ahead, baseline, BY_CHANCE)
        best = baseline = next(one for one in judged if not one.effects)
    if not best.adequate:
        return Verdict("unexplained", best, judged, baseline)
    return Verdict("explained" if best.effects else "consistent", best, judged, baseline)


def _simplest(judged: Sequence[Judged]) -> Judged:
    """The first set, or what says the same with fewer sizes and may be the explanation."""
    first = judged[0]
    alike = (one for one in judged if one.adequate)
    return next(
        (one for one in alike if is_equivalent_at_load(first.candidate, one.candidate)), first
    )


def is_by_chance(simpler: FittedModel, best: FittedModel, rng: np.random.Generator) -> bool:
    """Whether a set leads a simpler one as it does in runs of that one's own.

    These say nothing about an observation that is unlike them: the simpler one is adequate.
    """
    return judge_chance(simpler, best, rng) > _BY_CHANCE


def _worth_judging(
    candidates: Sequence[FittedModel], scores: Mapping[Effects, float]
) -> list[FittedModel]:
    """Those that score best; what they may be held against; the baseline.

    That is every part of theirs, and what says the same with fewer sizes.
    """
    by_score = sorted(candidates, key=lambda c: -scores[c.hypothesis.effects])
    chosen = by_score[:_JUDGED]
    for other in by_score[_JUDGED:]:
        effects = set(other.hypothesis.effects)
        part = any(effects < set(one.hypothesis.effects) for one in chosen)
        if part or any(is_equivalent_at_load(one, other) for one in chosen[:_JUDGED]):
            chosen.append(other)
    return chosen


def _ask(judged: Sequence[Judged], rng: np.random.Generator) -> tuple[Judged, ...]:
    """Ask what speaks against the leading ones and the parts of the first; the baseline is one."""
    first = judged[0]
    asked = []
    for one in judged:
        part = set(one.effects) < set(first.effects) or not one.effects
        near = one.score > first.score - _FAR
        if one.objection != _NOT_ASKED or not (part or near):
            asked.append(one)
            continue
        fitted = judge_adequacy(one.candidate, rng)
        objection = find_rejection(one.candidate, one.held_out, fitted)
        asked.append(
            replace(one, misfit=fitted.sigma, structure=fitted.structure, objection=objection)
        )
    return tuple(asked)


def rank_behind(
    judged: Sequence[Judged], ahead: Sequence[Judged], part: Judged, objection: str
) -> tuple[Judged, ...]:
    """Put sets that owe their lead to chance far behind the part that does as well."""
    least = part.score - _FAR
    return _ranked(
        [
            replace(one, score=min(one.score, least), objection=objection) if one in ahead else one
            for one in judged
        ]
    )


def _ranked(judged: Sequence[Judged]) -> tuple[Judged, ...]:
    """The best first, with what is believed of each."""
    scores = np.array([one.score for one in judged])
    weight = np.exp((scores - scores.max()) / TEMPERATURE)
    shares = weight / weight.sum()
    believed = [replace(o, probability=float(p)) for o, p in zip(judged, shares, strict=True)]
    return tuple(sorted(believed, key=lambda one: -one.score))


def _unasked(candidate: FittedModel, observation: Observation, score: float) -> Judged:
    """A candidate with its score; what speaks against it is still to be asked."""
    held_out = hold_out(candidate, observation)
    return Judged(candidate, held_out, score, np.nan, np.nan, 0.0, _NOT_ASKED)


def is_within_tolerance(candidate: FittedModel) -> bool:
    """Whether it is the plain model, or that within the tolerance of its datasheet."""
    hypothesis = candidate.hypothesis
    return not hypothesis.effects or hypothesis.is_tolerance(candidate.best.place)
