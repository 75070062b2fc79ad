"""Families: machines that share their linear part, the tasks that every ensemble is made of.

Owns what travels to a worker and what comes back: machines and plans, readings
free of any bench's noise. It chooses no machines, keeps no runs and judges none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble import Machine, safe_cycles
from analysis.executor import Executor, LocalExecutor
from analysis.observation import readings_of_cycles
from daq.plan import SweepPlan
from sim.unit import Unit

__all__ = ["Family", "Readings", "read_families", "read_family"]

Readings = tuple[NDArray[np.complex128], NDArray[np.float64]]
"""Mean of V_o/V_i and its relative variance, each (machines, rows)."""


@dataclass(frozen=True, slots=True)
class Family:
    """Machines that share their linear part, and so fill the lanes of one call: a task.

    `rows` are where each plan's points stand among the rows of the readings.
    """

    unit: Unit
    machines: tuple[Machine, ...]
    plans: tuple[tuple[SweepPlan, NDArray[np.int64]], ...]


def read_family(family: Family) -> Readings:
    """Take a family through its plans, on one core.

    Raises
    ------
    AnalysisError
        If a motion grew without bound even at the shortest step.
    """
    servos = [machine.servo(family.unit) for machine in family.machines]
    count = sum(len(rows) for _, rows in family.plans)
    mean = np.empty((len(servos), count), dtype=complex)
    variance = np.empty((len(servos), count))
    for plan, rows in family.plans:
        for i, cycles in enumerate(safe_cycles(servos, plan, workers=1)):
            first = cycles[..., 1].reshape(len(rows), -1)
            mean[i, rows], variance[i, rows] = readings_of_cycles(first)
    return mean, variance


def read_families(
    families: Sequence[Family],
    executor: Executor | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Readings]:
    """Readings of the machines of each family, in their order.

    Parameters
    ----------
    executor
        Where they are simulated; this machine's cores if not given.
    progress
        Told the share done after each family.

    Raises
    ------
    AnalysisError
        If a motion grew without bound even at the shortest step.
    """
    return (executor or LocalExecutor()).each(read_family, families, progress) if families else []
