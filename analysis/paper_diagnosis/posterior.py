"""What to believe of the sets that were simulated: probabilities, a verdict, the error index.

Owns the prior over sets, which pays for every further cause, and the words
of the verdict. It simulates nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from analysis.estimate.error_index import error_index
from analysis.paper_diagnosis.evidence import Agreement, RatioPrior, agree
from analysis.paper_diagnosis.features import Reading
from analysis.paper_diagnosis.pairs import VISCOUS, possible_pairs
from analysis.paper_diagnosis.simulation import Explored

__all__ = ["Belief", "Index", "Judged", "Knowledge", "believe", "index_of"]

Word = Literal["consistent", "explained", "ambiguous", "unexplained"]

_ORDERS = (1.0, 0.5, 0.25)
"""Prior weight of no cause, of one and of two; shared alike by all sets of an order."""

_UNLIKE = 0.02
"""A measurement is unlike a set of whose own runs fewer than this share would agree worse."""

_SURE = 0.8
"""Probability from which one set is the explanation."""

_WORTH_NAMING = 0.02

_EVIDENCE_STD = 1.0
"""Error of a log-evidence from the runs that it rests on; searches of other seeds differ by it."""

_NOT_TOLD_APART = 3.0
"""Sets whose log-evidence differs by less than this (1 in 20) are not told apart."""

_EVIDENCE_DRAWS = 1000
_RUNS = 20_000


@dataclass(frozen=True, slots=True)
class Knowledge:
    """What is known before: the ratio or nothing, and effects that a measurement rules out."""

    prior: RatioPrior
    excluded: tuple[str, ...] = ()


@dataclass(frozen=True)
class Judged:
    """A set with its agreement and its probability among all that were simulated."""

    agreement: Agreement
    probability: float

    @property
    def effects(self) -> tuple[str, ...]:
        """Identifiers of its effects."""
        return self.agreement.hypothesis.effects

    @cached_property
    def probability_of_worse(self) -> float:
        """Share of its own readings that would agree worse with it."""
        return self.agreement.probability_of_worse()

    @property
    def adequate(self) -> bool:
        """Whether the measurement looks like one of its runs."""
        return self.probability_of_worse >= _UNLIKE


@dataclass(frozen=True)
class Belief:
    """Every simulated set, most probable first, under one state of knowledge."""

    judged: tuple[Judged, ...]

    @property
    def baseline(self) -> Judged:
        """The plain model."""
        return next(one for one in self.judged if not one.effects)

    @property
    def best(self) -> Judged:
        """The most probable set whose own runs look like the measurement; else the likeliest."""
        return next((one for one in self.judged if one.adequate), self.judged[0])

    @property
    def word(self) -> Word:
        """The verdict."""
        if not self.best.adequate:
            return "unexplained"
        if not self.best.effects:
            return "consistent"
        return "explained" if self.best.probability >= _SURE * self._adequate else "ambiguous"

    @property
    def _adequate(self) -> float:
        """Probability of all sets whose own runs look like the measurement."""
        return sum(one.probability for one in self.judged if one.adequate)

    @property
    def rivals(self) -> tuple[Judged, ...]:
        """Other sets worth naming."""
        return tuple(
            one for one in self.judged if one is not self.best and one.probability >= _WORTH_NAMING
        )

    def inclusion(self) -> dict[str, float]:
        """Probability that an effect is part of the answer, most probable first."""
        shares: dict[str, float] = {}
        for one in self.judged:
            for effect in one.effects:
                shares[effect] = shares.get(effect, 0.0) + one.probability
        return dict(sorted(shares.items(), key=lambda item: -item[1]))

    def probability_of_any(self, effects: Collection[str]) -> float:
        """Probability that at least one of these effects is part of the answer."""
        return float(sum(one.probability for one in self.judged if set(one.effects) & set(effects)))

    def probability_of_only(self, effects: Collection[str]) -> float:
        """Probability that the answer is made of these effects alone, of one at least."""
        made = [one for one in self.judged if one.effects and set(one.effects) <= set(effects)]
        return float(sum(one.probability for one in made))

    def expected_index(self) -> tuple[float, float]:
        """Error index of a single run, Hz: mean and std over the sets worth naming."""
        named = [one for one in self.judged if one is self.best or one.probability > _WORTH_NAMING]
        weight = np.array([one.probability for one in named])
        weight = weight / weight.sum()
        indices = [index_of(one.agreement) for one in named]
        mean = np.array([one.expected for one in indices])
        std = np.array([one.expected_std for one in indices])
        centre = float(weight @ mean)
        return centre, float(np.sqrt(weight @ (std**2 + (mean - centre) ** 2)))

    @property
    def damping_alone(self) -> Judged | None:
        """The paper's explanation: viscous dampers and nothing else."""
        return self.best_of(VISCOUS)

    @property
    def damping_is_enough(self) -> bool:
        """Whether viscous dampers alone explain as much as the best set, and look like it."""
        alone = self.damping_alone
        return alone is not None and alone.adequate and self.behind(alone) < _NOT_TOLD_APART

    def behind(self, one: Judged) -> float:
        """By how much the log-evidence of a set lies below the greatest of those that look like it.

        Of all sets, where none does.
        """
        others = [other for other in self.judged if other.adequate] or self.judged
        most = max(other.agreement.log_evidence for other in others)
        return most - one.agreement.log_evidence

    def best_of(self, effects: Collection[str]) -> Judged | None:
        """The set with the greatest evidence among those made of these effects alone."""
        made = [one for one in self.judged if one.effects and set(one.effects) <= set(effects)]
        return max(made, key=lambda one: one.agreement.log_evidence, default=None)

    def ratio(self) -> tuple[float, float]:
        """Mean and standard deviation of the ratio over all sets by their probability."""
        moments = [one.agreement.moments() for one in self.judged]
        weight = np.array([one.probability for one in self.judged])
        mean = np.array([m[0] for m, _ in moments])
        std = np.array([s[0] for _, s in moments])
        centre = float(weight @ mean)
        return centre, float(np.sqrt(weight @ (std**2 + (mean - centre) ** 2)))


def believe(explored: Sequence[Explored], reading: Reading, knowledge: Knowledge) -> Belief:
    """Probabilities of all sets that knowledge allows; those not simulated count as nothing."""
    allowed = [one for one in explored if not set(one.effects) & set(knowledge.excluded)]
    agreements = [agree(one, reading, knowledge.prior) for one in allowed]
    causes = {one.effects[0] for one in allowed if len(one.effects) == 1}
    counts = (1, max(len(causes), 1), max(len(possible_pairs(causes)), 1))
    score = np.array(
        [
            one.log_evidence + np.log(_ORDERS[order] / counts[order])
            for one in agreements
            for order in (len(one.hypothesis.effects),)
        ]
    )
    weight = _probabilities(score)
    order = np.argsort(-weight)
    return Belief(tuple(Judged(agreements[int(k)], float(weight[int(k)])) for k in order))


def _probabilities(score: NDArray[np.float64]) -> NDArray[np.float64]:
    """Probabilities of sets from their log-scores, averaged over the error of these."""
    rng = np.random.default_rng(0)
    drawn = score + _EVIDENCE_STD * rng.standard_normal((_EVIDENCE_DRAWS, len(score)))
    weight = np.exp(drawn - drawn.max(axis=1, keepdims=True))
    return np.asarray(np.mean(weight / weight.sum(axis=1, keepdims=True), axis=0))


@dataclass(frozen=True, slots=True)
class Index:
    """The error index, equation (21), of one set, Hz.

    Parameters
    ----------
    value, std
        At the likeliest place, and its spread from single runs and reading.
    expected, expected_std
        Of a single run over all places by their probability.
    floor
        What it would be on average if the set were the truth: two runs differ too.
    """

    value: float
    std: float
    expected: float
    expected_std: float
    floor: float


def index_of(agreement: Agreement, seed: int = 0) -> Index:
    """The error index that a set leaves."""
    measured = agreement.reading.values
    mean, _ = agreement.at_best
    rng = np.random.default_rng(seed)
    at_best = agreement.draw_runs(_RUNS, rng, at_best=True)
    anywhere = _single(agreement.draw_runs(_RUNS, rng), measured)
    return Index(
        value=float(_single(mean[None], measured)[0]),
        std=float(np.std(_single(at_best, measured))),
        expected=float(np.mean(anywhere)),
        expected_std=float(np.std(anywhere)),
        floor=float(np.mean(_single(at_best, mean))),
    )


def _single(runs: NDArray[np.float64], against: NDArray[np.float64]) -> NDArray[np.float64]:
    return error_index(runs[:, 0], runs[:, 2], against[0], against[2]).value_hz
