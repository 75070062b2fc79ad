"""Runs that are kept: read again they are what a new simulation gives, to the last bit."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.calibration import Calibrated
from analysis.ensemble import Draws, Machine, safe_cycles
from analysis.executor import LocalExecutor
from analysis.fit import RATIO, _near_families
from analysis.library import run_families
from analysis.observation import readings_of_cycles, unread
from daq.plan import SweepPlan
from sim.effort import counting
from sim.unit import load_unit

ADSS = load_unit("adss")
PLAN = SweepPlan((120.0, 130.0, 150.0), (1.5, 2.5), settle_cycles=3, integrate_cycles=4)
SEEN = unread(PLAN, 5e-4)
FAMILIES = [
    [Machine(ratio, seed, deviations=(("J_L", off),)) for seed, ratio in enumerate((0.2, 0.7))]
    for off in (0.004, -0.006)
]


class Counting(LocalExecutor):
    """Knows how many tasks it was given."""

    given = 0

    def each(self, work, tasks, progress=None):
        self.given += len(tasks)
        return super().each(work, tasks, progress)


def one_by_one(machines):
    """What `run_families` must give: each machine through the plan of SEEN by itself."""
    readings = []
    for machine in machines:
        (cycles,) = safe_cycles([machine.servo(ADSS)], PLAN)
        readings.append(readings_of_cycles(cycles[..., 1].reshape(len(SEEN), -1)))
    mean, variance = map(np.array, zip(*readings, strict=True))
    return Draws(tuple(machines), mean, variance)


def test_families_give_what_machines_one_by_one_give():
    with counting() as effort:
        draws = run_families(ADSS, FAMILIES, SEEN)
    alone = one_by_one([m for family in FAMILIES for m in family])
    assert draws.machines == alone.machines
    np.testing.assert_array_equal(draws.channels(SEEN), alone.channels(SEEN))
    assert effort.simulated_s == pytest.approx(len(alone.machines) * PLAN.duration_s)


def test_what_was_kept_is_read_and_costs_nothing(tmp_path):
    executor = Counting()
    with counting() as first:
        made = run_families(ADSS, FAMILIES, SEEN, cache=tmp_path, executor=executor)
    with counting() as second:
        again = run_families(ADSS, FAMILIES, SEEN, cache=tmp_path, executor=executor)
    assert executor.given == 2
    np.testing.assert_array_equal(made.channels(SEEN), again.channels(SEEN))
    assert first.simulated_s > 0.0
    assert second.simulated_s == 0.0
    # The noise of the bench is no part of a run.
    louder = replace(SEEN, noise=10.0 * SEEN.noise)
    noisy = run_families(ADSS, FAMILIES, louder, cache=tmp_path, executor=executor)
    fresh = run_families(ADSS, FAMILIES, louder)
    assert executor.given == 2
    np.testing.assert_array_equal(noisy.channels(louder), fresh.channels(louder))


@pytest.mark.parametrize("what", ["unit", "plan", "machines", "order"])
def test_what_differs_is_not_taken_from_the_cache(tmp_path, what):
    executor = Counting()
    run_families(ADSS, FAMILIES, SEEN, cache=tmp_path, executor=executor)
    unit, families, seen = ADSS, FAMILIES, SEEN
    if what == "unit":
        unit = ADSS.with_parameters(T_f_L=0.008)
    elif what == "plan":
        seen = unread(replace(PLAN, settle_cycles=4), 5e-4)
    elif what == "machines":
        families = [[replace(m, start_spread=0.5) for m in family] for family in FAMILIES]
    else:
        families = FAMILIES[::-1]
    run_families(unit, families, seen, cache=tmp_path, executor=executor)
    assert executor.given == 4


@pytest.mark.parametrize("damage", ["cut", "empty", "text", "other shape", "not finite"])
def test_a_damaged_file_is_simulated_anew(tmp_path, damage):
    whole = run_families(ADSS, FAMILIES, SEEN, cache=tmp_path)
    (file,) = tmp_path.glob("runs-*.npz")
    content = file.read_bytes()
    if damage == "cut":
        file.write_bytes(content[: len(content) // 2])
    elif damage == "empty":
        file.write_bytes(b"")
    elif damage == "text":
        file.write_text("no archive at all")
    else:
        shape = (3, 6) if damage == "other shape" else (4, 6)
        np.savez(file, mean=np.ones(shape, complex), variance=np.full(shape, np.nan))
    executor = Counting()
    again = run_families(ADSS, FAMILIES, SEEN, cache=tmp_path, executor=executor)
    assert executor.given == 2
    np.testing.assert_array_equal(again.channels(SEEN), whole.channels(SEEN))


def test_a_cache_that_cannot_be_written_costs_time_only(tmp_path):
    (tmp_path / "file").write_text("")
    draws = run_families(ADSS, FAMILIES[:1], SEEN, cache=tmp_path / "file" / "below")
    np.testing.assert_array_equal(draws.channels(SEEN), one_by_one(FAMILIES[0]).channels(SEEN))


def found(mean, std):
    return Calibrated(np.array([mean]), np.array([[std**2]]))


def test_close_answers_are_held_against_the_same_machines():
    near = _near_families([RATIO], found(0.41, 0.03), 21, 0)
    assert near == _near_families([RATIO], found(0.39, 0.035), 21, 0)
    assert near != _near_families([RATIO], found(0.39, 0.035), 21, 1)
    assert near != _near_families([RATIO], found(0.61, 0.03), 21, 0)
    ratios = np.array([machine.ratio for family in near for machine in family])
    assert {len({m.deviations for m in family}) for family in near} == {1}
    assert 0.2 < ratios.min() < 0.3 < 0.5 < ratios.max() < 0.6


@pytest.mark.parametrize(("mean", "std"), [(-0.3, 0.01), (0.0, 0.05), (0.97, 0.2), (0.5, 5.0)])
def test_machines_lie_in_range_and_reach_past_the_answer(mean, std):
    near = _near_families([RATIO], found(mean, std), 21, 0)
    ratios = np.array([machine.ratio for family in near for machine in family])
    assert ratios.min() >= 0.0
    assert ratios.max() <= 1.0
    asked = np.clip(mean, 0.0, 1.0)
    for side in (-1.0, 1.0):
        edge = np.clip(asked + side * 2.0 * std, 0.0, 1.0)
        assert ratios.min() - 0.03 <= edge <= ratios.max() + 0.03
