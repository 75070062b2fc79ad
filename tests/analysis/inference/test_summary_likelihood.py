"""The synthetic likelihood against the exact evidence of a linear world, and on real summaries."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from worlds import synthetic
from worlds.untrained import Untrained

from analysis.inference.summary_likelihood import SummaryRuns, summarise_runs, summary_likelihoods

HIDDEN = 6
MEANS = {(): 0.0, ("a",): 0.6, ("a", "b"): -0.4}
"""Where the summaries of a set lie amid its runs, along every direction."""


def runs_of(key, count, rng):
    """Runs whose summaries are linear in their coordinates, with a scatter of one."""
    places = rng.uniform(0.2, 0.8, (count, 1 + len(key)))
    summaries = MEANS[key] + (places - 0.5) @ slopes(key) + rng.standard_normal((count, HIDDEN))
    return SummaryRuns(places, summaries)


def slopes(key):
    return np.random.default_rng(len(key)).normal(size=(1 + len(key), HIDDEN))


def exact(key, places, at):
    """Log evidence with the same normal prior of the coordinates about the runs."""
    slope, std = slopes(key), 2.0 * places.std(axis=0)
    mean = MEANS[key] + (places.mean(axis=0) - 0.5) @ slope
    covariance = np.eye(HIDDEN) + (slope.T * std**2) @ slope
    return multivariate_normal(mean, covariance).logpdf(at)


@pytest.mark.parametrize("seed", range(3))
def test_evidence_of_a_linear_world(seed):
    """With many runs the differences between sets are those of the exact evidence."""
    rng = np.random.default_rng(seed)
    runs = {key: runs_of(key, 4000, rng) for key in MEANS}
    at = rng.normal(size=HIDDEN)
    found = summary_likelihoods(at[None], runs)
    for key, one in runs.items():
        known = exact(key, one.places, at) - exact((), runs[()].places, at)
        # Of 4000 runs a mean is known to 0.016, which moves a log evidence by some hundredths.
        assert found[key] - found[()] == pytest.approx(known, abs=0.15)


def test_true_set_wins_on_average():
    """Over observations drawn from a set, no other set is likelier in the mean."""
    rng = np.random.default_rng(5)
    runs = {key: runs_of(key, 60, rng) for key in MEANS}
    for true in MEANS:
        drawn = runs_of(true, 100, rng).summaries
        found = [summary_likelihoods(at[None], runs) for at in drawn]
        mean = {key: np.mean([one[key] for one in found]) for key in MEANS}
        assert max(mean, key=lambda key: mean[key]) == true


def test_coordinate_without_effect_costs_only_its_regression():
    rng = np.random.default_rng(6)
    plain = runs_of((), 2000, rng)
    idle = SummaryRuns(
        np.column_stack([plain.places, rng.uniform(0.2, 0.8, 2000)]), plain.summaries
    )
    found = summary_likelihoods(np.zeros((1, HIDDEN)), {(): plain, ("idle",): idle})
    assert found[("idle",)] == pytest.approx(found[()], abs=0.1)


def test_runs_are_read_as_the_bench_would():
    """Noise is drawn, and a level that the observation lacks changes no summary."""
    rng = np.random.default_rng(7)
    seen = synthetic.observation(synthetic.read((), np.array([0.5]), rng))
    seen.values[:, seen.blocks[0]] = np.nan
    places = rng.uniform(0.3, 0.7, (4, 1))
    readings = np.array([synthetic.read((), place, rng) for place in places])
    population = synthetic.population(places, readings)
    other = readings.copy()
    other[:, :, seen.blocks[0]] += 1.0
    again = synthetic.population(places, other)
    posterior = Untrained()
    first, second = (
        summarise_runs(posterior, seen, one, np.random.default_rng(1)).summaries
        for one in (population, again)
    )
    np.testing.assert_allclose(first, second)
    third = summarise_runs(posterior, seen, population, np.random.default_rng(2)).summaries
    assert np.abs(third - first).max() > 0.0
