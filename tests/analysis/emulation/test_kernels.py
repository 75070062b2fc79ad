"""The compiled arithmetic of a fit, against numpy, scipy and textbooks."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from worlds.synthetic import ROWS, candidate, observation, read

from analysis.emulation import kernel_data as expectation
from analysis.emulation import kernels as agreement
from analysis.emulation.kernels import TAIL, TAIL_SCALE, invert, solve_plane
from analysis.emulation.plane_fits import fit_planes
from sim.engine.compiling import njit


def weighted(seed, n=40, k=2, c=5):
    """Offsets, weights and values of runs about a plane, and that plane at offset zero."""
    rng = np.random.default_rng(seed)
    offset, weight = rng.standard_normal((n, k)), rng.uniform(0.1, 1.0, n)
    level, slopes = rng.standard_normal(c), rng.standard_normal((c, k))
    scatter = 0.05 * rng.standard_normal((c, n))
    return offset, weight, (level[:, None] + slopes @ offset.T + scatter).astype(np.float32), level


@pytest.mark.parametrize("seed", range(4))
def test_plane_fit_is_weighted_least_squares(seed):
    offset, weight, values, _ = weighted(seed)
    value, variance = np.empty(len(values)), np.empty(len(values))
    solve_plane(offset, weight, 0.0, values, False, value, variance)
    basis = np.column_stack([np.ones(len(offset)), offset])
    root = np.sqrt(weight)[:, None]
    found, *_ = np.linalg.lstsq(basis * root, values.T.astype(float) * root, rcond=None)
    assert value == pytest.approx(found[0], abs=2e-6)
    left = (values.T - basis @ found) ** 2
    hat = np.linalg.inv((basis * weight[:, None]).T @ basis) @ (basis * weight[:, None]).T
    used = np.trace(hat @ (basis * weight[:, None]))
    expected = (weight @ left) / (weight.sum() - used) * (1.0 + np.sum(hat[0] ** 2))
    assert variance == pytest.approx(expected, rel=1e-4)
    (planes,) = fit_planes(
        offset[None], weight[None], np.zeros(1), values[None].astype(float)
    ).coefficients
    assert planes == pytest.approx(found.T, abs=1e-6)


@pytest.mark.parametrize("n", [7, 8, 33])
def test_a_run_without_weight_does_not_count(n):
    offset, weight, values, _ = weighted(3, n)
    more = np.concatenate([offset, [[9.0, -9.0]]])
    wild = np.concatenate([values, np.full((len(values), 1), 50.0, np.float32)], axis=1)
    results = []
    for at, w, v in ((offset, weight, values), (more, np.append(weight, 0.0), wild)):
        value, variance = np.empty(len(v)), np.empty(len(v))
        solve_plane(at, w, 0.5, v, True, value, variance)
        results.append((value, variance))
    assert np.array_equal(results[0], results[1])


def test_student_t_variance_resists_outlying_run():
    rng = np.random.default_rng(5)
    n, columns = 4000, 6
    values = (0.3 * TAIL_SCALE * rng.standard_t(TAIL, (columns, n))).astype(np.float32)
    offset, weight = 0.01 * rng.standard_normal((n, 1)), np.ones(n)
    value, variance = np.empty(columns), np.empty(columns)
    solve_plane(offset, weight, 1.0, values, True, value, variance)
    assert np.sqrt(variance) == pytest.approx(np.full(columns, 0.3), rel=0.08)
    spoilt, moved = values.copy(), np.empty(columns)
    spoilt[:, :20] = 9.0
    solve_plane(offset, weight, 1.0, spoilt, True, value, moved)
    assert moved == pytest.approx(variance, rel=0.15)
    solve_plane(offset, weight, 1.0, spoilt, False, value, moved)
    assert np.all(moved > 3.0 * variance)


@pytest.mark.parametrize("size", [1, 2, 6])
def test_a_matrix_times_its_inverse_is_one(size):
    rng = np.random.default_rng(size)
    root = rng.standard_normal((size, size + 3)) * 10.0 ** rng.uniform(-3, 3, (size, 1))
    matrix = root @ root.T
    inverse, log_det = invert(matrix)
    assert matrix @ inverse == pytest.approx(np.eye(size), abs=1e-8)
    assert log_det == pytest.approx(np.linalg.slogdet(matrix)[1])


def student(mean, std):
    """Log densities by scipy, but for a constant of every column, which nobody asks for."""
    return stats.t(TAIL, scale=TAIL_SCALE * std).logpdf(mean) - stats.t(TAIL).logpdf(0.0)


def test_densities_are_student_t_or_zero_unobserved():
    values = read(("load-inertia",), np.array([0.5, 0.4]), np.random.default_rng(6))
    values[1, 3:7] = np.nan
    fit = candidate(observation(values), ("load-inertia",)).best
    assert np.array_equal(np.isnan(fit.residual), np.isnan(values))
    known = ~np.isnan(values[:2])
    # In the third channel the share of runs that do as was observed is added.
    assert fit.density[:2][known] == pytest.approx(student(fit.residual, fit.std)[:2][known])
    assert np.all(fit.density[:2][~known] == 0.0)


def test_fitted_deviation_is_most_probable():
    rng = np.random.default_rng(4)
    slope, truth = rng.standard_normal((3, 200)), np.array([0.4, -0.2, 0.0])
    std, sigmas = rng.uniform(0.05, 0.2, 200), np.array([0.5, 0.5, 1e-4])
    apart = truth @ slope + std * rng.standard_normal(200)
    seen = rng.uniform(size=200) < 0.8
    best, log_prior = agreement.lean(apart, std, slope, sigmas, seen)
    assert best == pytest.approx(truth, abs=0.06)

    def log_posterior(deviations):
        left = (apart - deviations @ slope)[seen]
        likely = student(left, std[seen]).sum()
        return likely - 0.5 * np.sum((deviations / sigmas) ** 2)

    top = log_posterior(best)
    for step in 0.02 * np.vstack([np.eye(3), -np.eye(3)]) * sigmas:
        assert log_posterior(best + step) < top + 1e-3
    assert log_prior < -0.5 * np.sum((best / sigmas) ** 2)


def test_weights_use_first_sufficient_reach():
    squares = np.array([0.0, 0.04, 0.5, 2.0, 9.0])
    weight = agreement.weigh(squares, 2.0)
    assert weight.sum() >= 2.0
    assert np.all(np.diff(weight) <= 0.0)
    assert agreement.weigh(squares, 1e9).sum() < len(squares)


@pytest.mark.parametrize("most", [1, 5, 12, 40])
def test_nearest_runs_match_sorting(most):
    rng = np.random.default_rng(most)
    for _ in range(20):
        far = rng.integers(0, 15, 40).astype(float)
        for guess in (0.0, 1e-9, far.max(), 1e9, rng.uniform(0.0, 15.0)):
            near = np.full(most, -1)
            limit = nearest(far, most, guess, near)
            assert len(set(near.tolist())) == most
            assert np.sort(far[near]) == pytest.approx(np.sort(far)[:most])
            # Nothing that was left out lies within it, but for what is as far as the last.
            last = far[near].max()
            assert last <= limit
            assert not np.any((far > last) & (far <= limit))


@pytest.mark.parametrize("far", [np.zeros(9), np.full(9, 7.0), np.array([1e-300, 1e300, 2.0, 2.0])])
def test_nearest_runs_are_found_without_limit(far):
    for most in range(1, len(far) + 1):
        near = np.full(most, -1)
        nearest(far, most, 0.0, near)
        assert len(set(near.tolist())) == most
        assert np.sort(far[near]).tolist() == np.sort(far)[:most].tolist()


@njit
def nearest(far, most, guess, near):
    """Calls what only compiled code can call."""
    return agreement.find_nearest(far, most, guess, near)


def looked_at(surface, place, leaning):
    """What the compiled function says of a place, by one row's own neighbours or by all alike."""
    results = []
    for rows in (1, len(surface.observation)):
        charted = np.tile(surface._runs.charted[:1], (rows, 1, 1))
        points = np.tile(place, (1, rows, 1))
        runs = surface._runs._replace(charted=charted, most=charted.shape[2])
        every = np.ones(len(surface.observation), dtype=bool)
        results.append(agreement.agree(runs, surface._readings, points, every, leaning))
    return results


@pytest.mark.parametrize("leaning", [False, True])
def test_neighbours_by_row_agree_with_common_ones(leaning):
    seen = observation(read(("load-inertia",), np.array([0.5, 0.4]), np.random.default_rng(3)))
    surface = candidate(seen, ("load-inertia",)).surface
    alike, by_row = looked_at(surface, np.array([0.45, 0.5]), leaning)
    for one, other in zip(alike, by_row, strict=True):
        assert one == pytest.approx(other, rel=1e-3, abs=1e-4)


def test_scatter_is_smoothed_within_its_level():
    rows = expectation.Runs.smoothed_over([slice(0, 4), slice(4, 7)])
    assert rows.tolist() == [
        [0, 0, 0, 1, 2], [0, 0, 1, 2, 3], [0, 1, 2, 3, 3], [1, 2, 3, 3, 3],
        [4, 4, 4, 5, 6], [4, 4, 5, 6, 6], [4, 5, 6, 6, 6],
    ]  # fmt: skip


def test_fit_compiles_nothing_further():
    expectation.compile_all()
    functions = agreement.agree, agreement.log_shares, agreement.weigh
    before = [list(function.signatures) for function in functions]
    seen = observation(read(("load-inertia",), np.array([0.5, 0.4]), np.random.default_rng(0)))
    surface = candidate(seen, ("load-inertia",)).surface
    surface.scan(np.array([[0.3, 0.4], [0.5, 0.6]]))
    surface.expected(np.array([0.5, 0.4]))
    assert surface.lost(np.array([0.5, 0.4])) == 0
    assert len(seen) == ROWS
    assert [list(function.signatures) for function in functions] == before
