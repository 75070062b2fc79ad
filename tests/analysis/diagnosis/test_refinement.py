"""How long a named candidate is looked at, in a world whose answers are known."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import synthetic, synthetic_runs

from analysis.diagnosis.refinement import refine_parameters
from analysis.emulation.model_parameters import estimate_parameters
from analysis.ensemble.model import Hypothesis
from analysis.ensemble.runs import Group, simulate_groups
from sim.engine.effort import counting, spend
from sim.unit import load_unit

TRUE = ("load-inertia",)
HIDDEN = np.array([0.5, 0.5])
RATIOS = np.linspace(0.0, 1.0, 10)
ROUND = 8
"""Groups that are simulated at a time."""


class Looking:
    """A candidate of ten groups for what was observed in a world that scatters."""

    def __init__(self, scatter, seed=0, world=None):
        self.world = world or synthetic_runs.World(scatter)
        rng = np.random.default_rng(seed)
        self.seen = synthetic.observation(synthetic.read(TRUE, HIDDEN, rng, None, scatter))
        known = synthetic.candidate(self.seen, TRUE, seed, scatter=scatter)
        sizes = known.population.places[::10, 1:]
        groups = [Group(Hypothesis(synthetic.ADSS, TRUE), RATIOS, size) for size in sizes]
        first = synthetic_runs.World(scatter)
        made = simulate_groups(synthetic.ADSS, groups, self.seen, rng, first)
        self.candidate = replace(known, population=made[TRUE])

    def before(self):
        return estimate_parameters(self.candidate, self.seen, np.random.default_rng(0), 720)

    def after(self, progress=None):
        return refine_parameters(
            synthetic.ADSS,
            self.candidate,
            self.seen,
            np.random.default_rng(0),
            self.world,
            progress,
        )


def test_ratio_of_one_stage_is_not_refined():
    """Plain there is nothing to size, and beside a cause the ratio asks for no rounds."""
    one_stage = load_unit("feed-axis")
    looking, rounds = Looking(scatter=0.6), {}
    plain = synthetic.candidate(looking.seen, (), scatter=0.6)
    for name, candidate in (("plain", plain), ("cause", looking.candidate)):
        world = synthetic_runs.World(0.6)
        arguments = candidate, looking.seen, np.random.default_rng(0), world
        refine_parameters(one_stage, *arguments)
        rounds[name] = len(world.rounds)
    assert rounds["plain"] == 0
    assert rounds["cause"] <= 1


def stds(posterior):
    return np.sqrt(np.diag(posterior.covariance))


def test_sharp_answer_needs_no_refinement():
    looking = Looking(scatter=0.1)
    assert stds(looking.after()).max() < 0.035
    assert looking.world.rounds == []


@pytest.mark.parametrize("scatter", [0.6, 0.7])
def test_refinement_stops_at_sharp_answer(scatter):
    looking, told = Looking(scatter), []
    before, after = stds(looking.before()), stds(looking.after(told.append))
    assert looking.world.rounds == [ROUND]
    assert np.all(after < before)
    assert np.all(after < [0.0251, 0.035])
    assert len(told) == 1


def test_uncertain_ratio_uses_all_rounds_only():
    looking, told = Looking(scatter=10.0), []
    assert stds(looking.after(told.append))[0] > 0.025
    assert looking.world.rounds == [ROUND] * 12
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_closely_spaced_runs_widen_the_posterior():
    """However sharp the answer: what is learned is never more wrong than the runs are apart."""
    looking = Looking(scatter=0.1)
    sizes = np.linspace(0.495, 0.505, 4)[:, None]
    groups = [
        Group(Hypothesis(synthetic.ADSS, TRUE), 0.5 + 0.01 * (RATIOS - 0.5), size) for size in sizes
    ]
    rng, near = np.random.default_rng(1), synthetic_runs.World(scatter=0.1)
    made = simulate_groups(synthetic.ADSS, groups, looking.seen, rng, near)
    looking.candidate = replace(looking.candidate, population=made[TRUE])
    looking.after()
    assert looking.world.rounds != []


@pytest.mark.parametrize(("share", "rounds"), [(0.42, 3), (2.5, 1), (1e-9, 12)])
def test_refinement_keeps_its_simulation_budget(share, rounds):
    """A round that is begun is finished; what was simulated before does not count."""

    class Slow(synthetic_runs.World):
        def each(self, work, tasks, progress=None):
            spend(1.0, share * granted_s)
            return super().each(work, tasks, progress)

    looking = Looking(scatter=10.0, world=Slow(scatter=10.0))
    granted_s = max(180 * looking.seen.plans[0][0].duration_s, 27_600.0)
    with counting():
        spend(1.0, granted_s)
        looking.after()
    assert len(looking.world.rounds) == rounds


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.long) for n in (1, 2, 3))])
def test_more_runs_do_not_worsen_the_answer(seed):
    looking = Looking(scatter=1.0, seed=seed)
    before, after = looking.before(), looking.after()
    # Four draws of two numbers: one beyond 3.5 sigma in 250 runs of this test.
    assert np.all(np.abs(after.mean - HIDDEN) < 3.5 * stds(after))
    assert np.all(np.diag(after.covariance) <= 1.5 * np.diag(before.covariance))
