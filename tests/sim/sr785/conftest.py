"""A controller on the bus of a simulated SR785 that was just switched on."""

import pytest
from instruments.simulated_sr785 import Bench


@pytest.fixture
def bench():
    made = Bench()
    assert made.events() == 128  # it was just switched on
    return made
