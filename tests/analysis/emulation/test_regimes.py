"""States of motion: runs are compared with an observation only where both do the same."""

import numpy as np
import pytest
from worlds.synthetic import ROWS, observation

from analysis.emulation.emulator import Emulator
from analysis.emulation.kernels import log_shares
from analysis.emulation.regimes import Regimes, find_regimes
from analysis.ensemble.runs import Population

RUNS = 120
QUIET = 0.2
"""Share of runs on the quiet branch."""
MIDDLE = np.array([0.5])


def motions(quiet, seen, first=(0,)):
    starts = np.zeros(len(seen), dtype=bool)
    starts[list(first)] = True
    return Regimes(np.array(quiet, dtype=bool), np.array(seen, dtype=np.int8), starts)


def test_regime_is_detected_by_scatter_above_noise():
    seen = observation(np.zeros((3, ROWS)))
    floor = 0.5 * np.log(2.0 * seen.noise**2)
    seen.values[2] = floor
    seen.values[2, 1] = floor[1] + 3.0
    seen.values[2, 2] = np.nan
    variance = np.zeros((2, ROWS))
    variance[1] = 100.0 * seen.noise**2
    runs = Population(
        np.zeros((2, 1)),
        np.zeros((2, 5)),
        np.ones((2, ROWS), dtype=complex),
        variance,
        np.array([0, 1]),
    )
    found = find_regimes(seen, runs)
    assert found.quiet.tolist() == [[True] * ROWS, [False] * ROWS]
    assert found.seen.tolist() == [1, 0, -1] + [1] * (ROWS - 3)
    assert np.flatnonzero(found.starts).tolist() == [block.start for block in seen.blocks]
    assert found.alike[:, :4].tolist() == [[1, 0, 1, 1], [0, 1, 1, 0]]


def shares_of(found):
    """Log share (rows,) of runs of equal weight that do as was observed, at every row."""
    return log_shares(np.ones(len(found.quiet)), *found.course)


def test_regime_shares_count_starts_and_changes():
    quiet = [[True] * 4] * 2 + [[False] * 4] * 6
    shares = shares_of(motions(quiet, [1, 1, 1, 1]))
    assert shares[0] == pytest.approx(np.log(2.5 / 9.0))
    assert shares[1:] == pytest.approx(np.log(2.98 / 3.0))
    jumped = shares_of(motions(quiet, [1, 1, 0, 0]))
    # Of two quiet runs none changes; then six of six stay.
    assert jumped[2] == pytest.approx(np.log(0.02 / 3.0))
    assert jumped[3] == pytest.approx(np.log(6.98 / 7.0))
    both = shares_of(motions(quiet, [1, 1, 1, 1], first=(0, 2)))
    assert both[2] == pytest.approx(both[0])
    assert not np.any(shares_of(Regimes.unknown(8, 4)))


def test_known_regimes_take_those_of_new_observation():
    one = motions([[True, False, True]], [0, -1, 1])
    other = one.against(np.array([True, True, False]))
    assert other.seen.tolist() == [1, -1, 0]
    assert one.of(np.array([False])).quiet.shape == (0, 3)


@pytest.fixture(params=range(4))
def branching(request):
    """Runs of which some keep quiet, and the others lie far off and scatter; one is seen quiet."""
    rng = np.random.default_rng(request.param)
    quiet = rng.uniform(size=RUNS) < QUIET
    values = 0.01 * rng.standard_normal((RUNS, 3, ROWS))
    loud = 0.3 * rng.standard_normal((RUNS, 3, ROWS)) - 0.5
    values[~quiet] = loud[~quiet]
    states = motions(np.tile(quiet[:, None], (1, ROWS)), np.ones(ROWS))
    return observation(np.zeros((3, ROWS))), values, states, rng


def surface(seen, values, states):
    places = np.linspace(0.0, 1.0, len(values))[:, None]
    none = np.empty((0, 3, ROWS))
    return Emulator(seen, places, values, np.array([0.5]), none, np.empty(0), states, 0.005, 4.0)


def test_quiet_prediction_uses_quiet_runs_only(branching):
    seen, values, states, _ = branching
    mean, std = surface(seen, values, states).expected(MIDDLE)
    assert np.abs(mean[:2]).max() < 0.02
    assert np.median(std[:2]) == pytest.approx(0.01, rel=0.4)
    values[~states.quiet[:, 0]] += 7.0
    again, _ = surface(seen, values, states).expected(MIDDLE)
    assert np.abs(again - mean).max() < 0.01


def test_two_regimes_precede_imitation_of_one(branching):
    seen, values, states, rng = branching
    imitation = 0.01 * rng.standard_normal((RUNS, 3, ROWS)) + 0.02
    always = motions(np.ones((RUNS, ROWS)), np.ones(ROWS))
    true, false = surface(seen, values, states), surface(seen, imitation, always)
    assert true.fit(MIDDLE).log_likelihood > false.fit(MIDDLE).log_likelihood + 20.0
    # What taking every point for itself would say.
    blurred = surface(seen, values, Regimes.unknown(RUNS, ROWS))
    assert blurred.fit(MIDDLE).log_likelihood < false.fit(MIDDLE).log_likelihood - 20.0


def test_unseen_regime_is_compared_with_penalty():
    rng = np.random.default_rng(1)
    seen = observation(np.zeros((3, ROWS)))
    values = 0.01 * rng.standard_normal((RUNS, 3, ROWS))
    lost = surface(seen, values, motions(np.zeros((RUNS, ROWS)), np.ones(ROWS)))
    fit = lost.fit(MIDDLE)
    assert np.all(np.isfinite(fit.density))
    known = surface(seen, values, motions(np.ones((RUNS, ROWS)), np.ones(ROWS)))
    assert fit.log_likelihood < known.fit(MIDDLE).log_likelihood - 3.0
