"""Responses of drives that are not the paper's: none looks like a mistake; a mistake still does."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import drives

from analysis.observation.input_check import check_input
from analysis.observation.linear_family import AT_REST, Family
from daq.configs import config_names
from daq.plan import SweepPlan
from sim.datasheet import natural_frequencies
from sim.drivetrain import paper_drivetrain
from sim.response import simulate
from sim.unit import load_unit

UNITS = {name: drives.unit(sections) for name, sections in drives.DRIVES.items()} | {
    name: load_unit(name) for name in config_names("units")
}

SEVERAL = ("irb", "r3-2", "r3-3", "srv02-torsion", "walkman-2300")
"""Drives of the same form as others here."""


def swept(unit, band=(0.6, 1.4)):
    modes = natural_frequencies(unit)
    low, high = band[0] * modes.anti_resonances_hz[0], band[1] * modes.resonances_hz[0]
    plan = SweepPlan(
        tuple(np.geomspace(low, high, 16).tolist()),
        (0.4 * unit.limits.source_vpk, 0.8 * unit.limits.source_vpk),
        settle_cycles=5,
        integrate_cycles=4,
    )
    return simulate(unit, 1.0 if unit.stages == 1 else 0.4, plan, seed=3)


@pytest.mark.parametrize(
    "name",
    [pytest.param(one, marks=pytest.mark.long) if one in SEVERAL else one for one in UNITS],
)
def test_a_true_response_is_taken(name):
    found = check_input(swept(UNITS[name]), UNITS[name])
    assert found.mistake is None, found.words
    assert not found.foreign


@pytest.mark.parametrize("name", ["speed, command", "position"])
def test_response_of_closed_loop_is_taken(name):
    unit = drives.unit(drives.LOOPS[name])
    found = check_input(swept(unit), unit)
    assert found.mistake is None, found.words
    assert not found.foreign


@pytest.mark.parametrize("name", drives.LOOPS)
def test_family_has_linear_response_of_loop(name):
    unit, hertz = drives.unit(drives.LOOPS[name]), np.array([15.0, 40.0, 90.0, 250.0])
    shown = np.exp(Family(unit).responses(AT_REST[None], hertz)[0])
    exact = paper_drivetrain(unit, 0.5).system().transfer(hertz)
    np.testing.assert_allclose(shown, exact, rtol=0.1)


@pytest.mark.parametrize("name", ["encoder, speed", "current"])
def test_mistake_is_found_on_any_drive(name):
    response = swept(UNITS[name])
    turned = replace(response, gain=np.conj(response.gain))
    assert check_input(turned, UNITS[name]).mistake == "conjugate"


@pytest.mark.parametrize(
    ("name", "power", "words"),
    [
        ("accelerometer sampled", -1, "a velocity, not an acceleration"),
        ("motor current", 1, "the derivative of a current, not a current"),
    ],
)
def test_mistake_is_told_of_what_is_read(name, power, words):
    """An accelerometer reads an acceleration, and a velocity is its integral."""
    response = swept(UNITS[name], (0.25, 2.0))
    swung = (2j * np.pi * response.frequency_hz / 400.0) ** power
    found = check_input(replace(response, gain=response.gain * swung), UNITS[name])
    assert words in found.words
