"""Accelerometers and sensors of the motor's current, against the speed that they follow from."""

import numpy as np
import pytest
from worlds import drives

from analysis.resonance.extract import extract
from daq.configs import config_names
from daq.plan import SweepPlan
from sim.catalogue import CATALOGUE
from sim.datasheet import describe_chain, find_impossible, find_unusual
from sim.drivetrain import paper_drivetrain
from sim.effects import EffectSetting
from sim.response import simulate
from sim.unit import load_unit

HERTZ = np.array([20.0, 60.0, 100.0, 140.0, 200.0, 500.0])
S = 2j * np.pi * HERTZ


def shown(sensor, **electronics):
    """Linear response with a sensor, without filter but for a tachometer."""
    sections = {"sensor": sensor, "electronics": electronics}
    if sensor["kind"] != "tachometer":
        sections["filter"] = None
    return paper_drivetrain(drives.unit(sections, free=True), 0.5).system().transfer(HERTZ)


def speed(at):
    """Speed over input voltage, rad/s/V: the tachometer's voltage without its filter and gain."""
    read = shown({"kind": "tachometer", "at": at}, k_ts=1.0)
    return read * (S**2 + 1710.0 * S + 723439.0) / 723439.0


@pytest.mark.parametrize("at", ["motor", "load"])
def test_acceleration_is_derivative_of_speed_within_band(at):
    sensor = {"kind": "accelerometer", "at": at, "radius_m": 0.05, "low_pass_hz": 300.0,
              "high_pass_hz": 30.0}  # fmt: skip
    low, high = 2.0 * np.pi * 300.0, 2.0 * np.pi * 30.0
    expected = 0.0102 * 0.05 * S * speed(at) / (1.0 + S / low) * S / (S + high)
    np.testing.assert_allclose(shown(sensor, k_ts=0.0102), expected, rtol=1e-8)


def test_filter_alone_can_limit_the_band():
    sections = drives.DRIVES["accelerometer behind the filter"]
    read = paper_drivetrain(drives.unit(sections, free=True), 0.5).system().transfer(HERTZ)
    expected = 1e-4 * S * shown({"kind": "tachometer"}, k_ts=1.0)
    np.testing.assert_allclose(read, expected, rtol=1e-8)


def test_current_is_what_back_emf_leaves():
    """R_m i + L_a di/dt = k_a V - k_b w, behind the sensor's corner."""
    motor, k_a = load_unit("adss").motor, load_unit("adss").electronics.k_a
    sensor = {"kind": "current", "low_pass_hz": 400.0}
    current = (k_a - motor.k_b * speed("motor")) / (motor.R_m + motor.L_a * S)
    expected = 0.4 * current / (1.0 + S / (2.0 * np.pi * 400.0))
    np.testing.assert_allclose(shown(sensor, k_ts=0.4), expected, rtol=1e-8)


def test_features_of_acceleration_are_those_of_speed():
    """Also where backlash has moved them: a factor of s hardly moves a sharp extremum."""
    plan = SweepPlan(tuple(np.linspace(95.0, 175.0, 33)), (2.5,), settle_cycles=10,
                     integrate_cycles=10)  # fmt: skip
    found = []
    for name in ("accelerometer behind the filter", "command held"):
        sections = drives.DRIVES[name] if name.startswith("accel") else {}
        (level,) = extract(simulate(drives.unit(sections), 0.3, plan, seed=1))
        found.append((level.arf, level.rf))
    for one, other in zip(*found, strict=True):
        assert abs(one.frequency_hz - other.frequency_hz) < 3.0 * np.hypot(one.std_hz, other.std_hz)


@pytest.mark.parametrize("name", config_names("units"))
def test_units_without_them_are_stored_as_before(name):
    """Runs, posteriors and seeds of a unit follow from its physics: no new key may show there."""
    sensor = load_unit(name).physics.get("sensor")
    known = {"kind", "at", "reads", "counts", "sampled", "held", "delay_s"}
    assert sensor is None or set(sensor) == known


def test_gain_has_unit_of_its_sensor():
    (gain,) = CATALOGUE["tachometer-gain"].parameters
    named = {
        "accelerometer at the load": "V.s^2/m",
        "accelerometer sampled": "V.s^2/rad",
        "motor current": "V/A",
        "tachometer sampled": "V.s/rad",
        "encoder, position": "V/rad",
    }
    assert {name: gain.symbol_of(drives.unit(drives.DRIVES[name])) for name in named} == named


def test_sensor_effects_act_on_acceleration():
    sections = drives.DRIVES["accelerometer at the load"]
    unit, hertz = drives.unit(sections, free=True), (60.0, 140.0)
    plan = SweepPlan(hertz, (2.5,), settle_cycles=60)
    plain = simulate(unit, 0.5, plan).gain
    late = [EffectSetting("reading-delay", {"T_d": 3e-4})]
    turn = np.exp(-2j * np.pi * np.array(hertz) * 3e-4)
    np.testing.assert_allclose(
        simulate(unit, 0.5, plan, effects=late).gain, turn * plain, rtol=1e-6
    )
    lower = [EffectSetting("tachometer-gain", {"k_ts": 0.0051})]
    np.testing.assert_allclose(simulate(unit, 0.5, plan, effects=lower).gain, plain / 2, rtol=1e-6)


@pytest.mark.parametrize(
    ("name", "changed", "remedy"),
    [
        ("accelerometer at the load", {"k_ts": 100.0}, "if k_ts is in mV/g, give 0.0102"),
        ("accelerometer at the load", {"radius_m": 50.0}, "if radius_m is in mm, give 0.05"),
        ("accelerometer at the load", {"low_pass_hz": 2.0}, "sensor.low_pass_hz 2 Hz"),
        ("motor current", {"k_ts": 400.0}, "if k_ts is in mV/A, give 0.4"),
    ],
)
def test_catalogue_unit_explains_implausible_sensor_value(name, changed, remedy):
    unit = drives.unit(drives.DRIVES[name], "one-stage")
    assert not [*find_impossible(unit), *find_unusual(unit)]
    (said, *_) = find_unusual(unit.with_parameters(**changed))
    assert remedy in said
    assert "k_acc" not in said


def test_current_of_two_stages_is_warned_of():
    (said,) = find_unusual(drives.unit(drives.DRIVES["motor current"]))
    assert "read a speed or acceleration" in said


def test_chain_description_names_mounting_and_band():
    told = "\n".join(describe_chain(drives.unit(drives.DRIVES["accelerometer at the load"])))
    assert "accelerometer at the load" in told
    assert "at 0.05 m from the axis, from 0.5 Hz, up to 1000 Hz" in told
    told = "\n".join(describe_chain(drives.unit(drives.DRIVES["motor current"])))
    assert "current of the motor" in told
