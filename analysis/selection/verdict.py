"""From candidates to a verdict: consistent, explained, ambiguous or unexplained.

Owns how sets are compared: the posterior odds of each, the best one, the lead that it needs, and
its rivals. `analysis.checking.rejection` owns what speaks against one
set. It simulates nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from analysis.checking.cross_validation import HeldOut, hold_out
from analysis.checking.equivalence import is_equivalent_at_load
from analysis.checking.goodness_of_fit import judge_adequacy, judge_chance
from analysis.checking.rejection import FEW, OUT_OF_SIGHT, find_rejection
from analysis.emulation.fitted_model import Effects, FittedModel
from analysis.emulation.likelihood import TEMPERATURE
from analysis.observation.observation import Observation

__all__ = [
    "BY_CHANCE",
    "FALSE_ALARM",
    "WITHIN_TOLERANCE",
    "Judged",
    "Verdict",
    "Word",
    "is_within_tolerance",
    "judge_candidates",
    "rank_behind",
]

Word = Literal["consistent", "explained", "ambiguous", "unexplained"]

_RARE = TEMPERATURE * float(np.log(10.0))
"""Lead of a common cause over a rare one: it is taken for ten times less likely. That
says which of two that do alike is named first. The less common one stays a rival."""

FALSE_ALARM = 20.0
"""By so much must a cause beat the baseline."""

_SURE = 3.0 * TEMPERATURE
"""While it leads by less than this, that nothing is hidden has a twentieth of its probability or
more, and is a rival: causes that nobody thought of are blamed on others by leads like these.
Sets further behind are not held against runs of their own, which takes seconds and changes
nothing; the baseline always is, and so are parts of the leader."""

_BY_CHANCE = 0.04
"""In at most this share of replicates of the plain model may causes gain as much."""

_TIE = 20.0
"""The scores of two sets that say the same about everything differ by about as much, as each has
runs of its own."""

_RIVAL, _RARE_RIVAL = 2.0 * TEMPERATURE, TEMPERATURE
"""Within so much of the best, a set is a rival; and a rare one, but for being rare. Of seventeen
rare causes that were hidden two stood behind the leader but for that, by 6 at most."""

_LIKELY = 0.5
"""Where less than this is believed of the best and of all that hold it, those that are refused, and
are believed in its place, are rivals: of 142 sets drawn and named so two had less, both wrong."""

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

    `also`: rivals whatever their scores, as a further cause of the best set may be none, or too
    little is believed of it.
    """

    word: Word
    best: Judged
    judged: tuple[Judged, ...]
    baseline: Judged
    also: tuple[Judged, ...] = ()

    @property
    def rivals(self) -> tuple[Judged, ...]:
        """Sets near the best one that say something else, and might be the explanation.

        Among them that nothing is hidden, which has a wider margin, and is one though refused where
        the best leads it by less than it takes to be named. A set that would be no explanation if
        it led is none as a rival, nor is one that is equivalent, with more parameters: what is
        believed of that counts for the best. One that is refused though it leads is: the best is
        then likeliest only among what is left. So is any near the best where more is believed of
        others than of that.
        """
        said = [self.best.score, *(one.score for one in self.judged if self.is_equivalent(one))]
        believed = TEMPERATURE * float(np.logaddexp.reduce(np.array(said) / TEMPERATURE))
        return tuple(
            one for one in self.judged if one in self.also or self._is_rival(one, believed)
        )

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

    def _is_led_by(self, one: Judged) -> bool:
        """Whether a refused set does better by little, so that the best stands in its place."""
        return one.refused and self.best.score < one.score < self.best.score + _TIE

    def _is_likely(self) -> bool:
        """Whether more is believed of the best, and of sets that hold it, than of all others.

        It never is of more than `FEW` causes, which stood for what nobody knew before.
        """
        if len(self.best.effects) > FEW:
            return False
        return self.probability >= _LIKELY

    def _is_rival(self, one: Judged, believed: float) -> bool:
        behind, best = believed - one.score, set(self.best.effects)
        if not one.effects and best:
            lead = self.best.score - one.score
            # Refused it is no explanation, and what leads it by little has hardly earned its name.
            return lead < _SURE if one.adequate else one.refused and 0.0 < lead < FALSE_ALARM
        other = not set(one.effects) <= best and not set(one.effects) >= best
        if self._is_led_by(one) or one.refused and behind < _RIVAL and not self._is_likely():
            return other and not is_equivalent_at_load(one.candidate, self.best.candidate)
        rarer = one.candidate.hypothesis.rare > self.best.candidate.hypothesis.rare
        if not other or not one.adequate or behind >= (_RARE + _RARE_RIVAL if rarer else _RIVAL):
            return False
        return not self.is_equivalent(one)


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
    best = _leader(judged)
    (baseline,) = (one for one in judged if not one.effects)
    little = best.score < baseline.score + FALSE_ALARM
    if baseline.adequate and not little and _may_be_chance(baseline, best, rng):
        ahead = [one for one in judged if one.score > baseline.score]
        judged = rank_behind(judged, ahead, baseline, BY_CHANCE)
        (baseline,) = (one for one in judged if not one.effects)
        return Verdict("consistent", baseline, judged, baseline)
    if little:
        if baseline.adequate:
            return Verdict("consistent", baseline, judged, baseline)
        tie = Verdict("ambiguous", best, judged, baseline)
        enough = any(one.adequate or one is baseline for one in tie.rivals)
        if best.effects and best.adequate and enough:
            # Something is missing, too little of it to say which of several it is, or to be sure
            # of the one that there is.
            return tie
        return Verdict("unexplained", baseline, judged, baseline)
    verdict = Verdict("explained", best, judged, baseline)
    if not best.adequate:
        return Verdict("unexplained", best, judged, baseline)
    if verdict.rivals:
        return Verdict("ambiguous", best, judged, baseline)
    return verdict


def _may_be_chance(simpler: Judged, best: Judged, rng: np.random.Generator) -> bool:
    """Whether a set leads a simpler one as it does in runs of that one's own.

    These say nothing about an observation that is unlike them: the simpler one is adequate.
    """
    return judge_chance(simpler.candidate, best.candidate, rng) > _BY_CHANCE


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
        near = one.score > first.score - _SURE - _RARE * one.candidate.hypothesis.rare
        if one.objection != _NOT_ASKED or not (part or near):
            asked.append(one)
            continue
        fitted = judge_adequacy(one.candidate, rng)
        objection = find_rejection(one.candidate, one.held_out, fitted, rng)
        asked.append(
            replace(one, misfit=fitted.sigma, structure=fitted.structure, objection=objection)
        )
    return tuple(asked)


def _leader(judged: Sequence[Judged]) -> Judged:
    """The best set.

    If something speaks against the first and nothing against another within `_TIE`, that one leads.
    So does one that says the same with fewer sizes.
    """
    tied = [one for one in judged if one.score > judged[0].score - _TIE and one.adequate]
    best = tied[0] if tied else judged[0]
    for one in tied:
        if is_equivalent_at_load(best.candidate, one.candidate):
            best = one
    return best


def rank_behind(
    judged: Sequence[Judged], ahead: Sequence[Judged], part: Judged, objection: str
) -> tuple[Judged, ...]:
    """Put sets that owe their lead to chance far behind the part that does as well."""
    least = part.score - _SURE
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
