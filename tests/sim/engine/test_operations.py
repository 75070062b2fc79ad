"""The count of a step's operations, which the benchmark divides by the machine's limit."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from worlds.side_by_side import ADSS, EDSS, law_parameters
from yardsticks.operations import SERVO, count_steps

from sim.drivetrain import paper_drivetrain
from sim.engine.engine import Stretch, carry
from sim.engine.layout import STEPS_SEEN

PAGE = Path(__file__).parents[3] / "docs" / "performance.md"


def test_steps_take_documented_number_of_operations():
    tally = count_steps(SERVO)
    said = re.search(
        rf"{STEPS_SEEN} steps of one lane: (\d+) operations "
        r"\((\d+) add or multiply, (\d+) compare, (\d+) divide\)",
        PAGE.read_text(),
    )
    counted = [tally.total(), tally["add or multiply"], tally["compare"], tally["divide"]]
    assert counted == [int(number) for number in said.groups()]


@pytest.mark.parametrize("unit", [ADSS, EDSS], ids=["adss", "edss"])
def test_counted_steps_are_those_of_paper_units(unit):
    system = paper_drivetrain(unit, 0.4).system()
    one, start = np.ones(1), np.zeros((len(system.states), 1))
    stretch = Stretch(120.0, 2.5 * one, 0.0 * one, 0.0 * one, 0, 1)
    asking = carry(system, law_parameters(system, 1), start, [stretch], [5e-6])
    assert next(asking).layout.structure == SERVO


def test_two_coordinates_cost_a_pair_of_rows():
    more = replace(SERVO, turning=(True, *SERVO.turning), heard=(True, True, *SERVO.heard))
    grown = count_steps(more) - count_steps(SERVO)
    assert set(grown) == {"add or multiply"}
    # Each row turns (a product, and one that is added), takes four forces, and is looked at by
    # four laws in every step, and by the output in one of them.
    assert grown.total() == 2 * (STEPS_SEEN * (1 + 2 + 4 * 2 + 4 * 2) + 2)
