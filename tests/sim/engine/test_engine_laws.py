"""Every law of the engine against an answer known in closed form."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk
from worlds.side_by_side import drive, law_parameters, rows_of

from sim.elements import (
    Amplifier,
    ConstantTorque,
    Damper,
    DryFriction,
    HardeningSpring,
    Inertia,
    Mesh,
    Spring,
)
from sim.engine.system import Assembly, Law

J = 2e-5


def system_of(*elements):
    assembly = Assembly()
    Inertia("q", J).enter(assembly)
    for element in elements:
        element.enter(assembly)
    return assembly.build(output={"q": 1.0})


def at(system, state, *names):
    return [float(state[system.states.index(name), 0]) for name in names]


def bounce_period(k, d, v):
    """A mass between two springs that lie 2 d apart: flight, and half a swing in each spring."""
    return 4.0 * d / v + 2.0 * math.pi * math.sqrt(J / k)


def test_bounce_period_is_flight_plus_contact():
    k, d, v = 500.0, 1e-3, 0.8
    system = system_of(Mesh("m", {"q": 1.0}, k, d))
    period = bounce_period(k, d, v)
    _, state = drive(system, rows_of(system, q_rate=v), 1.0 / period, 10, step_s=1e-6)
    q, w = at(system, state, "q", "q'")
    assert w == pytest.approx(v, rel=1e-4)
    assert abs(q) < 1e-4 * 10 * 4 * d


def test_only_spring_acts_in_contact():
    """Inside the backlash nothing acts."""
    k, d = 500.0, 1e-3
    system = system_of(Mesh("m", {"q": 1.0}, k, d))
    time = 0.9e-3
    _, state = drive(system, rows_of(system, q=-0.5 * d, q_rate=1.5), 1.0 / time, 1)
    assert at(system, state, "q", "q'") == pytest.approx([0.85 * d, 1.5], rel=5e-3)
    omega = math.sqrt(k / J)
    time = 0.4 * math.pi / omega
    deep = d + 2e-4
    _, state = drive(system, rows_of(system, q=deep), 1.0 / time, 1)
    q, w = d + 2e-4 * math.cos(omega * time), -2e-4 * omega * math.sin(omega * time)
    assert at(system, state, "q", "q'") == pytest.approx([q, w], rel=1e-9)


@pytest.mark.parametrize("c", [0.01, 0.05, 0.15])
def test_damped_contact_returns_damped_half_swing_speed(c):
    k, d, v = 500.0, 1e-3, 0.8
    system = system_of(Mesh("m", {"q": 1.0}, k, d, c=c))
    omega = math.sqrt(k / J)
    zeta = c / (2.0 * J * omega)
    damped = omega * math.sqrt(1.0 - zeta**2)
    contact = math.pi / damped
    back = v * math.exp(-zeta * omega * contact)
    time = d / v + contact + 0.5 * d / back
    _, state = drive(system, rows_of(system, q_rate=v), 1.0 / time, 1, step_s=1e-6)
    q, w = at(system, state, "q", "q'")
    assert w == pytest.approx(-back, rel=2e-3)
    assert q == pytest.approx(0.5 * d, rel=1e-2)


def test_friction_stops_sliding_mass_and_holds_it():
    T, w0 = 0.014, 3.0
    system = system_of(DryFriction("f", "q", T))
    stop_time, distance = J * w0 / T, J * w0**2 / (2.0 * T)
    _, half = drive(system, rows_of(system, q_rate=w0), 2.0 / stop_time, 1)
    assert at(system, half, "q'") == pytest.approx([0.5 * w0], rel=1e-9)
    _, state = drive(system, rows_of(system, q_rate=w0), 1.0 / (1.37 * stop_time), 1)
    q, w = at(system, state, "q", "q'")
    assert q == pytest.approx(distance, rel=1e-5)
    assert abs(w) < 1e-12 * w0
    _, later = drive(system, state, 20.0, 20)
    assert abs(at(system, later, "q")[0] - q) < 1e-12 * q


@pytest.mark.parametrize("share", [-0.999, -0.5, 0.5, 0.999])
def test_torque_below_break_away_moves_nothing(share):
    T = 0.014
    system = system_of(DryFriction("f", "q", T), ConstantTorque("q", share * T))
    _, state = drive(system, rows_of(system), 50.0, 200)
    q, w = at(system, state, "q", "q'")
    free_fall = T / J * 4.0**2 / 2.0
    assert abs(q) < 1e-15 * free_fall
    assert abs(w) < 1e-12


@pytest.mark.parametrize("share", [-3.0, -1.01, 1.01, 3.0])
def test_above_break_away_the_surplus_accelerates(share):
    T = 0.014
    system = system_of(DryFriction("f", "q", T), ConstantTorque("q", share * T))
    _, state = drive(system, rows_of(system), 50.0, 5)
    surplus = (abs(share) - 1.0) * T * math.copysign(1.0, share)
    expected = [0.5 * surplus / J * 0.1**2, surplus / J * 0.1]
    assert at(system, state, "q", "q'") == pytest.approx(expected, rel=1e-9)


def test_friction_reverses_with_motion():
    T, push, w0 = 0.014, 0.05, -4.0
    system = system_of(DryFriction("f", "q", T), ConstantTorque("q", push))
    before = -w0 * J / (push + T)
    after = 1.3e-3
    _, state = drive(system, rows_of(system, q_rate=w0), 1.0 / (before + after), 1)
    w = (push - T) / J * after
    q = 0.5 * w0 * before + 0.5 * w * after
    assert at(system, state, "q'") == pytest.approx([w], rel=1e-6)
    assert at(system, state, "q") == pytest.approx([q], rel=1e-3)


def test_spring_releases_stuck_friction_at_break_away():
    k, T = 2.0, 0.014
    system = system_of(DryFriction("f", "q", T), Spring({"q": 1.0}, k))
    for stretch, moves in ((0.999 * T / k, False), (1.05 * T / k, True)):
        _, state = drive(system, rows_of(system, q=stretch), 40.0, 4)
        assert (at(system, state, "q")[0] != pytest.approx(stretch, rel=1e-9)) == moves


def test_stribeck_friction_follows_its_curve():
    T, T_s, w_s, push = 0.010, 0.008, 0.7, 0.025
    system = system_of(DryFriction("f", "q", T, T_s, w_s), ConstantTorque("q", push))

    def acceleration(t, w):
        return (push - T - T_s * np.exp(-((w / w_s) ** 2))) / J

    for time in (1e-3, 5e-3):
        exact = solve_ivp(acceleration, (0.0, time), [0.05], rtol=1e-10, atol=1e-12).y[0, -1]
        _, state = drive(system, rows_of(system, q_rate=0.05), 1.0 / time, 1)
        assert at(system, state, "q'") == pytest.approx([exact], rel=2e-3)


def test_stribeck_break_away_needs_the_peak():
    T, T_s, w_s = 0.010, 0.008, 0.05
    for push, moves in ((0.0179, False), (0.0181, True)):
        system = system_of(DryFriction("f", "q", T, T_s, w_s), ConstantTorque("q", push))
        _, state = drive(system, rows_of(system), 50.0, 5)
        assert (abs(at(system, state, "q'")[0]) > 1e-9) == moves


def bent_drive(laws, peak=8.0, f=100.0, rate=2.0 * math.pi * 300.0):
    """Harmonics of a sine of some peak that laws bend, before a low pass."""
    assembly = Assembly()
    assembly.add_signal("v")
    assembly.add_coupling("v", "v", -rate)
    assembly.add_input("v", 4.0 * rate)
    for number, (weight, *parameters) in enumerate(laws):
        assembly.add_law(
            f"law {number}", Law.EXCESS, {"v": weight * rate}, {},
            feedthrough=4.0, parameters=tuple(parameters),
        )  # fmt: skip
    kept, _ = drive(assembly.build(output={"v": 1.0}), [0.0], f, 1, amplitude=peak / 4.0, settle=10)
    return kept[0, :, 0] * (1.0 + 2j * math.pi * np.arange(kept.shape[1]) * f / rate)


def series(bend, peak=8.0):
    """Harmonics 0 to 3 of a bent sine, sine part and j times cosine part, from 2^16 samples."""
    v = peak * np.sin(2.0 * math.pi * np.arange(2**16) / 2**16)
    transform = np.fft.rfft([bend(one) for one in v])[:4] / 2**16
    return np.array([transform[0].real, *(2j * transform[1:])])


def test_clipping_gives_series_of_clipped_sine():
    got = bent_drive([(1.0, 3.0)])
    expected = series(lambda v: min(max(v, -3.0), 3.0))
    assert got == pytest.approx(expected, abs=2e-4)
    assert abs(got[0]) < 1e-6
    assert abs(got[2]) < 1e-6


AMPLIFIERS = {
    "clip": Amplifier(1.0, V_sat=3.0),
    "dead zone": Amplifier(1.0, V_d=1.5),
    "dead zone and clip": Amplifier(1.0, V_sat=3.0, V_d=1.5),
    "uneven": Amplifier(1.0, uneven=1.4),
    "weak half": Amplifier(1.0, uneven=0.6),
    "uneven, dead zone": Amplifier(1.0, V_d=1.5, uneven=1.4),
    "uneven, clip": Amplifier(1.0, V_sat=3.0, uneven=1.4),
    "uneven, dead zone, clip": Amplifier(1.0, V_sat=3.0, V_d=1.5, uneven=0.6),
}


@pytest.mark.parametrize("name", AMPLIFIERS)
def test_amplifier_characteristic_distorts_sine_as_given(name):
    """Dead about zero, then more one way than the other, then cut off: in that order."""
    amplifier = AMPLIFIERS[name]
    clip = math.inf if amplifier.V_sat is None else amplifier.V_sat

    def bend(v):
        beyond = max(v - amplifier.V_d, 0.0) + min(v + amplifier.V_d, 0.0)
        return min(max(beyond * (amplifier.uneven if beyond > 0.0 else 1.0), -clip), clip)

    laws = [parts[1:] for parts in amplifier.kinks()]
    if amplifier.V_d > 0.0:
        # The motor takes what is linear away; a law that lets everything through does so here.
        laws.append((1.0, 0.0, 0.0))
    assert bent_drive(laws) == pytest.approx(series(bend), abs=5e-4)


def test_cubic_spring_has_duffing_period():
    k, h, amplitude = 100.0, 2000.0, 0.03
    system = system_of(Spring({"q": 1.0}, k), HardeningSpring("h", {"q": 1.0}, k, h))
    # x'' = -w^2 (x + h x^3) from rest at a: period 4 K(m) / (w sqrt(1 + h a^2)).
    stiffening = h * amplitude**2
    m = 0.5 * stiffening / (1.0 + stiffening)
    period = 4.0 * ellipk(m) / math.sqrt(k / J * (1.0 + stiffening))
    _, state = drive(system, rows_of(system, q=amplitude), 1.0 / period, 20, step_s=2e-6)
    q, w = at(system, state, "q", "q'")
    assert q == pytest.approx(amplitude, rel=1e-4)
    assert abs(w) < 2e-2 * amplitude * math.sqrt(k / J)


@pytest.mark.parametrize("tinies", [1, 2])
def test_hardening_springs_follow_equations_across_tiny_inertias(tinies):
    # As in the middle of a hardening shaft: a force on a tiny inertia moves both its springs.
    k, h, tiny = 100.0, 2000.0, J / 500.0
    names = ["q", "m", "n"][: tinies + 1]
    inertias = np.array([J, *[tiny] * tinies])
    assembly = Assembly()
    for name, inertia in zip(names, inertias, strict=True):
        Inertia(name, float(inertia)).enter(assembly)
    for name, beyond in zip(names, [*names[1:], None], strict=True):
        along = {name: 1.0} if beyond is None else {name: 1.0, beyond: -1.0}
        Spring(along, k).enter(assembly)
        HardeningSpring(name, along, k, h).enter(assembly)
    system = assembly.build(output={"q": 1.0})

    def rates(t, x):
        twist = x[: len(names)] - np.append(x[1 : len(names)], 0.0)
        torque = k * twist * (1.0 + h * twist**2)
        return [*x[len(names) :], *((np.append(0.0, torque[:-1]) - torque) / inertias)]

    time, start = 3e-3, 0.03 * np.arange(len(names), 0, -1)
    exact = solve_ivp(
        rates, (0.0, time), [*start, *(0.0 * start)], method="DOP853", rtol=1e-11, atol=1e-13
    ).y[: len(names), -1]
    errors = []
    for step_s in (2e-6, 1e-6):
        begin = rows_of(system, **dict(zip(names, start, strict=True)))
        _, state = drive(system, begin, 1.0 / time, 1, step_s=step_s)
        errors.append(np.max(np.abs(at(system, state, *names) - exact) / start))
    assert errors[1] < 1e-3
    assert errors[0] > 3.0 * errors[1]


def test_viscous_damping_decays_exactly():
    c = 4e-4
    system = system_of(Damper({"q": 1.0}, c))
    _, state = drive(system, rows_of(system, q_rate=5.0), 20.0, 1)
    assert at(system, state, "q'") == pytest.approx([5.0 * math.exp(-c / J * 0.05)], rel=1e-12)


def test_each_lane_follows_its_own_parameters():
    system = system_of(DryFriction("f", "q", 0.014))
    torques = np.array([0.001, 0.014, 0.1])
    parameters = law_parameters(system, 3)
    parameters[0, 0] = torques
    start = np.repeat(rows_of(system, q_rate=3.0)[:, None], 3, axis=1)
    time = 1e-4
    _, state = drive(system, start, 1.0 / time, 1, parameters=parameters)
    expected = 3.0 - torques / J * time
    assert state[system.states.index("q'")] == pytest.approx(expected, rel=1e-9)


def bounce_errors(step_s):
    """Where bouncing masses of many speeds are after a whole number of periods each."""
    k, d = 500.0, 1e-3
    system = system_of(Mesh("m", {"q": 1.0}, k, d))
    errors = []
    for v in np.linspace(0.4, 1.2, 24):
        frequency = 1.0 / bounce_period(k, d, v)
        _, state = drive(system, rows_of(system, q_rate=v), frequency, 2, step_s=step_s)
        errors.append(at(system, state, "q")[0] / d)
    return np.sqrt(np.mean(np.square(errors)))


def test_backlash_error_falls_with_step_squared():
    errors = np.array([bounce_errors(step) for step in (16e-6, 8e-6, 4e-6, 2e-6)])
    orders = np.log2(errors[:-1] / errors[1:])
    assert orders.mean() > 1.8
    assert errors[1] < 5e-3
