"""The search for what the paper's simulation lacks: single causes, then pairs.

Owns the order of the search. Where runs go is `analysis.paper_diagnosis.simulation`,
what agreement is `analysis.paper_diagnosis.evidence`; no verdict is given here.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from analysis.ensemble.model import Hypothesis, every_single_cause
from analysis.execution.progress import Progress
from analysis.paper_diagnosis.evidence import RatioPrior, agree
from analysis.paper_diagnosis.features import Reading
from analysis.paper_diagnosis.pairs import VISCOUS, GuessedPair, guess_pairs, possible_pairs
from analysis.paper_diagnosis.simulation import Explored, Explorer

__all__ = ["search_sets"]


_HEAT, _MARGIN = 2.0, 0.05
_SINGLES_SHARE = 0.6
"""Share of the work that goes into single causes."""


def search_sets(
    explorer: Explorer,
    reading: Reading,
    priors: Sequence[RatioPrior],
    *,
    without: Collection[str] = (),
    progress: Progress,
) -> list[Explored]:
    """The plain model, every single cause, and the pairs most likely to agree, all simulated.

    Parameters
    ----------
    priors
        States of knowledge of the ratio; each may have its say in what is simulated closer.
    without
        Effects to leave out.
    """
    effort = explorer.effort
    hypotheses = [Hypothesis(explorer.unit)]
    hypotheses += [h for h in every_single_cause(explorer.unit) if h.effects[0] not in without]
    found = []
    for number, hypothesis in enumerate(hypotheses):
        name = "+".join(hypothesis.effects) or "the plain model"
        progress(_SINGLES_SHARE * number / len(hypotheses), f"simulating {name}")
        found.append(explorer.explore(hypothesis, effort.groups(hypothesis)))
    found = _refine(explorer, found, reading, priors, progress)
    chosen = _choose_pairs(found, reading, priors, effort.pairs)
    begun = _SINGLES_SHARE + 0.1
    for number, pair in enumerate(chosen):
        share = begun + (1.0 - begun) * number / len(chosen)
        progress(share, f"simulating {' + '.join(pair.effects)}")
        hypothesis = Hypothesis(explorer.unit, pair.effects)
        found.append(explorer.explore(hypothesis, effort.pair_groups, pair.box))
    return found


def _refine(
    explorer: Explorer,
    found: list[Explored],
    reading: Reading,
    priors: Sequence[RatioPrior],
    progress: Progress,
) -> list[Explored]:
    """The causes that agree best under any of the priors, with further runs where they do."""
    held = [[agree(one, reading, prior) for one in found[1:]] for prior in priors]
    wanted: list[int] = []
    for agreements in held:
        order = np.argsort([-one.log_evidence for one in agreements])
        wanted += [int(k) for k in order[: -(-explorer.effort.refined // len(priors))]]
    result = list(found)
    for number, k in enumerate(dict.fromkeys(wanted)):
        progress(_SINGLES_SHARE + 0.1 * number / len(wanted), "refining the best causes")
        best = max((agreements[k] for agreements in held), key=lambda one: one.log_evidence)
        box = best.box(_HEAT, _MARGIN)
        result[k + 1] = explorer.refine(found[k + 1], explorer.effort.refinement, box)
    return result


def _choose_pairs(
    found: Sequence[Explored], reading: Reading, priors: Sequence[RatioPrior], count: int
) -> list[GuessedPair]:
    """The best pairs under each prior, and the best of viscous dampers alone under any."""
    pairs = possible_pairs([one.effects[0] for one in found[1:]])
    chosen: dict[tuple[str, ...], GuessedPair] = {}
    viscous: list[GuessedPair] = []
    for prior in priors:
        guessed = guess_pairs(found[0], found[1:], reading, prior, pairs)
        for one in guessed[:count]:
            chosen[one.effects] = _joined(one, chosen.get(one.effects))
        viscous += [one for one in guessed if set(one.effects) <= set(VISCOUS)][:1]
    if viscous and count:
        most = max(viscous, key=lambda one: one.log_evidence)
        chosen.setdefault(most.effects, most)
    return list(chosen.values())


def _joined(one: GuessedPair, other: GuessedPair | None) -> GuessedPair:
    """A pair over both boxes."""
    if other is None:
        return one
    low = np.minimum(one.box[:, 0], other.box[:, 0])
    high = np.maximum(one.box[:, 1], other.box[:, 1])
    most = max(one.log_evidence, other.log_evidence)
    return GuessedPair(one.effects, most, np.column_stack([low, high]))
