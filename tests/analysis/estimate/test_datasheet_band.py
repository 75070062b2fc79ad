"""The band in which units of a datasheet read: what it holds, and what it is called."""

import math

import numpy as np
import pytest

from analysis.estimate.datasheet_band import Known, datasheet_band, known_of_estimate
from daq.errors import AnalysisError
from daq.plan import SweepPlan, spaced_frequencies
from sim.effects import parse_effect
from sim.response import simulate
from sim.unit import load_unit

PLAN = SweepPlan(spaced_frequencies(118.0, 160.0, 9), (2.0,), settle_cycles=10, integrate_cycles=6)
LEVELS = SweepPlan(PLAN.frequencies_hz, (1.5, 3.0), settle_cycles=3, integrate_cycles=3)


def unit(share):
    return load_unit("adss").with_tolerance({"default": share})


@pytest.fixture(scope="module")
def response():
    return simulate(load_unit("adss"), 0.3, LEVELS, seed=1)


def held(seen, low, high):
    return np.mean((seen > low) & (seen < high))


def test_band_holds_two_thirds_of_units():
    """20 units drawn by another way than the band's, ratio included; 9 readings of each."""
    share, rng = 0.04, np.random.default_rng(11)
    asked = unit(share)
    shares, held_gain, held_phase = asked.tolerances, [], []
    band = None
    for number in range(20):
        off = {s: v * (1.0 + shares[s] * rng.standard_normal())
               for s, v in asked.parameters.items() if shares.get(s)}  # fmt: skip
        seen = simulate(asked.with_parameters(**off), float(rng.random()), PLAN, seed=number)
        band = band or datasheet_band(seen, asked)
        (level,) = band.levels
        held_gain.append(held(seen.gain_db, level.gain_db[0], level.gain_db[2]))
        turns = (seen.phase_deg - level.phase_deg[1] + 180.0) % 360.0 - 180.0
        held_phase.append(held(turns, *(level.phase_deg[[0, 2]] - level.phase_deg[1])))
    # Readings of a unit depart together: by 20 units the share is known to 0.1.
    assert 0.5 < np.mean(held_gain) < 0.86
    assert 0.5 < np.mean(held_phase) < 0.86


def test_better_known_unit_has_narrower_band(response):
    width = {}
    for name, known, share in (
        ("nothing", None, 0.03),
        ("ratio", Known((0.3, 0.02)), 0.03),
        ("all", Known((0.3, 0.0)), 0.001),
    ):
        band = datasheet_band(response, unit(share), known, machines=16)
        assert [one.source_vpk for one in band.levels] == [1.5, 3.0]
        edges = np.stack([one.gain_db for one in band.levels])
        assert (np.diff(edges, axis=1) >= 0.0).all()
        width[name] = float(np.mean(edges[:, 2] - edges[:, 0]))
    assert width["all"] < 0.75 * width["ratio"]
    assert width["ratio"] < 0.95 * width["nothing"]


def test_band_words_say_assumptions(response):
    friction = parse_effect("load-coulomb-friction:T_f_L=0.02")
    known = Known((0.3, 0.02), effects=(friction,), words="by the estimate")
    band = datasheet_band(response, unit(0.03), known, machines=4)
    assert band.name == "datasheet + load-coulomb-friction, r 0.30 +- 0.02"
    assert "4 simulated units" in band.words
    assert "r = 0.300 +- 0.020 by the estimate" in band.words
    assert "r anywhere from 0 to 1" in datasheet_band(response, unit(0.03), machines=4).words


def test_one_stage_has_free_backlash():
    plan = SweepPlan((90.0, 100.0), (2.0,), settle_cycles=2, integrate_cycles=2)
    axis = load_unit("feed-axis")
    band = datasheet_band(simulate(axis, 1.0, plan), axis, machines=4)
    assert band.name == "datasheet"
    assert "b_t anywhere from 0.018 to 0.27 deg" in band.words


def test_band_repeats_and_progress_may_end_it(response):
    one, two = (datasheet_band(response, unit(0.03), machines=4) for _ in range(2))
    np.testing.assert_array_equal(one.levels[0].gain_db, two.levels[0].gain_db)

    class Enough(Exception):
        pass

    def stop(share):
        raise Enough

    with pytest.raises(Enough):
        datasheet_band(response, unit(0.03), machines=4, progress=stop)


def test_response_without_level_is_refused(response):
    from dataclasses import replace

    bare = replace(response, source_vpk=np.full(len(response), math.nan))
    with pytest.raises(AnalysisError):
        datasheet_band(bare, unit(0.03), machines=4)


def test_refuted_estimate_says_nothing_of_ratio():
    told = {"contribution_ratio": {"value": 0.31, "std": 0.05, "interval95": [0.2, 0.4]},
            "b_t_deg": {"value": 0.066, "std": 0.0}, "warnings": []}  # fmt: skip
    assert known_of_estimate(told).ratio == (0.31, 0.05)
    assert known_of_estimate(told).b_t_deg is None
    assert known_of_estimate(told | {"refuted": True}) == Known()
    assert known_of_estimate(None) == Known()
