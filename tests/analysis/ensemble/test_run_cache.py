"""Runs that are kept: read again they are what a new simulation gives, to the last bit."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.ensemble.machine import Draws, Machine, safe_cycles
from analysis.ensemble.run_cache import run_families
from analysis.execution.executor import LocalExecutor
from analysis.observation.observation import readings_of_cycles, unread
from daq.plan import SweepPlan
from sim.engine.effort import counting
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


def test_families_equal_machines_run_singly():
    with counting() as effort:
        draws = run_families(ADSS, FAMILIES, SEEN)
    alone = one_by_one([m for family in FAMILIES for m in family])
    assert draws.machines == alone.machines
    np.testing.assert_array_equal(draws.channels(SEEN), alone.channels(SEEN))
    assert effort.simulated_s == pytest.approx(len(alone.machines) * PLAN.duration_s)


def test_cached_runs_are_read_without_simulation(tmp_path):
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


def test_every_family_is_kept_by_itself(tmp_path):
    executor = Counting()
    whole = run_families(ADSS, FAMILIES, SEEN, cache=tmp_path, executor=executor)
    turned = run_families(ADSS, FAMILIES[::-1], SEEN, cache=tmp_path, executor=executor)
    one = run_families(ADSS, FAMILIES[1:], SEEN, cache=tmp_path, executor=executor)
    assert executor.given == 2
    np.testing.assert_array_equal(turned.mean, np.roll(whole.mean, 2, axis=0))
    np.testing.assert_array_equal(one.variance, whole.variance[2:])
    assert turned.machines == (*FAMILIES[1], *FAMILIES[0])
    more = [*FAMILIES, [Machine(0.5, 9)]]
    joined = run_families(ADSS, more, SEEN, cache=tmp_path, executor=executor)
    assert executor.given == 3
    np.testing.assert_array_equal(joined.mean[:4], whole.mean)


@pytest.mark.parametrize("digits", [4, 6, 12])
def test_rounded_frequencies_match_the_cache(tmp_path, digits):
    executor = Counting()
    odd = replace(PLAN, frequencies_hz=(120.0 + 1.0 / 3.0, 130.0, 150.0 - 1.0 / 3.0))
    rounded = tuple(round(hz, digits) for hz in odd.frequencies_hz)
    run_families(ADSS, FAMILIES, unread(odd, 5e-4), cache=tmp_path, executor=executor)
    again = unread(replace(odd, frequencies_hz=rounded), 5e-4)
    run_families(ADSS, FAMILIES, again, cache=tmp_path, executor=executor)
    assert executor.given == 2
    moved = unread(replace(odd, frequencies_hz=(120.3, *odd.frequencies_hz[1:])), 5e-4)
    run_families(ADSS, FAMILIES, moved, cache=tmp_path, executor=executor)
    assert executor.given == 4


@pytest.mark.parametrize("what", ["unit", "plan", "machines"])
def test_different_runs_are_not_taken_from_cache(tmp_path, what):
    executor = Counting()
    run_families(ADSS, FAMILIES, SEEN, cache=tmp_path, executor=executor)
    unit, families, seen = ADSS, FAMILIES, SEEN
    if what == "unit":
        unit = ADSS.with_parameters(T_f_L=0.008)
    elif what == "plan":
        seen = unread(replace(PLAN, settle_cycles=4), 5e-4)
    else:
        families = [[replace(m, start_spread=0.5) for m in family] for family in FAMILIES]
    run_families(unit, families, seen, cache=tmp_path, executor=executor)
    assert executor.given == 4


@pytest.mark.parametrize("damage", ["cut", "empty", "text", "other shape", "not finite"])
def test_a_damaged_file_is_simulated_anew(tmp_path, damage):
    whole = run_families(ADSS, FAMILIES, SEEN, cache=tmp_path)
    file, _ = tmp_path.glob("runs-*.npz")
    content = file.read_bytes()
    if damage == "cut":
        file.write_bytes(content[: len(content) // 2])
    elif damage == "empty":
        file.write_bytes(b"")
    elif damage == "text":
        file.write_text("no archive at all")
    else:
        shape = (3, 6) if damage == "other shape" else (2, 6)
        np.savez(file, mean=np.ones(shape, complex), variance=np.full(shape, np.nan))
    executor = Counting()
    again = run_families(ADSS, FAMILIES, SEEN, cache=tmp_path, executor=executor)
    assert executor.given == 1  # the other is whole
    np.testing.assert_array_equal(again.channels(SEEN), whole.channels(SEEN))


def test_unwritable_cache_only_costs_time(tmp_path):
    (tmp_path / "file").write_text("")
    draws = run_families(ADSS, FAMILIES[:1], SEEN, cache=tmp_path / "file" / "below")
    np.testing.assert_array_equal(draws.channels(SEEN), one_by_one(FAMILIES[0]).channels(SEEN))


def test_damaged_cache_file_does_not_end_work(tmp_path):
    """Every one of sixty-four places, spoilt by itself: read whole or made anew."""
    whole = run_families(ADSS, FAMILIES[:1], SEEN, cache=tmp_path)
    (file,) = tmp_path.glob("runs-*.npz")
    content = file.read_bytes()
    anew = 0
    for at in np.linspace(0, len(content) - 1, 64).astype(int):
        file.write_bytes(content[:at] + bytes([content[at] ^ 0xAA]) + content[at + 1 :])
        executor = Counting()
        again = run_families(ADSS, FAMILIES[:1], SEEN, cache=tmp_path, executor=executor)
        np.testing.assert_array_equal(again.channels(SEEN), whole.channels(SEEN))
        anew += executor.given
    # What packs the numbers fills most of a file.
    assert anew > 32


def test_incompletely_written_file_is_not_kept(tmp_path):
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    # No file may grow beyond this: writing on is an error, as on a full disk.
    resource.setrlimit(resource.RLIMIT_FSIZE, (20, before[1]))
    try:
        draws = run_families(ADSS, FAMILIES[:1], SEEN, cache=tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert len(draws.machines) == len(FAMILIES[0])
    assert not list(tmp_path.iterdir())
