"""Frequencies off by one factor are told from causes, by the runs of the estimate alone."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.estimate import estimate_response
from daq.formats import read_response
from sim.unit import load_unit
from tui.places import cache_folder

PRACTICE = Path(__file__).parents[2] / "data" / "practice"


def first_warning(name, factor=1.0):
    true = read_response(PRACTICE / f"{name}.csv")
    true = true.take(np.arange(0, len(true), 3))
    response = replace(true, frequency_hz=factor * true.frequency_hz)
    found = estimate_response(response, load_unit(true.unit), cache=cache_folder())
    return found.warnings[0] if found.warnings else ""


@pytest.mark.parametrize("factor", [1.1])
def test_wrong_time_base_is_stated_first(factor):
    found = re.match(
        r"frequencies are likely ([0-9.]+) times what they should be",
        first_warning("practice-09", factor),
    )
    assert found
    assert float(found[1]) == pytest.approx(factor, abs=0.03)


@pytest.mark.parametrize(
    "name", [pytest.param("practice-01", marks=pytest.mark.long), "practice-02"]
)
def test_hidden_cause_is_no_wrong_time_base(name):
    assert "frequencies are likely" not in first_warning(name)
