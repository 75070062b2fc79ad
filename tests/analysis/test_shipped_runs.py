"""The runs that come with lashbench: found, whole, and what this engine would make of them."""

from dataclasses import replace
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest
from usual_runs import RUNS, agreement, usual_families, usual_sweep
from worlds.hidden import BANDS_HZ

import analysis.ensemble.run_cache as module
from analysis.ensemble.batch import Family, read_family
from analysis.ensemble.run_cache import run_families, run_name
from analysis.estimate import estimate_response
from daq.formats import read_response
from sim.unit import load_unit

PRACTICE = Path(__file__).parents[1] / "data" / "practice"


@pytest.fixture(params=BANDS_HZ)
def name(request):
    return request.param


@pytest.mark.parametrize(
    ("set_name", "unit", "truth"), [("09", "adss", 0.933), ("10", "edss", 0.548)]
)
def test_estimate_of_usual_sweep_simulates_nothing(set_name, unit, truth, tmp_path):
    response = read_response(PRACTICE / f"practice-{set_name}.csv")
    found = estimate_response(response, load_unit(unit), cache=tmp_path)
    assert found.simulated_s == 0.0
    assert not list(tmp_path.iterdir())  # what comes with lashbench is not kept twice
    low, high = found.contribution_ratio.interval95
    assert low < truth < high


class Flat:
    """An executor of whose machines none moves otherwise than the source; `asked` of it so far."""

    def __init__(self):
        self.asked = []

    def each(self, work, tasks, progress=None):
        self.asked += tasks
        return [self._readings(family) for family in tasks]

    def _readings(self, family):
        rows = sum(len(rows) for _, rows in family.plans)
        return np.ones((len(family.machines), rows), complex), np.ones((len(family.machines), rows))


def test_another_unit_or_sweep_is_simulated(name):
    unit, sweep, families = load_unit(name), usual_sweep(name), usual_families(name)
    heavier = unit.with_parameters(J_L=1.1 * unit.parameters["J_L"])
    late = [tuple(replace(machine, seed=machine.seed + 1) for machine in families[-1])]
    for other, seen, some in (
        (heavier, sweep, families),
        (unit, usual_sweep(name, (1.5, 2.5)), families),
        (unit, sweep, late),
    ):
        flat = Flat()
        run_families(other, some, seen, executor=flat)
        assert len(flat.asked) == len(some)


def test_shipped_runs_are_those_estimates_need():
    wanted = {
        run_name(load_unit(name), family, usual_sweep(name))
        for name in BANDS_HZ
        for family in usual_families(name)
    }
    with ZipFile(RUNS) as archive:
        assert archive.testzip() is None
        assert sorted(archive.namelist()) == sorted(wanted)


@pytest.mark.parametrize("damage", ["gone", "cut", "text"])
def test_damaged_archive_makes_estimate_simulate(damage, name, tmp_path, monkeypatch):
    file = tmp_path / "runs.zip"
    if damage == "cut":
        file.write_bytes(RUNS.read_bytes()[:100_000])
    elif damage == "text":
        file.write_text("no archive at all")
    monkeypatch.setattr(module, "kept_runs", lambda: file)
    families = usual_families(name)[:2]
    draws = run_families(load_unit(name), families, usual_sweep(name), executor=Flat())
    assert np.all(draws.mean == 1.0)


@pytest.mark.parametrize("name", ["adss", pytest.param("edss", marks=pytest.mark.long)])
def test_engine_reproduces_the_shipped_runs(name):
    """False once in 10,000: runs from other starts at the same places."""
    seed, p = again(name)
    assert p > 1e-4, f"seed {seed}: simulate them anew, python tests/usual_runs.py"


@pytest.mark.parametrize("name", ["adss", pytest.param("edss", marks=pytest.mark.long)])
def test_changed_engine_would_differ_from_shipped_runs(name):
    seed, p = again(name, J_L=1.05)
    assert p <= 1e-3, f"seed {seed}"


def again(name, **factors):
    """The seed, and how likely new runs of two families are to differ from the kept by so much."""
    rng = np.random.default_rng()
    seed = rng.bit_generator.seed_seq.entropy
    unit, sweep, families = load_unit(name), usual_sweep(name), usual_families(name)
    known = unit.parameters
    changed = unit.with_parameters(**{s: known[s] * factor for s, factor in factors.items()})
    apart = []
    for i in rng.choice(len(families), 2, replace=False):
        kept = run_families(unit, families[i : i + 1], sweep)
        machines = tuple(
            replace(machine, seed=2 * int(rng.integers(2**29)) + machine.seed % 2)
            for machine in families[i]
        )
        mean, _ = read_family(Family(changed, machines, sweep.plans))
        apart.append(np.log(kept.mean / mean))
    return seed, agreement(np.concatenate(apart), rng)
