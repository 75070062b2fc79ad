"""Which values of a commissioned drive have changed, by closed form and in simulated drives."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from worlds.known_drive import commissioned, seen_again

from analysis.commissioning.belief import (
    Belief,
    believed_by_datasheet,
    believed_since_commissioning,
)
from analysis.commissioning.changes import Changes, find_changes
from analysis.commissioning.coordinates import Coordinates
from analysis.commissioning.identification import Identified
from analysis.commissioning.regression import Gaussian
from analysis.observation.observation import observe
from sim.unit import load_unit

NAMES = ("load-inertia", "motor-inertia", "shaft-stiffness")


def of_linear_data(measured, noise):
    """What is known of three values that are measured directly, each with some noise."""
    coordinates = Coordinates(load_unit("r3-1"), ("J_L", "J_m", "k_s1"), (0.15, 0.15, 0.15))
    common = np.array([[0.02, 0.01, 0.0], [0.01, 0.03, -0.01], [0.0, -0.01, 0.02]])
    prior = Gaussian(np.zeros(3), common + np.eye(3))
    information = np.linalg.inv(prior.covariance) + np.diag(1.0 / noise**2)
    covariance = np.linalg.inv(information)
    found = Gaussian(covariance @ (measured / noise**2), covariance)
    directions = {(name,): way for name, way in zip(NAMES, np.eye(3), strict=True)}
    belief = Belief(coordinates, np.zeros(3), common, commissioned=False)
    return Changes(belief, prior, Identified(found, 1.0, 0.5), directions)


def test_probabilities_are_those_of_normal_densities():
    """Oracle: the density of the measured values under each prior."""
    measured, noise = np.array([0.6, 0.1, -0.05]), np.array([0.1, 0.2, 0.15])
    changes = of_linear_data(measured, noise)
    sets = [((), 0.5), *(((n,), 0.35 / 3) for n in NAMES)]
    sets += [(tuple(sorted(pair)), 0.1 / 3) for pair in combinations(NAMES, 2)]
    expected = {}
    for names, share in [*sets, (NAMES, 0.05)]:
        free = np.diag([1.0 if name in names else 0.0 for name in NAMES])
        spread = changes.belief.common + free + np.diag(noise**2)
        expected[names] = share * multivariate_normal(np.zeros(3), spread).pdf(measured)
    total = sum(expected.values())
    for names, _ in sets:
        assert changes.probabilities[names] == pytest.approx(expected[names] / total, rel=1e-9)
    assert changes.likeliest == ("load-inertia",)


def test_a_change_has_its_conditional_size():
    """Oracle: the normal distribution of one value, given three that are correlated."""
    measured, noise = np.array([0.6, 0.1, -0.05]), np.array([0.1, 0.2, 0.15])
    changes = of_linear_data(measured, noise)
    found = changes.given(("load-inertia",))
    prior = changes.belief.common + np.diag([1.0, 0.0, 0.0])
    gain = prior @ np.linalg.inv(prior + np.diag(noise**2))
    assert found.changes[0] == pytest.approx(0.15 * (gain @ measured)[0])
    assert found.covariance[1, 1] == pytest.approx(0.15**2 * (prior - gain @ prior)[0, 0])
    assert found.ratio == 1.0


def test_values_without_a_cause_count_for_none():
    """Probability of what the catalogue cannot name is no probability that nothing has changed."""
    known = of_linear_data(np.array([0.6, 0.1, -0.05]), np.array([0.1, 0.2, 0.15]))
    names = (("load-inertia",), ("J_s1",), ("contribution_ratio",))
    directions = dict(zip(names, known.directions.values(), strict=True))
    changes = replace(known, directions=directions)
    whole, named = changes.probabilities, changes.named()
    assert named[()] == pytest.approx(whole[()] + whole[("contribution_ratio",)])
    with_others = [p for names, p in whole.items() if "load-inertia" in names]
    assert named[("load-inertia",)] == pytest.approx(sum(with_others))
    assert set(named) == {(), ("load-inertia",)}
    assert changes.likeliest == max(named, key=named.get)


def test_values_that_all_changed_are_no_cause():
    changes = of_linear_data(np.array([2.0, -2.0, 2.0]), np.full(3, 0.05))
    assert changes.likeliest is None


def test_two_changes_at_once_are_no_cause():
    """A cause that is no value is likelier, and left to the search."""
    changes = of_linear_data(np.array([2.0, -2.0, 0.0]), np.full(3, 0.05))
    assert next(iter(changes.probabilities)) == ("load-inertia", "motor-inertia")
    assert changes.likeliest is None


def test_change_is_no_cause_beside_all():
    """Values together imitate what none of them stands for: the search decides."""
    changes = of_linear_data(np.array([2.0, 0.3, 0.25]), np.full(3, 0.05))
    believed = changes.probabilities
    assert next(iter(believed)) == ("load-inertia",)
    assert believed[("all values",)] > 0.5 * believed[("load-inertia",)]
    assert changes.likeliest is None


@pytest.mark.parametrize(
    ("measured", "rank", "suffice"),
    [
        ((0.0, 0.0, 0.0), 0.9, True),
        ((0.0, 0.0, 0.0), 0.97, False),
        ((0.28, -0.28, 0.42), 0.5, False),
        ((2.0, 0.0, 0.0), 0.5, True),
    ],
)
def test_values_suffice_where_they_leave_nothing(measured, rank, suffice):
    """Neither in what no value changes, nor in that all of them are off."""
    known = of_linear_data(np.array(measured), np.full(3, 0.05))
    changes = replace(known, identified=replace(known.identified, misfit_rank=rank))
    assert (changes.likeliest == (), changes.suffice) == (measured[0] < 1.0, suffice)


def test_a_change_beside_a_doubtful_one_counts():
    """Two that are hardly likelier than one of them are no reason to name neither."""
    changes = of_linear_data(np.array([2.0, -0.42, 0.0]), np.full(3, 0.05))
    pair, single = ("load-inertia", "motor-inertia"), ("load-inertia",)
    believed = changes.probabilities
    assert believed[single] < believed[pair] < 2.0 * believed[single]
    assert changes.likeliest == single


@pytest.mark.parametrize(
    ("misfit", "rank", "cause"),
    [
        (1.2, 1.0, ("load-inertia",)),
        (1.6, 1.0, None),
        (1.6, 0.99, ("load-inertia",)),
        (2.1, 0.99, None),
    ],
)
def test_what_values_leave_is_no_cause(misfit, rank, cause):
    """A little more than simulated drives widens the errors; far more is another cause."""
    known = of_linear_data(np.array([0.6, 0.0, 0.0]), np.full(3, 0.05))
    found = Identified(known.identified.posterior, misfit, rank)
    assert replace(known, identified=found).likeliest == cause


@pytest.mark.parametrize(
    ("changed", "cause", "seed"),
    [
        ({}, (), 2),
        pytest.param({"J_m": 1.1}, ("motor-inertia",), 1, marks=pytest.mark.long),
        pytest.param({"T_f_m": 0.9}, ("motor-coulomb-friction",), 3, marks=pytest.mark.long),
        pytest.param({"k_s1": 0.9}, ("shaft-stiffness",), 4, marks=pytest.mark.long),
    ],
)
def test_a_tenth_of_one_value_is_named(changed, cause, seed):
    """The likeliest of some 90 sets, for the right reason: its size is within three errors."""
    unit = commissioned("walkman-b11")
    belief = believed_since_commissioning(unit)
    found = find_changes(belief, observe(seen_again(unit, seed, **changed)), seed=seed)
    assert found.likeliest == cause
    if cause:
        told = found.given(cause)
        (factor,) = changed.values()
        off = told.changes[0] - np.log(factor)
        assert abs(off) < 3.0 * np.sqrt(told.covariance[1, 1])


OFF = {"J_m": 0.93, "J_L": 1.06, "k_s1": 1.07, "T_f_m": 1.08, "k_a": 0.95, "c_s1": 0.95}
"""Values that are off their datasheet by one to one and a half standard deviations of 5 %."""


@pytest.mark.parametrize(
    ("changed", "cause", "seed"),
    [
        ({"b_t_deg": 2.0}, ("total-backlash",), 1),
        pytest.param({}, (), 2, marks=pytest.mark.long),
        pytest.param({"b_t_deg": 0.5}, ("total-backlash",), 3, marks=pytest.mark.long),
        pytest.param({"J_L": 1.4}, ("load-inertia",), 4, marks=pytest.mark.long),
        pytest.param({"T_f_m": 2.5}, ("motor-coulomb-friction",), 5, marks=pytest.mark.long),
    ],
)
def test_a_value_beyond_its_tolerance_is_named(changed, cause, seed):
    """Though all others are off, too: its size is within three errors, and of the right sign."""
    unit = load_unit("walkman-b11").with_tolerance({"default": 0.05})
    factors = OFF | {symbol: OFF.get(symbol, 1.0) * factor for symbol, factor in changed.items()}
    found = find_changes(
        believed_by_datasheet(unit), observe(seen_again(unit, seed, **factors)), seed=seed
    )
    assert found.likeliest == cause
    if cause:
        told = found.given(cause)
        (symbol,) = changed
        off = told.changes[0] - np.log(factors[symbol])
        assert abs(off) < 3.0 * np.sqrt(told.covariance[1, 1])


def test_datasheet_is_believed_by_its_tolerances():
    """Each value by itself; the backlash of one stage is exact, and may have changed."""
    unit = load_unit("r3-1").with_tolerance({"default": 0.0, "J_L": 0.06, "T_f_m": 0.3})
    belief = believed_by_datasheet(unit)
    shares = np.array(belief.coordinates.shares)
    stds = dict(
        zip(belief.coordinates.symbols, shares * np.sqrt(np.diag(belief.common)), strict=True)
    )
    assert stds == pytest.approx({"J_L": 0.06, "T_f_m": 0.3, "b_t_deg": 1e-3})
    assert np.count_nonzero(belief.common) == len(stds)
    assert not belief.centre.any()


def test_two_stages_have_any_ratio():
    belief = believed_by_datasheet(load_unit("adss").with_tolerance({"default": 0.05}))
    assert belief.coordinates.symbols[-1] == "contribution_ratio"
    assert belief.common[-1, -1] == pytest.approx(1.0)
    assert not belief.commissioned
    assert "b_t_deg" not in belief.coordinates.symbols


@pytest.mark.parametrize("name", ["adss", "r3-1"])
def test_exact_datasheet_leaves_nothing_to_ask(name):
    unit = load_unit(name).with_tolerance(dict.fromkeys(load_unit(name).tolerances, 0.0))
    assert believed_by_datasheet(unit) is None


@pytest.mark.parametrize("order", [None, (), ("contribution_ratio",), ("nonsense",)])
def test_unit_without_commissioned_values_has_none(order):
    unit = load_unit("walkman-b11")
    if order is not None:
        known = commissioned("walkman-b11").commissioning
        square = tuple(tuple(row) for row in np.eye(len(order)).tolist())
        record = known.model_copy(update={"order": order, "covariance": square})
        unit = unit.model_copy(update={"commissioning": record})
    assert believed_since_commissioning(unit) is None


def test_two_stages_need_their_ratio():
    known = commissioned("adss")
    assert believed_since_commissioning(known) is None
    order = (*known.commissioning.order, "contribution_ratio")
    square = tuple(tuple(row) for row in (1e-4 * np.eye(len(order))).tolist())
    record = known.commissioning.model_copy(
        update={"order": order, "covariance": square, "contribution_ratio": 0.5}
    )
    told = believed_since_commissioning(known.model_copy(update={"commissioning": record}))
    assert told is not None
    assert told.commissioned
