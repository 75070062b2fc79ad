"""How long a named candidate is looked at, in a world whose answers are known."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from worlds import synthetic

from analysis.diagnosis import refinement as sharpening
from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.runs import Population
from sim.engine.effort import counting, spend

TRUE = ("load-inertia",)


def population_of(groups, rng):
    """Runs of synthetic machines at the places that were asked for."""
    places = np.concatenate([group.places for group in groups])
    each = [len(group.places) for group in groups]
    off = np.repeat([rng.normal(0.0, synthetic.SIGMAS) for _ in groups], each, axis=0)
    runs = np.array([synthetic.read(TRUE, p, rng, d) for p, d in zip(places, off, strict=True)])
    mean = np.exp(runs[:, 0] + 1j * runs[:, 1])
    return Population(places, off, mean, np.full(mean.shape, 1e-4))


@pytest.fixture
def asked(monkeypatch):
    """How many groups were simulated in each round."""
    rounds = []

    def simulate(unit, groups, observation, rng, executor=None, progress=None):
        rounds.append(len(groups))
        return {TRUE: population_of(groups, rng)}

    monkeypatch.setattr(sharpening, "simulate_groups", simulate)
    return rounds


def sized(stds, ratio_std=None):
    """A stand-in for the sizing: what it says of the error of the ratio, call by call.

    Or of the size, where that of the ratio is given.
    """
    told = iter(stds)

    def size(candidate, observation, rng, nearest):
        std = next(told)
        both = (std, 0.001) if ratio_std is None else (ratio_std, std)
        return ParameterPosterior(np.array([0.5, 0.5]), np.diag(np.square(both)))

    return size


def found(observed, seed):
    candidate = synthetic.candidate(observed, TRUE, seed)
    runs = population_of([group_at(p) for p in candidate.population.places[::10]],
                         np.random.default_rng(seed))  # fmt: skip
    return replace(candidate, population=runs)


def group_at(place):
    from analysis.ensemble.model import Hypothesis
    from analysis.ensemble.runs import Group

    return Group(Hypothesis(synthetic.ADSS, TRUE), np.linspace(0.0, 1.0, 10), place[1:])


def observed_at(seed):
    rng = np.random.default_rng(seed)
    return synthetic.observation(synthetic.read(TRUE, np.array([0.5, 0.5]), rng))


def sharpened(observed):
    rng = np.random.default_rng(0)
    return sharpening.refine_parameters(synthetic.ADSS, found(observed, 0), observed, rng)


def test_what_is_sharp_costs_nothing_more(monkeypatch, asked):
    observed = observed_at(0)
    monkeypatch.setattr(sharpening, "estimate_parameters", sized([0.01]))
    sharpened(observed)
    assert asked == []


def test_it_stops_as_soon_as_the_answer_is_sharp(monkeypatch, asked):
    observed = observed_at(0)
    monkeypatch.setattr(sharpening, "estimate_parameters", sized([0.2, 0.1, 0.01]))
    rng, told = np.random.default_rng(0), []
    answer = sharpening.refine_parameters(
        synthetic.ADSS, found(observed, 0), observed, rng, progress=told.append
    )
    assert len(asked) == 2
    assert answer.covariance[0, 0] == pytest.approx(0.01**2)
    assert told == sorted(told)


def test_it_ends_where_the_data_tell_no_more(monkeypatch, asked):
    observed = observed_at(0)
    monkeypatch.setattr(sharpening, "estimate_parameters", sized([0.2] * 50, 0.02))
    monkeypatch.setattr(sharpening, "_APART", 0.0)
    answer = sharpened(observed)
    assert len(asked) == 2
    assert answer.covariance[1, 1] == pytest.approx(0.2**2)


@pytest.mark.parametrize(
    ("stds", "rounds"), [([0.07] * 50, 12), ([0.07] * 4 + [0.024] * 50, 4), ([0.07, 0.02], 1)]
)
def test_a_ratio_that_is_hardly_known_gets_all_rounds(monkeypatch, asked, stds, rounds):
    """However little they bring: what is told of it then is chance of where runs lie."""
    observed = observed_at(0)
    monkeypatch.setattr(sharpening, "estimate_parameters", sized(stds))
    monkeypatch.setattr(sharpening, "_ENOUGH", 10_000)
    sharpened(observed)
    assert asked == [8] * rounds


def test_it_gets_no_more_runs_than_are_enough(monkeypatch, asked):
    observed = observed_at(0)
    monkeypatch.setattr(sharpening, "estimate_parameters", sized([0.07] * 50))
    known = len(found(observed, 0).population)
    monkeypatch.setattr(sharpening, "_ENOUGH", known + 80)
    sharpened(observed)
    assert len(asked) == 2


@pytest.mark.parametrize(("share", "rounds"), [(0.42, 3), (2.5, 1), (1e-9, 12)])
def test_it_takes_no_more_than_it_may(monkeypatch, asked, share, rounds):
    """A round that is begun is finished; what was simulated before does not count."""
    observed, made = observed_at(0), sharpening.simulate_groups
    granted_s = max(180 * observed.plans[0][0].duration_s, 27_600.0)

    def spending(*given):
        spend(1.0, share * granted_s)
        return made(*given)

    monkeypatch.setattr(sharpening, "estimate_parameters", sized([0.07] * 50))
    monkeypatch.setattr(sharpening, "_ENOUGH", 10_000)
    monkeypatch.setattr(sharpening, "simulate_groups", spending)
    with counting():
        spend(1.0, granted_s)
        sharpened(observed)
    assert len(asked) == rounds


@pytest.mark.parametrize(
    ("stds", "rounds"),
    [
        ([0.085, 0.077, 0.076, 0.063, 0.062, 0.054, 0.05, 0.044, 0.035], 8),
        ([0.085, 0.080, 0.079, 0.060, 0.050, 0.040], 2),
        ([0.085, 0.077, 0.068, 0.067, 0.066, 0.065], 4),
        ([0.085, 0.034], 1),
    ],
)
def test_one_round_that_brought_little_to_a_size_does_not_end_it_and_two_do(
    monkeypatch, asked, stds, rounds
):
    observed = observed_at(0)
    monkeypatch.setattr(sharpening, "estimate_parameters", sized(stds, 0.02))
    monkeypatch.setattr(sharpening, "_APART", 0.0)
    sharpened(observed)
    assert len(asked) == rounds


def test_all_runs_take_part_in_what_is_told(monkeypatch, asked):
    observed, took_part = observed_at(0), []
    size = sharpening.estimate_parameters

    def sizing(candidate, observation, rng, nearest):
        took_part.append((nearest, len(candidate.population)))
        return size(candidate, observation, rng, nearest)

    monkeypatch.setattr(sharpening, "estimate_parameters", sizing)
    monkeypatch.setattr(sharpening, "_BLUNT", 0.0)
    sharpened(observed)
    assert all(nearest >= runs for nearest, runs in took_part)
    assert took_part[-1][1] > 2 * took_part[0][1]


@pytest.mark.parametrize(("reach", "rounds"), [(0.17, 0), (0.14, 1)])
def test_a_sharp_answer_of_runs_that_lie_close_together_is_looked_at_again(
    monkeypatch, asked, reach, rounds
):
    """Runs evenly over a size's reach lie that over the root of three apart."""
    observed, steps = observed_at(0), np.linspace(-1.0, 1.0, 40)
    candidate = found(observed, 0)
    places = np.column_stack([np.linspace(0.0, 1.0, 40), 0.5 + reach * steps])
    tens = [SimpleNamespace(places=ten) for ten in np.split(places, 4)]
    made = population_of(tens, np.random.default_rng(0))
    candidate = replace(candidate, population=made)
    error = 0.1 / np.sqrt(3.0)

    def size(candidate, observation, rng, nearest):
        told = 0.03 if len(candidate.population) > 40 else error
        return ParameterPosterior(np.array([0.5, 0.5]), np.diag([0.001**2, told**2]))

    monkeypatch.setattr(sharpening, "_SHARP", 0.07)
    monkeypatch.setattr(sharpening, "estimate_parameters", size)
    sharpening.refine_parameters(synthetic.ADSS, candidate, observed, np.random.default_rng(0))
    assert len(asked) == rounds


def test_it_goes_on_as_long_as_it_pays_but_not_for_ever(monkeypatch, asked):
    observed = observed_at(0)
    monkeypatch.setattr(sharpening, "estimate_parameters", sized(0.5 * 0.9 ** np.arange(50), 0.02))
    sharpened(observed)
    assert len(asked) == sharpening._ROUNDS


@pytest.mark.parametrize("seed", range(4))
def test_further_runs_bring_the_answer_no_farther_from_the_truth(asked, seed):
    observed = observed_at(seed)
    candidate = found(observed, seed)
    before = sharpening.estimate_parameters(candidate, observed, np.random.default_rng(0))
    after = sharpening.refine_parameters(
        synthetic.ADSS, candidate, observed, np.random.default_rng(0)
    )
    error = np.abs(after.mean - 0.5) / np.sqrt(np.diag(after.covariance))
    # Four draws of two numbers: one beyond 3.5 sigma in 250 runs of this test.
    assert np.all(error < 3.5)
    assert np.all(np.diag(after.covariance) <= 1.5 * np.diag(before.covariance))
