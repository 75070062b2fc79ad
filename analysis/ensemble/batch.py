"""Families: machines that share their linear part, what every ensemble is made of.

Owns what travels to a worker and what comes back: machines and plans, readings
free of any bench's noise; and which families are a task together. It chooses no machines, keeps
no runs and judges none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble.machine import Machine, safe_cycles
from analysis.execution.executor import Executor, LocalExecutor
from analysis.observation.observation import readings_of_cycles
from daq.plan import SweepPlan
from sim.engine.stepping import shared_out
from sim.unit import Unit

__all__ = ["Family", "Readings", "read_families", "read_family"]

Readings = tuple[NDArray[np.complex128], NDArray[np.float64]]
"""Mean of V_o/V_i and its relative variance, each (machines, rows)."""


@dataclass(frozen=True, slots=True)
class Family:
    """Machines that share their linear part, and so fill the lanes of one call.

    `rows` are where each plan's points stand among the rows of the readings. `components`: see
    `analysis.observation.observation.readings_of_cycles`.
    """

    unit: Unit
    machines: tuple[Machine, ...]
    plans: tuple[tuple[SweepPlan, NDArray[np.int64]], ...]
    components: int = 2


def read_family(family: Family) -> Readings:
    """Take a family through its plans, on one core.

    Raises
    ------
    AnalysisError
        If a motion grew without bound even at the shortest step.
    """
    (readings,) = _read_together([family])
    return readings


def read_families(
    families: Sequence[Family],
    executor: Executor | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Readings]:
    """Readings of the machines of each family, in their order.

    Parameters
    ----------
    families
        All of them go through the same plans, and are read alike.
    executor
        Where they are simulated; this machine's cores if not given.
    progress
        Told the share done after each task.

    Raises
    ------
    AnalysisError
        If a motion grew without bound even at the shortest step.
    """
    if not families:
        return []
    executor = executor or LocalExecutor()
    if not isinstance(executor, LocalExecutor):
        return executor.each(read_family, families, progress)
    levels = max(len(plan.levels_vpk) for plan, _ in families[0].plans)
    lanes = levels * max(len(one.machines) for one in families)
    kinds = [tuple(effect.id for effect in one.machines[0].effects) for one in families]
    lots = shared_out(kinds, executor.cores, lanes)
    tasks = [[families[i] for i in lot] for lot in lots]
    found: dict[int, Readings] = {}
    for lot, read in zip(lots, executor.each(_read_together, tasks, progress), strict=True):
        found |= zip(lot, read, strict=True)
    return [found[i] for i in range(len(families))]


def _read_together(families: Sequence[Family]) -> list[Readings]:
    """Take families that go through the same plans there side by side, on one core."""
    servos = [[m.servo(one.unit) for m in one.machines] for one in families]
    plans = families[0].plans
    count = sum(len(rows) for _, rows in plans)
    mean = np.empty((sum(map(len, servos)), count), dtype=complex)
    variance = np.empty(mean.shape)
    for plan, rows in plans:
        for i, cycles in enumerate(safe_cycles(list(chain(*servos)), plan, workers=1)):
            first = cycles[..., 1].reshape(len(rows), -1)
            mean[i, rows], variance[i, rows] = readings_of_cycles(first, families[0].components)
    ends = np.cumsum([len(some) for some in servos])[:-1]
    return list(zip(np.split(mean, ends), np.split(variance, ends), strict=True))
