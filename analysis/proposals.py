"""Two ways from an observation to candidates: the search, and the trained posterior.

Owns the choice between them until the paired study has decided which one stays, and what both give:
candidates with runs, and how large other causes may be. It judges no candidate.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from analysis.bounds import bound_beside, bound_causes
from analysis.calibration import Calibrated
from analysis.candidate import Candidate
from analysis.executor import Executor
from analysis.inference.posterior import Posterior, limits
from analysis.inference.refine import refine
from analysis.observation import Observation
from analysis.progress import Progress
from analysis.search import search_causes
from analysis.unseen import Unseen
from analysis.verdict import Verdict
from daq.errors import AnalysisError
from sim.unit import Unit

__all__ = ["Proposed", "Way", "propose"]

Way = Literal["search", "posterior"]


@dataclass(frozen=True, slots=True, eq=False)
class Proposed:
    """Candidates, the likeliest first, the baseline among them.

    `unseen`: what else may be there, by the verdict and what is known of its best set. `cut_short`:
    whether not every set was tried that was worth it, by the verdict's word. `lent_by`: the unit
    whose posterior was used, where this one has none.
    """

    candidates: list[Candidate]
    unseen: Callable[[Verdict, Calibrated], tuple[Unseen, ...]]
    cut_short: Callable[[str], bool] = lambda word: False
    lent_by: str = ""


def propose(
    way: Way,
    unit: Unit,
    observation: Observation,
    *,
    without: Collection[str] = (),
    cache: Path | None = None,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Proposed:
    """Candidates for what may be hidden in a unit.

    Raises
    ------
    AnalysisError
        If a motion grew without bound, or no posterior was trained for such a unit.
    """
    if way == "posterior":
        return _by_posterior(unit, observation, without, cache, seed, executor, progress)
    found = search_causes(
        unit, observation, without=without, cache=cache, seed=seed, executor=executor,
        progress=progress,
    )  # fmt: skip

    def unseen(verdict: Verdict, best: Calibrated) -> tuple[Unseen, ...]:
        if verdict.word in ("explained", "ambiguous"):
            return bound_beside(unit, found.few, found.atlas, verdict.best.candidate, best)
        return bound_causes(unit, found.few, found.atlas) if verdict.word == "consistent" else ()

    def cut_short(word: str) -> bool:
        return found.given_up or (found.spared and word == "unexplained")

    return Proposed(found.candidates, unseen, cut_short)


def _by_posterior(
    unit: Unit,
    observation: Observation,
    without: Collection[str],
    cache: Path | None,
    seed: int,
    executor: Executor | None,
    progress: Progress | None,
) -> Proposed:
    posterior = Posterior.find(unit, cache, executor)
    if posterior is None:
        raise AnalysisError(
            f"no posterior for unit {unit.name} was trained, nor for one like it; run: "
            "lashbench prepare --unit FILE"
        )
    found = refine(
        posterior, observation, without=without, seed=seed, executor=executor, progress=progress
    )

    def unseen(verdict: Verdict, best: Calibrated) -> tuple[Unseen, ...]:
        if verdict.word == "unexplained":
            return ()
        named = verdict.best.effects if verdict.word != "consistent" else ()
        return limits(posterior, found.summary, named, without)

    return Proposed(found.candidates, unseen, lent_by=posterior.lent_by)
