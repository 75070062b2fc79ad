"""Levels in another measure and a direction stated wrongly are named; hidden causes are not."""

from dataclasses import replace

import numpy as np
import pytest
from worlds.hidden import reading

from analysis.estimate import estimate_response
from daq.formats import write_response
from daq.plan import SweepPlan, spaced_frequencies
from sim.effects import parse_effect
from sim.response import simulate
from sim.unit import load_unit
from tui.cli import main

PLAN = SweepPlan(
    spaced_frequencies(100.0, 180.0, 15), (1.5, 4.0), settle_cycles=4, integrate_cycles=6
)


def swept(*effects, seed=1, ratio=0.4):
    settings = tuple(map(parse_effect, effects))
    true = simulate(load_unit("adss"), ratio, PLAN, effects=settings, seed=seed)
    return reading(true, np.random.default_rng(seed))


def stated(response, factor):
    return replace(response, source_vpk=factor * response.source_vpk)


def first_warning(response):
    return [*estimate_response(response, load_unit("adss")).warnings, ""][0]


@pytest.mark.long
def test_levels_in_other_measure_are_stated_first():
    said = first_warning(stated(swept(), 0.5))
    assert "taken for peak-to-peak and halved: multiply source_vpk by 2" in said
    # One factor on friction and backlash does as much, and nothing can tell.
    assert "or motor friction" in said


def test_a_hidden_cause_is_no_mistake():
    warnings = estimate_response(swept("motor-resistance:R_m=6"), load_unit("adss")).warnings
    assert any("run diagnose" in text for text in warnings)
    assert not any("source levels" in text or "direction" in text for text in warnings)


def test_wrong_time_base_is_refused_before_search(tmp_path, capsys):
    path, true = tmp_path / "sweep.csv", swept()
    write_response(replace(true, frequency_hz=1.1 * true.frequency_hz), path)
    assert main(["diagnose", str(path), "--unit", "adss", "--json"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "error: frequencies are likely 1.10 times what they should be" in err
    assert "--as-is" in err
