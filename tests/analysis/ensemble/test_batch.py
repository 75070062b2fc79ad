"""Families go to this machine's cores in lots, to others one by one; what is read is the same."""

import numpy as np
import pytest

from analysis.ensemble.batch import Family, read_families, read_family
from analysis.ensemble.machine import Machine
from analysis.execution.executor import LocalExecutor
from analysis.observation.observation import unread
from daq.plan import SweepPlan
from sim.effects import parse_effect
from sim.engine.effort import counting
from sim.engine.lanes import VECTOR_BYTES
from sim.unit import load_unit

PLAN = SweepPlan((120.0, 150.0), (1.5, 2.5), settle_cycles=2, integrate_cycles=3)
TWO = VECTOR_BYTES // 4 - 1  # machines at two levels in two vectors, the second not full
PLANS = unread(PLAN, 5e-4).plans
EFFECTS = ["", "load-inertia:J_L=0.2", "amplifier-lag:tau_a=0.0005", "shaft-damping:c_s1=0.002", ""]


def families(machines):
    """Five that differ in their linear part, so many machines each."""
    made = []
    for k, text in enumerate(EFFECTS):
        effects = (parse_effect(text),) if text else ()
        off = (("J_L", 0.002 * k),)
        alike = [Machine((i + 1) / 50.0, 100 * k + i, None, off, effects) for i in range(machines)]
        made.append(Family(load_unit("adss"), tuple(alike), PLANS))
    return made


class Noting(LocalExecutor):
    """Knows what tasks it was given."""

    def each(self, work, tasks, progress=None):
        self.given = list(tasks)
        return super().each(work, tasks, progress)


class Elsewhere:
    """Not of this machine."""

    def each(self, work, tasks, progress=None):
        self.given = list(tasks)
        return [work(task) for task in tasks]


def same(some, others):
    return all(
        np.array_equal(a, b)
        for one, other in zip(some, others, strict=True)
        for a, b in zip(one, other, strict=True)
    )


# Machines at two levels that are two vectors, one, and more than a call takes.
@pytest.mark.parametrize(
    ("machines", "cores", "lots"),
    [(TWO, 1, [2, 1, 2]), (TWO, 2, [2, 1, 1, 1]), (2, 1, [2, 3]), (2, 4, [1, 1, 1, 2]),
     (40, 1, [1] * 5)],
)  # fmt: skip
def test_families_read_in_batches_are_equal(machines, cores, lots):
    known, executor, told = families(machines), Noting(cores), []
    with counting() as effort:
        found = read_families(known, executor, told.append)
    assert [len(lot) for lot in executor.given] == lots
    assert told[-1] == 1.0
    assert len(told) == len(lots)
    assert effort.simulated_s == pytest.approx(5 * machines * PLAN.duration_s)
    assert same(found, [read_family(one) for one in known])
    assert not same(found[:1], found[1:2])


def test_remote_executor_gets_families_singly():
    known, executor = families(2), Elsewhere()
    assert same(read_families(known, executor), [read_family(one) for one in known])
    assert executor.given == known
    assert read_families([], executor) == read_families([], LocalExecutor(1)) == []
