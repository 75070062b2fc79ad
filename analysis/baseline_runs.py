"""Runs of the plain model on all rows: as many as what leads it has, before it is believed or left.

Owns when it lacks them. A sharp resonance makes few of its own runs fit each other badly, and
nearly anything explains some of them better. It passes no verdict.
"""

from __future__ import annotations

import numpy as np

from analysis.adequacy import judge_adequacy
from analysis.hunt import Hunt
from analysis.verdict import LEAST_LEAD, may_be_chance

__all__ = ["level_baseline", "weigh_baseline"]

_GROUPS = 6
"""In how many groups it gets more."""

_FAR = 2.0 * LEAST_LEAD
"""Log-likelihood by which what leads the plain model, with more runs, asks for as many of that
before nothing is said to be missing: 29 % more play led by 168, and of thirty runs of the plain
model, which fit each other badly, a fifth were explained better by as much."""


def level_baseline(fine: Hunt) -> bool:
    """Give the plain model as many runs as what leads it by far; whether it had fewer."""
    had_fewer = False
    while _baseline_lacks_runs(fine, _FAR):
        fine.settle([()], _GROUPS)
        fine.hear()
        had_fewer = True
    return had_fewer


def weigh_baseline(fine: Hunt, rng: np.random.Generator) -> None:
    """Give the plain model more runs where few of its own say that the leader leads by chance.

    They fit each other badly, and what leads has more: larger play led by 178, and by as much in
    three of the 39 runs that the plain model could be asked about.
    """
    while _baseline_lacks_runs(fine, LEAST_LEAD):
        baseline = fine.found[()]
        # Chance of its own: where it is not called for all comes out as if it had not been asked.
        own = rng.spawn(1)[0]
        if not may_be_chance(baseline, fine.best, judge_adequacy(baseline, own).sigma, own):
            return
        fine.settle([()], _GROUPS)
        fine.hear()


def _baseline_lacks_runs(fine: Hunt, lead: float) -> bool:
    """Whether the plain model has fewer runs than what leads it by so much."""
    leader, baseline = fine.best, fine.found[()]
    leads = leader.best.log_likelihood - baseline.best.log_likelihood >= lead
    return leads and len(baseline.population) < len(leader.population)
