"""The engine against an independent fine-step integration of the same equations."""

import numpy as np
import pytest
from oracle import rk4
from worlds.permutation import permutation_p
from worlds.side_by_side import (
    ADSS,
    EDSS,
    departure,
    drive,
    engine_gain,
    half_plays,
    oracle_gain,
    rows_of,
)

from sim.effects import drivetrain_with, parse_effect
from sim.engine import solving

# The last number is the oracle's step: dampers on tiny inertias make it unstable at 2 us.
LIGHT = (ADSS.with_parameters(b_t_deg=0.02), 0.25, {"c_s1": 0.02}, 2e-6)
LOSSY = (ADSS, 0.0, {"c_s1": 0.02, "c_g1": 0.2, "c_2": 2.0}, 2e-6)
SPLIT = (ADSS, 0.5, {"c_s1": 0.02, "c_g1": 0.2, "c_2": 2.0}, 1e-6)
ELEVATION = (EDSS.with_parameters(b_t_deg=0.06), 0.5, {"c_s1": 0.1, "c_g1": 0.2, "c_2": 5.0}, 1e-6)

DAMPERS = {"c_s1": "shaft-damping", "c_g1": "mesh1-damping", "c_2": "mesh2-damping"}


@pytest.mark.parametrize(
    ("case", "frequency_hz"),
    [(LIGHT, 60.0), (LIGHT, 130.0), (LOSSY, 110.0), (LOSSY, 180.0), (SPLIT, 110.0), (SPLIT, 150.0)]
    + [pytest.param(ELEVATION, 80.0, marks=pytest.mark.long)]
    + [(ELEVATION, f) for f in (60.0, 95.0)],
)
def test_periodic_motion_agrees_with_oracle(case, frequency_hz):
    unit, ratio, extras, step_s = case
    effects = [parse_effect(f"{DAMPERS[c]}:{c}={value}") for c, value in extras.items()]
    # Both from zeros: where several motions are stable, the start decides.
    expected = oracle_gain(unit, ratio, frequency_hz, 2.5, 160, 5, extras, step_s=step_s)[:, 1]
    assert np.ptp(np.abs(expected)) < 1e-3 * abs(expected[0])
    got = engine_gain(unit, ratio, frequency_hz, 2.5, 160, 5, effects)[:, 1]
    decibel, degree = departure(got.mean(), expected.mean())
    assert decibel < 0.02
    assert degree < 0.2


SETTLE, KEPT = 8, 16
ENGINE_RUNS, ORACLE_RUNS = 32, 8


def starts(unit, ratio, runs, rng):
    """Where the meshes lie at rest: deflections (runs, 2) anywhere inside their plays."""
    return rng.uniform(-1.0, 1.0, (runs, 2)) * half_plays(unit, ratio)


def engine_runs(unit, ratio, f, rng):
    system = drivetrain_with(unit, ratio).system()
    state = [
        rows_of(system, th_m=unit.stage1.N_1 * y1, th_L=-y2)
        for y1, y2 in starts(unit, ratio, ENGINE_RUNS, rng)
    ]
    kept, _ = drive(system, np.transpose(state), f, KEPT, amplitude=2.5, settle=SETTLE)
    return kept[:, 1].T / 2.5


def oracle_runs(unit, ratio, f, rng, step_s):
    runs = []
    for y1, y2 in starts(unit, ratio, ORACLE_RUNS, rng):
        state = np.zeros(len(rk4.STATES))
        state[rk4.STATES.index("th_m")] = unit.stage1.N_1 * y1
        state[rk4.STATES.index("th_L")] = -y2
        kept, _ = rk4.simulate_cycles(
            unit.parameters, *half_plays(unit, ratio), 2.5, f, SETTLE + KEPT, step_s, state
        )
        runs.append(kept[SETTLE:, 1])
    return np.array(runs)


BANDS = {
    "adss": (ADSS, 0.25, np.linspace(100.0, 165.0, 8)),
    "edss": (EDSS, 0.5, np.linspace(40.0, 117.0, 8)),
}


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", BANDS)
def test_undamped_units_scatter_as_the_oracle_does(name, seed):
    # Eight p-values below (two units, two seeds, mean and scatter), each at or below 1e-3
    # with probability 1e-3 if the engine is right: a false alarm in fewer than 1 of 125 draws.
    unit, ratio, band = BANDS[name]
    rng = np.random.default_rng(seed)
    groups = [
        (engine_runs(unit, ratio, f, rng), oracle_runs(unit, ratio, f, rng, 2e-6)) for f in band
    ]
    assert min(permutation_p(groups, rng)) > 1e-3


def test_distribution_comparison_detects_damped_scheme():
    # At 10 us the oracle damps the mesh modes numerically: another machine.
    unit, ratio, band = BANDS["edss"]
    rng = np.random.default_rng(3)
    groups = [
        (engine_runs(unit, ratio, f, rng), oracle_runs(unit, ratio, f, rng, 10e-6)) for f in band
    ]
    assert max(permutation_p(groups, rng)) <= 1e-3


@pytest.mark.parametrize("unit", [ADSS, EDSS], ids=["adss", "edss"])
@pytest.mark.parametrize("c_s1", [0.003, 0.02, 0.05])
def test_coupled_meshes_are_solved_until_they_agree(unit, c_s1, monkeypatch):
    effects = [parse_effect(f"shaft-damping:c_s1={c_s1}")]

    def moved():
        return engine_gain(unit, 0.5, 60.0, 2.5, 0, 1, effects, step_s=1e-5)

    as_it_is = moved()
    monkeypatch.setattr(solving, "_passes", lambda taken_over: 12)
    agreed = moved()
    monkeypatch.setattr(solving, "_passes", lambda taken_over: 1)
    # One pass leaves 8e-6 to 1e-3 of the gain, which is 0.5.
    assert abs(as_it_is - agreed).max() < 0.05 * abs(moved() - agreed).max()
