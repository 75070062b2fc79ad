"""Coordinates of a drive's parameters, against what their definition says."""

import numpy as np
import pytest

from analysis.commissioning.coordinates import RATIO, Coordinates
from daq.errors import InputError
from sim.unit import load_unit

ADSS = load_unit("adss").with_tolerance({"default": 0.05})


def test_datasheet_has_coordinate_zero():
    coordinates = Coordinates.of(ADSS)
    values = coordinates.values(coordinates.nominal())
    assert values.pop(RATIO) == pytest.approx(0.5)
    known = ADSS.parameters
    assert values == pytest.approx({symbol: known[symbol] for symbol in values})


def test_one_coordinate_is_one_tolerance():
    coordinates = Coordinates.of(ADSS)
    values = coordinates.values(np.ones(len(coordinates)))
    assert values["k_t"] / ADSS.parameters["k_t"] == pytest.approx(np.exp(0.05))
    # Phi(1): a normal coordinate makes every ratio as likely as any other.
    assert values[RATIO] == pytest.approx(0.841345, abs=1e-6)


def test_exact_values_have_no_coordinate():
    assert not {"N", "N_1", "filter_numerator"} & set(Coordinates.of(ADSS).symbols)
    few = Coordinates.of(load_unit("adss")).symbols
    assert set(few) == {"R_m", "k_t", "k_a", "k_ts", "k_s1", "J_L", RATIO}


def test_datasheet_value_zero_has_no_coordinate():
    frictionless = ADSS.with_parameters(B_m=0.0, T_f_L=0.0)
    left = set(Coordinates.of(ADSS).symbols) - set(Coordinates.of(frictionless).symbols)
    assert left == {"B_m", "T_f_L"} & set(Coordinates.of(ADSS).symbols)
    assert left
    with pytest.raises(InputError, match="b_t_deg is 0"):
        Coordinates.of(ADSS.with_parameters(b_t_deg=0.0), total_backlash_unknown=True)


def test_slopes_are_derivatives():
    coordinates = Coordinates.of(ADSS, total_backlash_unknown=True)
    z, step = np.linspace(-1.0, 1.0, len(coordinates)), 1e-6
    factors = [coordinates.factors(z + sign * step) for sign in (1.0, -1.0)]
    logs = (np.log(factors[0]) - np.log(factors[1])) / (2.0 * step)
    plain = (factors[0] - factors[1]) / (2.0 * step)
    ratio = np.array([symbol == RATIO for symbol in coordinates.symbols])
    np.testing.assert_allclose(coordinates.slopes(z), np.where(ratio, plain, logs), rtol=1e-6)


def test_machine_has_values_of_its_coordinates():
    coordinates = Coordinates.of(ADSS, total_backlash_unknown=True)
    z = np.full(len(coordinates), 0.7)
    machine, values = coordinates.machine(z, 3), coordinates.values(z)
    assert (machine.ratio, machine.b_t_deg) == pytest.approx((values[RATIO], values["b_t_deg"]))
    known = ADSS.parameters
    for symbol, deviation in machine.deviations:
        assert known[symbol] * (1.0 + deviation) == pytest.approx(values[symbol])
