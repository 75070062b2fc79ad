"""Structure in what a fit leaves, where it is known how much there is."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2, norm

from analysis.checking.lack_of_fit import judge_structure
from analysis.emulation.emulator import Fit

ROWS = 3 * 61
BLOCKS = (slice(0, 61), slice(61, 122), slice(122, 183))
SEEN = SimpleNamespace(blocks=BLOCKS, levels=BLOCKS)
NONE = np.empty(0)
SIGMAS = np.full(5, 0.01)


def fit(residual):
    return Fit(
        place=np.array([0.5]),
        log_likelihood=0.0,
        residual=residual,
        std=np.full((3, ROWS), 0.02),
        density=np.zeros((3, ROWS)),
        deviations=np.zeros(6),
    )


def noise(rng, count):
    return [fit(0.02 * rng.standard_normal((3, ROWS))) for _ in range(count)]


def test_noise_has_no_structure():
    """300 draws against 48 others each: more than 2.5 in one of a hundred, more or less."""
    rng = np.random.default_rng(0)
    left = []
    for _ in range(300):
        one, *own = noise(rng, 49)
        left.append(judge_structure(one, own, SEEN, NONE))
    # The lower of two standard normals, alike by two thirds, has its median at -0.3.
    assert -0.5 < np.median(left) < 0.0
    assert np.std(left) == pytest.approx(1.0, abs=0.25)
    # Binomial: seven or more of 300 have a probability of 3 % where one of a hundred is true.
    assert np.sum(np.array(left) > 2.5) <= 7


def test_systematic_band_is_seen_despite_small_sum():
    """The lower half of every level leans by less than a point's scatter.

    Seen in eight draws of ten: fewer than 18 of 30 have a probability of 0.3 %.
    """
    structured, summed = [], []
    for seed in range(30):
        one, *own = noise(np.random.default_rng(seed), 49)
        leaning = one.residual.copy()
        leaning[0] += np.where(np.arange(ROWS) % 61 < 30, 0.015, 0.0)
        squares = [np.sum((f.residual[:2] / f.std[:2]) ** 2) for f in (fit(leaning), *own)]
        summed.append((squares[0] - np.mean(squares[1:])) / np.std(squares[1:]))
        structured.append(judge_structure(fit(leaning), own, SEEN, NONE))
    assert np.sum(np.array(structured) > 2.5) >= 18
    assert np.sum(np.array(summed) > 2.5) <= 10


@pytest.mark.parametrize("seed", range(5))
def test_opposite_band_deviations_are_seen_too(seed):
    one, *own = noise(np.random.default_rng(seed), 49)
    leaning = one.residual.copy()
    leaning[1] += np.where(np.arange(ROWS) < 122, 0.02, -0.01)
    assert judge_structure(fit(leaning), own, SEEN, NONE) > 2.5


def test_structure_in_replicates_is_no_structure():
    rng = np.random.default_rng(1)
    lean = np.zeros((3, ROWS))
    lean[0, :30] = 0.05
    one, *own = (fit(f.residual + lean * rng.normal()) for f in noise(rng, 49))
    assert judge_structure(one, own, SEEN, NONE) < 2.5


@pytest.mark.parametrize("off", [0.0, 1.0, 2.0, 3.0])
def test_datasheet_deviations_count_by_improbability(off):
    one, *own = noise(np.random.default_rng(2), 49)
    alone = judge_structure(one, own, SEEN, NONE)
    leant = replace(one, deviations=np.append(off * SIGMAS, 7.0))
    expected = (alone + norm.isf(chi2.sf(5.0 * off**2, 5))) / np.sqrt(2.0)
    if off:
        assert judge_structure(leant, own, SEEN, SIGMAS) == pytest.approx(expected)
    else:
        # Nothing is quite so probable: it makes up for no structure of any size.
        assert judge_structure(leant, own, SEEN, SIGMAS) > -7.1


def test_unobserved_points_and_single_points_are_omitted():
    one, *own = noise(np.random.default_rng(3), 49)
    known = judge_structure(one, own, SEEN, NONE)
    spoilt = one.residual.copy()
    spoilt[0, 5] = np.nan
    assert judge_structure(fit(spoilt), own, SEEN, NONE) == pytest.approx(known, abs=1.0)
    blind = [fit(np.where(np.arange(ROWS) < 61, np.nan, f.residual)) for f in (one, *own)]
    assert np.isfinite(judge_structure(blind[0], blind[1:], SEEN, NONE))
    far, at_most = one.residual.copy(), one.residual.copy()
    far[0, 5], at_most[0, 5] = 1e6, 5.0 * 0.02
    assert judge_structure(fit(far), own, SEEN, NONE) == pytest.approx(
        judge_structure(fit(at_most), own, SEEN, NONE)
    )


def test_too_few_replicates_give_no_result():
    one, *own = noise(np.random.default_rng(4), 8)
    leaning = fit(one.residual + 1.0)
    assert judge_structure(leaning, own, SEEN, SIGMAS) == 0.0
    assert judge_structure(leaning, [*own, one], SEEN, NONE) > 2.5
