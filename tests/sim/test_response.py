"""From a plan to a frequency response: order, starts, error bars, flags, and the same bits."""

import numpy as np
import pytest
from worlds.side_by_side import ADSS, EDSS, oracle_gain

from daq.errors import AnalysisError, ConfigurationError
from daq.frf import DB_PER_NEPER, PointFlag
from daq.plan import SweepPlan
from sim.effects import drivetrain_with, parse_effect
from sim.elements import Damper
from sim.response import (
    PERIODIC_SCATTER,
    START_SPREAD,
    Servo,
    SteppedServo,
    response_of_cycles,
    scatter_of_cycles,
    simulate,
    simulate_cycles,
)

BAND = (100.0, 120.0, 140.0)
PLAN = SweepPlan(BAND, (2.5,), settle_cycles=4, integrate_cycles=6)
DAMPED = [
    parse_effect(text)
    for text in ("shaft-damping:c_s1=0.02", "mesh1-damping:c_g1=0.8", "mesh2-damping:c_2=2")
]


def plan_with(**changes):
    fields = ("frequencies_hz", "levels_vpk", "direction", "settle_cycles", "integrate_cycles",
              "from_rest", "dc_offset_v")  # fmt: skip
    return SweepPlan(**({name: getattr(PLAN, name) for name in fields} | changes))


def dwells(plan, seed, level, rest):
    """The same sweep by hand, dwell by dwell, as an analyser would make it."""
    servo = SteppedServo(ADSS, 0.25, seed=seed)
    found = {}
    for f in plan.visited_hz:
        if rest:
            servo.rest()
        record = servo.dwell(f, level, plan.dc_offset_v, plan.settle_cycles, plan.integrate_cycles)
        found[f] = record.output_cycles / level
    return np.array([found[f] for f in sorted(found)])


@pytest.mark.parametrize("direction", ["up", "down"])
@pytest.mark.parametrize("from_rest", [False, True])
@pytest.mark.parametrize("offset", [0.0, 0.3])
def test_sweep_is_its_dwells_in_sequence(direction, from_rest, offset):
    plan = plan_with(direction=direction, from_rest=from_rest, dc_offset_v=offset)
    (cycles,) = simulate_cycles([Servo.of(ADSS, 0.25, seed=7)], plan)
    assert cycles.shape == (1, 3, 6, 4)
    assert np.array_equal(cycles[0], dwells(plan, 7, 2.5, from_rest))


def test_direction_and_rest_matter_rows_stay_ascending():
    kinds = [
        plan_with(),
        plan_with(direction="down"),
        plan_with(from_rest=True),
    ]
    responses = [simulate(ADSS, 0.25, plan) for plan in kinds]
    for response, plan in zip(responses, kinds, strict=True):
        assert list(response.frequency_hz) == list(BAND)
        assert response.direction == plan.direction
        assert response.from_rest == plan.from_rest
        assert (response.settle_cycles, response.integrate_cycles) == (4, 6)
    up, down, rest = (response.gain for response in responses)
    assert up[0] == rest[0]
    assert np.all(up[1:] != rest[1:])
    assert np.all(up != down)


def test_levels_keep_order_and_start_anew():
    both = simulate(ADSS, 0.25, plan_with(levels_vpk=(2.5, 1.0)))
    assert list(both.source_vpk) == [2.5] * 3 + [1.0] * 3
    assert list(both.frequency_hz) == list(BAND) * 2
    alone = simulate(ADSS, 0.25, plan_with(levels_vpk=(2.5,)))
    assert np.array_equal(both.gain[:3], alone.gain)
    assert not np.allclose(both.gain[3:], alone.gain, rtol=1e-2)


@pytest.mark.parametrize("seed", [0, 1, 12345])
def test_seed_reproduces_bits_and_others_differ(seed):
    first, again, other = (simulate(EDSS, 0.5, PLAN, seed=s) for s in (seed, seed, seed + 1))
    assert np.array_equal(first.gain, again.gain)
    assert np.array_equal(first.gain_std_db, again.gain_std_db)
    assert np.all(first.gain != other.gain)
    assert first.provenance["seed"] == seed


def crowd():
    """Forty servos of five kinds: plays and frictions vary, one kind is another machine."""
    for i in range(40):
        if i % 10 == 3:
            yield Servo.of(EDSS, 0.5, seed=i)
        elif i % 10 == 6:
            yield Servo.of(ADSS, 0.5, [parse_effect("load-inertia:J_L=0.002")], seed=i)
        elif i % 10 == 8:
            yield Servo.of(ADSS, i / 40.0, [parse_effect("shaft-hardening:h=3e4")], seed=i)
        else:
            unit = ADSS.with_parameters(T_f_m=0.01 + 1e-4 * i, b_t_deg=0.05 + 1e-3 * i)
            yield Servo.of(unit, i / 40.0, seed=i)


@pytest.mark.parametrize("workers", [1, 2])
def test_common_run_is_bit_equal(workers):
    plan = plan_with(frequencies_hz=(118.0, 131.0), levels_vpk=(2.5, 1.2), integrate_cycles=3)
    servos = list(crowd())
    together = simulate_cycles(servos, plan, workers=workers)
    for i in (0, 3, 6, 17, 28, 39):
        (alone,) = simulate_cycles([servos[i]], plan)
        assert np.array_equal(together[i], alone), i


@pytest.mark.parametrize("from_rest", [False, True])
def test_no_servos_give_no_response(from_rest):
    assert simulate_cycles([], plan_with(from_rest=from_rest)) == []


@pytest.mark.parametrize("direction", ["up", "down"])
def test_from_rest_points_ignore_worker_count(direction):
    plan = plan_with(
        frequencies_hz=(118.0, 125.0, 131.0, 140.0, 155.0), levels_vpk=(2.5, 1.2),
        integrate_cycles=2, from_rest=True, direction=direction,
    )  # fmt: skip
    servos = [Servo.of(ADSS, ratio, seed=i) for i, ratio in enumerate((0.1, 0.5, 0.8))]
    one = simulate_cycles(servos, plan, workers=1)
    for workers in (2, 3, 9):
        np.testing.assert_array_equal(simulate_cycles(servos, plan, workers=workers), one)
    point = plan_with(
        frequencies_hz=(131.0,), levels_vpk=(2.5, 1.2), integrate_cycles=2, from_rest=True
    )
    (alone,) = simulate_cycles(servos[1:2], point)
    np.testing.assert_array_equal(one[1][:, 2:3], alone)


def test_response_matches_oracle_from_settled_motion():
    unit = ADSS.with_parameters(b_t_deg=0.02)
    plan = plan_with(frequencies_hz=(60.0,), settle_cycles=150, integrate_cycles=5)
    bias = parse_effect("load-torque-bias:T_b=0.2")
    response = simulate(unit, 0.25, plan, effects=[*DAMPED, bias])
    extras = {"c_s1": 0.02, "c_g1": 0.8, "c_2": 2.0, "T_b": 0.2}
    expected = oracle_gain(unit, 0.25, 60.0, 2.5, 150, 5, extras, step_s=1e-6).mean(axis=0)
    assert response.gain[0] == pytest.approx(expected[1], rel=1e-3)
    assert response.harmonic2[0] == pytest.approx(expected[2], abs=1e-3 * abs(expected[1]))
    assert response.harmonic3[0] == pytest.approx(expected[3], abs=1e-3 * abs(expected[1]))
    assert abs(response.harmonic2[0]) > 5e-3
    assert response.dc_v[0] == pytest.approx(2.5 * expected[0].real, abs=1e-3)
    assert response.flags[0] == 0
    assert response.gain_std_db[0] < 1e-3


def test_source_offset_turns_motor_steadily():
    quiet = ADSS.with_parameters(T_f_m=0.0, T_f_L=0.0)
    plan = plan_with(frequencies_hz=(100.0,), settle_cycles=150, dc_offset_v=0.5)
    response = simulate(quiet, 0.0, plan, effects=DAMPED)
    p = quiet.parameters
    speed = p["k_a"] * 0.5 * p["k_t"] / (p["k_t"] * p["k_b"] + p["R_m"] * p["B_m"])
    assert response.dc_v[0] == pytest.approx(p["k_ts"] * speed, rel=1e-2)


def test_mean_and_errors_of_cycles_by_hand():
    # Mean 2j; departures of 0.3 along it and 0.6 across it.
    mean, along, across, worst = scatter_of_cycles(np.array([2.3j, -0.6 + 1.7j, 0.6 + 2.0j]))
    assert mean == pytest.approx(2j)
    assert along == pytest.approx(np.std([0.3, -0.3, 0.0], ddof=1) / np.sqrt(3.0))
    assert across == pytest.approx(np.std([0.0, 0.6, -0.6], ddof=1) / np.sqrt(3.0))
    assert worst == pytest.approx(np.hypot(0.6, 0.3) / 2.0)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_standard_errors_match_scatter_of_means(seed):
    # 4000 points of 12 cycles: the scatter of the means is known within 1.1 % (one sigma), the
    # bound is 5 %; a false alarm is a matter of 1e-5.
    rng = np.random.default_rng(seed)
    true, turn = 0.8 * np.exp(0.7j), np.exp(0.7j)
    noise = 0.02 * rng.standard_normal((4000, 12)) + 0.05j * rng.standard_normal((4000, 12))
    mean, along, across, _ = scatter_of_cycles(true + turn * noise)
    scatter = (mean - true) / turn
    assert np.sqrt(np.mean(along**2)) == pytest.approx(scatter.real.std(), rel=0.05)
    assert np.sqrt(np.mean(across**2)) == pytest.approx(scatter.imag.std(), rel=0.05)


def synthetic(cycles):
    """A response from per-cycle gains, (points, cycles), with no other harmonics."""
    whole = np.zeros((1, *np.shape(cycles), 4), dtype=complex)
    whole[0, ..., 1] = cycles
    points = np.shape(cycles)[0]
    plan = plan_with(
        frequencies_hz=tuple(100.0 + np.arange(points)), integrate_cycles=np.shape(cycles)[1]
    )
    return response_of_cycles(whole, plan, "x", {"kind": "simulated"})


def test_standard_errors_are_decibel_and_degree():
    response = synthetic([[0.5 + 0.01j, 0.5 - 0.01j, 0.52, 0.48]])
    assert response.gain[0] == pytest.approx(0.5)
    along = np.std([0.0, 0.0, 0.02, -0.02], ddof=1) / 2.0
    across = np.std([0.01, -0.01, 0.0, 0.0], ddof=1) / 2.0
    assert response.gain_std_db[0] == pytest.approx(DB_PER_NEPER * along / 0.5)
    assert response.phase_std_deg[0] == pytest.approx(np.degrees(across / 0.5))


def test_point_that_does_not_repeat_is_flagged():
    small, large = 0.9 * PERIODIC_SCATTER, 1.1 * PERIODIC_SCATTER
    response = synthetic([[1.0 + small, 1.0 - small], [1.0 + large, 1.0 - large]])
    assert list(response.flags) == [0, int(PointFlag.NOT_PERIODIC)]


def test_a_single_cycle_has_no_error_bar():
    response = synthetic([[0.5]])
    assert np.isnan(response.gain_std_db[0])
    assert np.isnan(response.phase_std_deg[0])
    assert response.flags[0] == 0


def test_undamped_backlash_is_flagged_linear_servo_not():
    rough = simulate(ADSS, 0.5, plan_with(frequencies_hz=(133.0,), settle_cycles=20))
    assert rough.flags[0] & PointFlag.NOT_PERIODIC
    assert rough.gain_std_db[0] > 0.01
    smooth_plan = plan_with(frequencies_hz=(100.0,), settle_cycles=60)
    smooth = simulate(ADSS.with_parameters(b_t_deg=0.0), 0.5, smooth_plan, effects=DAMPED)
    assert smooth.flags[0] == 0


def test_start_lies_inside_backlash_by_seed():
    # So weak a drive that friction holds the motor: the meshes stay where they start.
    places = []
    for seed in range(20):
        servo = SteppedServo(ADSS, 0.25, seed=seed)
        record = servo.dwell(100.0, 0.05, settle_cycles=1, integrate_cycles=1)
        assert np.abs(record.output_cycles).max() < 1e-6
        meshes = Servo.of(ADSS, 0.25).system.nonlinearities[:2]
        places.append([mesh.outlet @ servo._state[:, 0] / mesh.parameters[0] for mesh in meshes])
    places = np.array(places) / START_SPREAD
    assert np.abs(places).max() <= 1.0 + 1e-2
    # Twenty uniform draws all lie within half their range with probability 2e-5.
    assert np.ptp(places, axis=0).min() > 1.0


def test_unbounded_motion_is_an_error():
    engine = drivetrain_with(ADSS, 0.25).adding(drive=Damper({"th_L": 1.0}, -100.0))
    with pytest.raises(AnalysisError, match=r"100 Hz.*without bound"):
        simulate_cycles([Servo(engine.system())], plan_with(settle_cycles=50))


def test_dwell_records_both_inputs():
    servo = SteppedServo(ADSS, 0.25, DAMPED)
    record = servo.dwell(120.0, 2.0, 0.25, settle_cycles=60, integrate_cycles=3)
    assert np.array_equal(record.source_cycles, np.full(3, 2.0 + 0j))
    assert record.source_peak_v == 2.25
    largest = np.abs(record.output_cycles[0]).sum()
    first = abs(record.output_cycles[0, 1])
    assert first < record.output_peak_v < 1.1 * largest


def test_provenance_suffices_to_repeat_simulation():
    effect = parse_effect("load-viscous-damping:B_L=0.05")
    response = simulate(ADSS, 0.25, PLAN, effects=[effect], seed=3)
    told = response.provenance
    assert told["kind"] == "simulated"
    assert told["contribution_ratio"] == 0.25
    assert told["effects"] == [{"id": "load-viscous-damping", "B_L": 0.05}]
    assert told["parameters"]["k_s1"] == 22.8
    assert response.unit == "ADSS"


def test_ratio_outside_0_to_1_is_refused():
    with pytest.raises(ConfigurationError, match="outside 0 to 1"):
        simulate(ADSS, 1.5, PLAN)


def test_only_servos_that_need_shorten_the_step():
    plan = SweepPlan((40.0, 60.0, 80.0), (4.0,), settle_cycles=2, integrate_cycles=3)
    hard = [parse_effect("shaft-hardening:h=2e7")]
    servos = [Servo.of(EDSS, 0.3), Servo.of(EDSS, 0.6, hard), Servo.of(EDSS, 0.6)]
    shorter = {"longest_step_s": 1e-5, "shorter_steps_s": (5e-6, 1.25e-6)}
    tried = simulate_cycles(servos, plan, **shorter)
    # The plain ones move as with the first step alone, and by another not quite.
    for i in (0, 2):
        (long,) = simulate_cycles([servos[i]], plan, longest_step_s=1e-5)
        (short,) = simulate_cycles([servos[i]], plan, longest_step_s=5e-6)
        np.testing.assert_allclose(tried[i], long, rtol=1e-9)
        assert np.abs(short - long).max() > 1e-9
    (alone,) = simulate_cycles([servos[1]], plan, **shorter)
    np.testing.assert_allclose(tried[1], alone, rtol=1e-9)
    with pytest.raises(AnalysisError, match="without bound"):
        simulate_cycles(servos, plan, longest_step_s=1e-5)


@pytest.mark.parametrize("from_rest", [False, True])
def test_every_point_is_reported_once(from_rest):
    plan = SweepPlan((200.0, 210.0, 220.0, 230.0), (1.5, 2.5), settle_cycles=1,
                     integrate_cycles=2, from_rest=from_rest)  # fmt: skip
    told = []
    simulate(ADSS, 0.5, plan, progress=told.append)
    assert sorted(told) == [0.25, 0.5, 0.75, 1.0]
