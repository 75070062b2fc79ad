"""The ways in which units of a datasheet differ: few, and all that shows."""

import numpy as np
import pytest

from analysis.ensemble.datasheet_spread import feature_spread, spread_of
from sim.catalogue import CATALOGUE
from sim.effects import drivetrain_with
from sim.unit import load_unit

ADSS, EDSS = load_unit("adss"), load_unit("edss")
FREQUENCIES = np.array([40.0, 80.0, 105.0, 115.0, 170.0, 210.0])
"""Away from the resonance of a model without friction and play, which is infinitely sharp."""


def response(unit):
    return np.log(drivetrain_with(unit, 0.5).system().transfer(FREQUENCIES))


def changed(unit, deviations):
    known = unit.parameters
    return unit.with_parameters(**{s: known[s] * (1.0 + d) for s, d in deviations})


def test_few_values_are_coordinates_of_their_own():
    """Up to seven."""
    spread = spread_of(ADSS)
    assert spread.symbols == ("R_m", "k_t", "J_L", "k_s1", "k_a")
    np.testing.assert_array_equal(spread.ways, np.eye(5))
    np.testing.assert_array_equal(spread.sigmas, np.full(5, 0.005))
    assert spread.gain == 0.005


@pytest.mark.parametrize("unit", [ADSS, EDSS])
def test_seventeen_values_reduce_to_few_coordinates(unit):
    """What is left of the change of a response by chance values of all is under 1 % of it."""
    wide = unit.with_tolerance({"default": 0.05})
    spread = spread_of(wide)
    assert 3 <= len(spread) <= 7
    rng = np.random.default_rng(2)
    symbols = spread.symbols
    whole, left = [], []
    for _ in range(40):
        off = tuple((s, 0.01 * rng.standard_normal()) for s in symbols)
        kept = spread.deviations(spread.along(off))
        whole.append(np.abs(response(changed(unit, off)) - response(unit)))
        left.append(np.abs(response(changed(unit, off)) - response(changed(unit, kept))))
    assert np.sqrt(np.mean(np.square(left))) < 0.06 * np.sqrt(np.mean(np.square(whole)))


def test_coordinates_are_invertible_and_drawn_as_stated():
    spread = spread_of(ADSS.with_tolerance({"default": 0.05, "R_m": 0.2}))
    along = np.linspace(-0.1, 0.2, len(spread))
    np.testing.assert_allclose(spread.along(spread.deviations(along)), along, atol=1e-6)
    rng = np.random.default_rng(1)
    drawn = np.array([spread.along(spread.draw(rng)) for _ in range(2000)])
    np.testing.assert_allclose(drawn.std(axis=0), spread.sigmas, rtol=0.1)


def test_exact_datasheet_still_has_one_coordinate():
    spread = spread_of(ADSS.with_tolerance({"default": 0.0}))
    assert len(spread) == 1
    assert spread.gain == spread.sigmas[0] == 1e-4


def test_name_and_limits_keep_the_coordinates():
    wide = ADSS.with_tolerance({"default": 0.05})
    limits = wide.limits.model_copy(update={"source_vpk": 3.0})
    other = wide.model_copy(update={"name": "mine", "limits": limits})
    np.testing.assert_array_equal(spread_of(other).ways, spread_of(wide).ways)


def test_features_spread_as_root_stiffness_over_inertia():
    frequency, gain = feature_spread(ADSS)
    assert frequency == pytest.approx(0.00354, abs=1e-5)
    assert gain == pytest.approx(0.01)
    assert feature_spread(ADSS.with_tolerance({"default": 0.05}))[0] == pytest.approx(
        0.0354, abs=1e-4
    )


@pytest.mark.parametrize("share", [0.05, 0.2, 0.3])
def test_ranges_of_causes_reach_beyond_the_tolerance(share):
    unit = ADSS.with_tolerance({"default": share})
    for effect in CATALOGUE.values():
        for parameter in effect.parameters:
            known = unit.parameters.get(parameter.name)
            if known is None or parameter.name == "b_t_deg" or not unit.tolerances[parameter.name]:
                continue
            low, high = parameter.range(unit)
            assert high >= known * (1.0 + 3.0 * share)
            assert low <= known / (1.0 + 3.0 * share)
            assert parameter.within(unit) >= 3.0 * share
