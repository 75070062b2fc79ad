"""What a diagnosis is asked, handed from stage to stage.

Owns the names of what every stage needs. It answers nothing.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

from analysis.diagnosis.stages import Record
from analysis.execution.executor import Executor
from analysis.inference.posterior import Posterior
from analysis.observation.observation import Observation
from sim.unit import Unit

__all__ = ["Question"]


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """What was measured of which unit, and with what it is explained.

    `without`: effects that are left out of the catalogue. `record`: of the stages so far.
    """

    observed: Observation
    unit: Unit
    posterior: Posterior
    without: Collection[str] = ()
    seed: int = 0
    executor: Executor | None = None
    record: Record = field(default_factory=Record)
