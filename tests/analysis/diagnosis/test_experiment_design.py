import shlex
from types import SimpleNamespace

import numpy as np
import pytest
from worlds.synthetic import ADSS, LEVELS, candidate, observation, read

from analysis.diagnosis.experiment_design import (
    NextMeasurement,
    propose_measurement,
    separations,
)
from analysis.inference.run_design import runs_along_ridge
from daq.plan import SweepPlan

SEEN = observation(read(("load-inertia",), np.array([0.5, 0.5]), np.random.default_rng(0)))
FIRST, SECOND = (candidate(SEEN, (e,)) for e in ("load-inertia", "shaft-stiffness"))


def proposed(judge, rivals=(SECOND,)):
    tried = []

    def counted(unit, groups, plan, noise_v, rng, executor):
        tried.append(plan)
        assert len(groups) == 1 + len(rivals)
        sigma = judge(plan)
        return sigma if isinstance(sigma, list) else [sigma]

    return propose_measurement(ADSS, FIRST, rivals, SEEN, separate=counted), tried


def test_proposed_plans_vary_within_the_limits():
    _, tried = proposed(lambda plan: 1.0)
    for plan in tried:
        assert plan.levels_vpk[0] + abs(plan.dc_offset_v) <= ADSS.limits.source_vpk
        assert plan.frequencies_hz[0] >= ADSS.limits.start_hz
        assert plan.frequencies_hz[-1] <= ADSS.limits.stop_hz
    assert {plan.direction for plan in tried} == {"up", "down"}
    assert any(plan.dc_offset_v for plan in tried)
    assert min(plan.levels_vpk[0] for plan in tried) < LEVELS[0]
    assert max(plan.levels_vpk[0] for plan in tried) > LEVELS[-1]


@pytest.mark.parametrize(
    ("band_hz", "levels_vpk", "plans"),
    [
        ((40.0, 200.0), (12.0, 12.0), 3),  # The lowest level is over twice the limit.
        ((120.0, 120.0), (1.0, 4.0), 6),  # One frequency: only a wider band has any.
        ((450.0, 700.0), (1.0, 4.0), 10),
        ((2.0, 6.0), (1.0, 4.0), 0),
        ((900.0, 1000.0), (1.0, 4.0), 0),
    ],
)
def test_measurement_beyond_limits_gets_plan_within(band_hz, levels_vpk, plans):
    beyond = SimpleNamespace(
        frequency_hz=np.array(band_hz), source_vpk=np.array(levels_vpk),
        plans=SEEN.plans, noise_v=SEEN.noise_v,
    )  # fmt: skip
    tried = []
    found = propose_measurement(
        ADSS, FIRST, [SECOND], beyond,
        separate=lambda unit, groups, plan, *_: tried.append(plan) or [1.0],
    )  # fmt: skip
    assert len(tried) == plans
    assert (found is None) == (plans == 0)
    for plan in tried:
        assert plan.levels_vpk[0] + abs(plan.dc_offset_v) <= ADSS.limits.source_vpk
        assert plan.frequencies_hz[0] >= ADSS.limits.start_hz
        assert plan.frequencies_hz[-1] <= ADSS.limits.stop_hz


def test_most_separating_plan_is_proposed():
    found, _ = proposed(lambda plan: 5.0 if plan.dc_offset_v else 1.0)
    assert found.plan.dc_offset_v > 0.0
    assert found.expected_sigma == 5.0
    assert found.separates == ("load-inertia", "shaft-stiffness")


def test_cheaper_plan_of_similar_power_is_preferred():
    found, tried = proposed(lambda plan: 4.0 - 1e-3 * plan.duration_s)
    assert found.plan.duration_s == min(plan.duration_s for plan in tried)


THIRD = candidate(SEEN, ("amplifier-gain",))


@pytest.mark.parametrize(
    ("offset", "down", "separates", "sigma", "other", "takes_offset"),
    [
        # The rival that is hardest to tell decides ...
        ([9.0, 2.5], [4.0, 5.0], "shaft-stiffness", 4.0, 5.0, False),
        ([9.0, 4.5], [4.0, 5.0], "amplifier-gain", 4.5, 9.0, True),
        # ... if any sweep tells it, ...
        ([9.0, 1.9], [4.0, 1.0], "shaft-stiffness", 9.0, 1.9, True),
        ([1.0, 3.0], [1.5, 2.5], "amplifier-gain", 3.0, 1.0, True),
        # ... and where none tells any the one that comes nearest.
        ([1.0, 1.9], [1.5, 0.5], "amplifier-gain", 1.9, 1.0, True),
    ],
)
def test_least_separated_rival_decides_the_plan(
    monkeypatch, offset, down, separates, sigma, other, takes_offset
):
    def judge(plan):
        if plan.dc_offset_v:
            return offset
        return down if plan.direction == "down" else [0.5, 0.5]

    found, _ = proposed(judge, (SECOND, THIRD))
    assert bool(found.plan.dc_offset_v) == takes_offset
    assert found.separates == ("load-inertia", separates)
    assert found.expected_sigma == sigma
    ((name, by),) = found.others
    assert {name, separates} == {"shaft-stiffness", "amplifier-gain"}
    assert by == other
    assert found.to_json()["others"] == [
        {"separates": ["load-inertia", name], "expected_sigma": other}
    ]


@pytest.mark.parametrize("offset", [0.0, 0.5])
def test_measure_accepts_the_printed_plan(offset):
    from tui.cli import build_app

    plan = SweepPlan(tuple(np.linspace(80.0, 200.0, 31)), (0.75,), "down", dc_offset_v=offset)
    words = NextMeasurement("ADSS", plan, ("a", "b"), 3.0).command.split()
    assert words.pop(0) == "lashbench"
    words[words.index("URL")] = "sim:"
    _, bound, _ = build_app().parse_args(words, exit_on_error=False, print_error=False)
    given = bound.arguments
    assert (given["level"], given["start"], given["stop"], given["points"]) == ([0.75], 80, 200, 31)
    assert given["direction"] == "down"
    assert given.get("offset", 0.0) == offset


@pytest.mark.parametrize(
    ("unit", "given"),
    [("EDSS", "edss"), ("My Gimbal", "My Gimbal"), ("my units/it's.toml", "my units/it's.toml")],
)
def test_printed_unit_is_quoted_for_shell(unit, given):
    plan = SweepPlan(tuple(np.linspace(80.0, 200.0, 31)), (0.75,))
    words = shlex.split(NextMeasurement(unit, plan, ("a", "b"), 3.0).command)
    assert words[words.index("--unit") + 1] == given
    assert words[words.index("--unit") + 2] == "--instrument"


def test_simulation_separates_different_models():
    groups = [list(runs_along_ridge(c, 4, np.random.default_rng(0))) for c in (FIRST, SECOND)]
    plan = SweepPlan(
        tuple(np.linspace(110.0, 150.0, 4)), (2.0,), settle_cycles=3, integrate_cycles=4
    )

    def apart(*of):
        return separations(ADSS, [groups[i] for i in of], plan, 5e-4, np.random.default_rng(0))

    assert apart(0, 0) == [0.0]
    (one,) = apart(0, 1)
    assert 0.5 < one < 50.0
    # Others are told from the first, whoever else is.
    assert apart(0, 0, 0) == [0.0, 0.0]


def test_all_plans_are_judged_by_same_machines():
    """Or plans would differ by the machines that were drawn for them."""
    asked = []

    def noted(unit, groups, plan, noise_v, rng, executor):
        machines = [[(g.ratios.tolist(), g.sizes.tolist()) for g in of_one] for of_one in groups]
        asked.append((machines, rng.uniform()))
        return [1.0]

    propose_measurement(ADSS, FIRST, [SECOND], SEEN, separate=noted)
    assert len(asked) > 5
    assert all(one == asked[0] for one in asked)
