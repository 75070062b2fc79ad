"""What is predicted of levels not fitted, where the answer is known."""

from types import SimpleNamespace

import numpy as np
import pytest
from worlds import synthetic
from worlds.synthetic import LEVELS, ROWS, candidate, observation, read

import analysis.checking.cross_validation as module
from analysis.checking.cross_validation import hold_out
from analysis.emulation.emulator import Emulator
from analysis.emulation.likelihood import TEMPERATURE

HALF, TRUE = ROWS // 2, ("load-inertia",)


@pytest.mark.parametrize(
    ("middle", "std"),
    [((0.5,), (0.05,)), ((0.3,), (0.1,)), ((0.4, 0.6), (0.08, 0.04)), ((0.5, 0.5), (0.02, 0.1))],
)
def test_walk_posterior_matches_a_gaussian(middle, std):
    """Mean and standard deviation of a Gaussian, from the weights alone."""
    surface = candidate(observation(np.zeros((3, ROWS))), ("load-inertia",)[: len(middle) - 1])
    surface = surface.surface

    def bell(place, rows=None):
        z2 = np.sum(((place - np.array(middle)) / np.array(std)) ** 2)
        return SimpleNamespace(place=place, log_likelihood=-0.5 * TEMPERATURE * z2)

    told = SimpleNamespace(places=surface.places, fit=bell)
    fits = Emulator.walk(told, np.full(len(middle), 0.45), tries=1500)
    share = Emulator.shares(told, fits)
    places = np.array([fit.place for fit in fits])
    mean = share @ places
    assert share.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(mean, middle, atol=0.15 * max(std))
    np.testing.assert_allclose(np.sqrt(share @ (places - mean) ** 2), std, rtol=0.15)


@pytest.mark.parametrize("seed", range(8))
def test_uncertainty_of_other_levels_is_no_miss(seed, monkeypatch):
    """The low level says everything of the ratio, the high one nothing, and is true to it."""
    slope = synthetic.RATIO_SLOPE.copy()
    slope[:, :HALF] *= 8.0
    slope[:, HALF:] = 0.0
    monkeypatch.setattr(synthetic, "RATIO_SLOPE", slope)
    observed = observation(read((), np.array([0.3]), np.random.default_rng(seed)))
    found = candidate(observed, seed=seed)
    held_out = hold_out(found, observed)
    z = held_out.residual / held_out.std
    assert np.sqrt(np.mean(z[:2, :HALF] ** 2)) < 1.3, "the low level, predicted from the high one"
    assert np.sqrt(np.mean(z[:2, HALF:] ** 2)) < 1.3
    # It is told how little is known: the best place alone would have the scatter of a run.
    alone = found.surface.fit(found.best.place).std
    assert np.median(held_out.std[:2, :HALF] / alone[:2, :HALF]) > 5.0
    assert np.median(held_out.std[:2, HALF:] / alone[:2, HALF:]) < 1.5


@pytest.mark.parametrize("seed", range(4))
def test_unpredictable_level_is_a_miss(seed):
    values = read((), np.array([0.5]), np.random.default_rng(seed))
    values[0, :HALF] += 0.3
    observed = observation(values)
    found = candidate(observed, seed=seed)
    honest = observation(read((), np.array([0.5]), np.random.default_rng(seed)))
    assert hold_out(found, observed).rms_sigma > 2.0
    assert hold_out(candidate(honest, seed=seed), honest).rms_sigma < 1.3


def test_each_level_is_predicted_when_held_out():
    observed = observation(read(TRUE, np.array([0.5, 0.5]), np.random.default_rng(2)))
    spoilt = observed.values.copy()
    high = observed.source_vpk == LEVELS[1]
    spoilt[:, high] += 0.5
    honest = hold_out(candidate(observed, TRUE), observed)
    other = hold_out(candidate(observation(spoilt), TRUE), observation(spoilt))
    # What is predicted of the spoilt level comes from the other, which is as it was.
    moved = other.residual[:2][:, high] - honest.residual[:2][:, high]
    assert np.median(np.abs(moved)) == pytest.approx(0.5, abs=0.1)
    assert 0.7 < honest.rms_sigma < 1.3 < 3.0 < other.rms_sigma


@pytest.mark.parametrize(
    ("levels", "blocks", "folds"),
    [
        # Two sweeps of one level are near-duplicates where there is another level.
        ([(0, 8), (8, 12)], [(0, 4), (4, 8), (8, 12)], [(0, 8), (8, 12)]),
        ([(0, 12)], [(0, 8), (8, 12)], [(0, 8), (8, 12)]),
        ([(0, 12)], [(0, 12)], [(0, 6), (6, 12)]),
    ],
)
def test_folds_are_levels_sweeps_or_half_bands(levels, blocks, folds):
    found = module.split_folds(swept(levels, blocks, ["up"] * len(blocks)))
    assert [fold for fold, _ in found] == [slice(*ends) for ends in folds]
    for fold, rows in found:
        expected = np.ones(12, dtype=bool)
        expected[fold] = False
        assert rows.tolist() == expected.tolist()


def swept(levels, blocks, directions):
    """Twelve rows at levels, in blocks of sweeps that went one way or the other."""

    class Swept:
        def __len__(self):
            return 12

    one = Swept()
    one.levels, one.blocks = ([slice(*ends) for ends in some] for some in (levels, blocks))
    one.source_vpk = np.concatenate([np.full(b - a, float(n)) for n, (a, b) in enumerate(levels)])
    one.plans = [
        (SimpleNamespace(direction=way), np.arange(*ends))
        for way, ends in zip(directions, blocks, strict=True)
    ]
    return one


@pytest.mark.parametrize(
    ("blocks", "directions", "rows"),
    [
        # Each block is told by the others' levels the other way, ...
        (
            [(0, 2), (2, 4), (4, 6), (6, 8), (8, 10), (10, 12)],
            ["up", "down"] * 3,
            [{6, 7, 10, 11}, {4, 5, 8, 9}, {2, 3, 10, 11}, {0, 1, 8, 9}, {2, 3, 6, 7},
             {0, 1, 4, 5}],
        ),
        # ... and by the other levels alone where a short sweep is all that went the other way.
        (
            [(0, 4), (4, 8), (8, 11), (11, 12)],
            ["up", "up", "up", "down"],
            [{*range(4, 12)}, {*range(4), *range(8, 12)}, {*range(8)}, {*range(8)}],
        ),
    ],
)  # fmt: skip
def test_two_way_sweeps_hold_out_both_folds(blocks, directions, rows):
    """Neither the level nor the direction of a fold was seen."""
    levels = [(0, 4), (4, 8), (8, 12)]
    found = module.split_folds(swept(levels, blocks, directions))
    assert [fold for fold, _ in found] == [slice(*ends) for ends in blocks]
    assert [{*np.flatnonzero(used)} for _, used in found] == rows


@pytest.mark.parametrize("seed", range(4))
def test_branch_jump_is_tolerated_resonance_is_not(seed):
    rng = np.random.default_rng(seed)
    z = np.clip(0.8 * rng.standard_normal((3, 183)), -2.5, 2.5)
    jump, resonance = z.copy(), z.copy()
    jump[:2, 107] = 6.0, 16.0
    resonance[:2, 100:106] = 7.0
    # A one-level sweep without phase: what was not observed counts for nothing.
    z[1] = np.nan
    honest, jump, resonance = (
        module.HeldOut(0.0, one, np.ones_like(z)) for one in (z, jump, resonance)
    )
    assert 0.6 < honest.missed < honest.rms_sigma < 0.9
    assert jump.missed < 0.9 < 1.1 < jump.rms_sigma
    assert 1.2 < resonance.missed < resonance.rms_sigma
