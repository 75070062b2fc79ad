"""The atlases that come with lashbench: found, whole, and what this engine would make of them."""

from dataclasses import replace

import numpy as np
import pytest
from atlases import BITS, FOLDER, agreement, coarse_sweep, rounded
from hidden import BANDS_HZ, LEVELS_VPK

import analysis.atlas as module
from analysis.atlas import atlas_name, make_atlas
from analysis.causes import Hypothesis
from analysis.family import Family, read_family
from analysis.observation import unread
from analysis.spread import spread_of
from daq.plan import SweepPlan
from sim.unit import load_unit

MACHINES = 10


@pytest.fixture(params=BANDS_HZ)
def name(request):
    return request.param


@pytest.fixture
def nothing_is_simulated(monkeypatch):
    monkeypatch.setattr(module, "simulate_groups", None)


@pytest.mark.usefixtures("nothing_is_simulated")
@pytest.mark.parametrize("rare", [False, True])
def test_the_coarse_sweep_of_a_unit_waits_for_no_atlas(name, rare, tmp_path):
    unit = load_unit(name)
    atlas = make_atlas(unit, coarse_sweep(name), tmp_path, rare=rare)
    wanted = {group.hypothesis.effects for group in module._groups(unit, draw(), rare)}
    assert set(atlas) == wanted
    assert not list(tmp_path.iterdir())  # what comes with lashbench is not kept twice


@pytest.mark.usefixtures("nothing_is_simulated")
def test_no_other_sweep_or_unit_is_taken_for_it(name):
    unit, sweep = load_unit(name), coarse_sweep(name)
    heavier = unit.with_parameters(J_L=1.1 * unit.parameters["J_L"])
    for other, coarse in (
        (heavier, sweep), (unit, coarse_sweep(name, LEVELS_VPK[:2])), (unit, sweep.thinned(2)),
    ):  # fmt: skip
        with pytest.raises(TypeError):
            make_atlas(other, coarse)


def test_none_comes_along_that_no_sweep_asks_for():
    named = {
        atlas_name(load_unit(name), coarse_sweep(name), rare)
        for name in BANDS_HZ
        for rare in (False, True)
    }
    assert {file.name for file in FOLDER.iterdir()} == named


def test_rounding_takes_less_than_a_regression_is_trusted_to(name):
    atlas = make_atlas(load_unit(name), coarse_sweep(name))
    for key, one in rounded(atlas).items():
        np.testing.assert_array_equal(one.mean, atlas[key].mean)  # rounded once is rounded
    rng = np.random.default_rng(1)
    one = atlas[()]
    exact = one.mean * (1.0 + 1e-3 * rng.standard_normal(one.mean.shape))
    kept = rounded({(): module.Population(one.places, one.deviations, exact, one.variance)})
    off = np.abs(kept[()].mean - exact) / np.abs(exact)
    assert 0.0 < off.max() <= 2.0**-BITS


def test_this_engine_would_make_the_same_of_them(name):
    """False once in 10,000: runs from other starts at the same places, of three causes and none."""
    seed, p = again(name)
    assert p > 1e-4, f"seed {seed}: simulate them anew, python tests/atlases.py"


def test_that_would_be_seen_if_the_engine_made_another_machine_of_the_unit(name):
    seed, p = again(name, J_L=1.05)
    assert p <= 1e-3, f"seed {seed}"


def again(name, **factors):
    """The seed, and how likely runs of some groups are to differ from the kept ones by so much."""
    rng = draw()
    seed = rng.bit_generator.seed_seq.entropy
    unit, coarse = load_unit(name), coarse_sweep(name)
    kept = make_atlas(unit, coarse)
    causes = [key for key in kept if key]
    chosen = [(), *(causes[i] for i in rng.choice(len(causes), 3, replace=False))]
    known = unit.parameters
    changed = unit.with_parameters(**{s: known[s] * factor for s, factor in factors.items()})
    apart = np.concatenate([differences(changed, coarse, kept, key, rng) for key in chosen])
    return seed, agreement(apart, rng)


def differences(unit, coarse, atlas, key, rng):
    """Log of the ratio (machines, rows) of kept readings to new ones of one group of a cause."""
    one = atlas[key]
    at = MACHINES * int(rng.integers(len(one) // MACHINES))
    rows = slice(at, at + MACHINES)
    hypothesis = Hypothesis(unit, key)
    named = spread_of(unit).deviations(one.deviations[at])
    machines = tuple(
        hypothesis.machine(place, int(rng.integers(2**30)), named) for place in one.places[rows]
    )
    mean, _ = read_family(Family(unit, machines, coarse.plans))
    return np.log(one.mean[rows] / mean)


def draw():
    """A generator seeded by chance, for every run of the tests anew."""
    return np.random.default_rng()


def test_sweeps_together_share_the_atlas_of_each(monkeypatch, tmp_path):
    """The same machines to the last bit as if both plans had been simulated in one go."""
    unit = load_unit("adss")
    few = [group for group in module._groups(unit, draw(), False) if not group.hypothesis.effects]
    monkeypatch.setattr(module, "_groups", lambda *_: iter(few))
    one = unread(SweepPlan((110.0, 130.0), (1.5, 4.0), settle_cycles=2, integrate_cycles=3), 1e-3)
    other = SweepPlan((120.0, 140.0, 150.0), (2.5,), settle_cycles=2, integrate_cycles=3)
    plans = ((one.plans[0][0], np.array([0, 1, 5, 6])), (other, np.array([2, 3, 4])))
    both = replace(
        one,
        values=np.full((3, 7), np.nan),
        source_vpk=np.array([1.5, 1.5, 2.5, 2.5, 2.5, 4.0, 4.0]),
        frequency_hz=np.array([110.0, 130.0, 120.0, 140.0, 150.0, 110.0, 130.0]),
        noise=np.full(7, 1e-3),
        floor=np.zeros(7),
        plans=plans,
    )
    (whole,) = module.simulate_atlas(unit, both).values()
    make_atlas(unit, one, tmp_path)
    kept = list(tmp_path.iterdir())
    told = []
    (joined,) = make_atlas(unit, both, tmp_path, progress=told.append).values()
    assert len(list(tmp_path.iterdir())) == len(kept) + 1  # that of the first was there
    for name in ("places", "deviations", "mean", "variance"):
        np.testing.assert_array_equal(getattr(joined, name), getattr(whole, name))
    assert told == sorted(told)
    assert (told[0] > 0.5, told[-1]) == (True, 1.0)
