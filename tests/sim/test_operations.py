"""The count of a step's operations, which the benchmark divides by the machine's limit."""

import re
from pathlib import Path

from yardsticks.operations import count_step

from sim.assembly import Law

PAGE = Path(__file__).parents[2] / "docs" / "performance.md"
SERVO = [Law.PLAY, Law.PLAY, Law.FRICTION, Law.FRICTION]


def test_a_step_takes_as_many_operations_as_the_page_says():
    tally = count_step(SERVO, 14)
    said = re.search(
        r"(\d+) operations \((\d+) add or multiply, (\d+) compare, (\d+) divide\)",
        PAGE.read_text(),
    )
    counted = [tally.total(), tally["add or multiply"], tally["compare"], tally["divide"]]
    assert counted == [int(number) for number in said.groups()]


def test_two_more_coordinates_cost_what_one_pair_of_rows_does():
    less, more = (count_step(SERVO, coordinates) for coordinates in (12, 14))
    grown = more - less
    assert set(grown) == {"add or multiply"}
    # Each row takes four forces (2 each) and turns (2 multiplications, 2 additions).
    assert grown.total() == 2 * (4 * 2 + 4)
