"""Drives that are not the paper's: engine, linear response and an independent plant agree."""

import numpy as np
import pytest
from oracle import drive_plant
from worlds import drives

from daq.plan import SweepPlan
from sim.drivetrain import paper_drivetrain
from sim.effects import EffectSetting, drivetrain_with
from sim.response import Servo, SteppedServo, simulate, simulate_cycles

LINEAR_HZ = (60.0, 100.0, 140.0, 200.0)
PLAYED_HZ = (97.0, 211.0)


def plan(hertz, **more):
    return SweepPlan(tuple(hertz), (2.5,), **more)


@pytest.mark.parametrize("name", drives.DRIVES)
def test_drive_without_backlash_has_linear_response(name):
    sections = drives.finely(drives.DRIVES[name])
    unit = drives.unit(sections, free=True)
    shown = simulate(unit, 0.5, plan(LINEAR_HZ, settle_cycles=120, integrate_cycles=60)).gain
    expected = paper_drivetrain(unit, 0.5).system().transfer(np.array(LINEAR_HZ))
    np.testing.assert_allclose(shown, expected, rtol=2e-3, atol=2e-3 * np.abs(expected).max())


@pytest.mark.parametrize("name", drives.DRIVES)
def test_drive_with_backlash_matches_independent_plant(name):
    """Sampling, counts, clips, play and friction: nothing is linearised on either side."""
    sections, seeds = drives.DRIVES[name], range(4)
    unit, document = drives.unit(sections), drives.document(sections)
    hertz = PLAYED_HZ[:1] if name == "encoder at the load" else PLAYED_HZ
    swept = plan(hertz, settle_cycles=12, integrate_cycles=14)
    ours = np.array([simulate(unit, 0.3, swept, seed=seed).gain for seed in seeds])
    theirs = np.array(
        [drive_plant.sweep(document, 0.3, hertz, 2.5, 12, 14, seed=s).mean(axis=1) for s in seeds]
    )
    off = ours.mean(axis=0) / theirs.mean(axis=0) - 1.0
    scatter = np.hypot(ours.std(axis=0), theirs.std(axis=0)) / np.abs(ours.mean(axis=0)) / 2.0
    # An independent integrator is off by its numerical damping; the start is another one. The
    # scatter of four seeds is uncertain: by Student's t one comparison in 660 is farther off than
    # 5.5 of it. Chaos makes each processor a draw of its own.
    assert np.all(np.abs(off) < 5.5 * scatter + 0.03), (off, scatter)


def test_held_command_is_late_by_half_sample():
    """A zero-order hold at 2 kHz: sinc, and a delay of 0.25 ms."""
    hertz = np.array(LINEAR_HZ)
    held = paper_drivetrain(drives.unit({"sampling": drives.SAMPLED}), 0.5).system()
    plain = paper_drivetrain(drives.unit({}), 0.5).system()
    expected = np.sinc(hertz / 2000.0) * np.exp(-1j * np.pi * hertz / 2000.0)
    np.testing.assert_allclose(held.transfer(hertz) / plain.transfer(hertz), expected, rtol=1e-9)


def test_stated_delay_turns_phase_with_frequency():
    late = {"kind": "tachometer", "delay_s": 1e-3}
    unit, hertz = drives.unit({"sensor": late}, free=True), np.array(LINEAR_HZ)
    shown = simulate(unit, 0.5, plan(LINEAR_HZ)).gain
    plain = simulate(drives.unit({}, free=True), 0.5, plan(LINEAR_HZ)).gain
    np.testing.assert_allclose(shown, plain * np.exp(-2j * np.pi * hertz * 1e-3), rtol=1e-9)


@pytest.mark.parametrize("counts", [64, 256])
def test_few_counts_scatter_from_cycle_to_cycle(counts):
    """The noise of counting is in the readings, and grows as the counts get coarser."""
    sections = drives.DRIVES["encoder, speed"]
    coarse = sections | {"sensor": sections["sensor"] | {"counts": float(counts)}}
    fine = sections | {"sensor": sections["sensor"] | {"counts": drives.FINE}}
    hertz = plan((63.0,), settle_cycles=60)
    noise = [
        simulate(drives.unit(one, free=True), 0.5, hertz).gain_std_db[0] for one in (coarse, fine)
    ]
    assert noise[0] > 5.0 * noise[1]


def test_sampled_lanes_do_not_depend_on_neighbours():
    unit = drives.unit(drives.DRIVES["encoder, speed"])
    servos = [Servo.of(unit, ratio, seed=i) for i, ratio in enumerate((0.2, 0.5, 0.8, 0.3, 0.6))]
    other = Servo.of(drives.unit(drives.DRIVES["command held"]), 0.4)
    one = plan((80.0, 120.0), settle_cycles=5, integrate_cycles=5)
    many = simulate_cycles([*servos, other], one, single=True)
    for alone, servo in zip(many, [*servos, other], strict=True):
        np.testing.assert_array_equal(alone, simulate_cycles([servo], one, single=True)[0])


def test_clock_continues_from_dwell_to_dwell():
    """Two dwells are what one of both lengths is, as if nobody had looked in between."""
    unit = drives.unit(drives.finely(drives.DRIVES["encoder, speed"]), free=True)
    whole, parts = SteppedServo(unit, 0.4), SteppedServo(unit, 0.4)
    once = whole.dwell(80.0, 2.5, settle_cycles=10, integrate_cycles=10).output_cycles
    parts.dwell(80.0, 2.5, settle_cycles=5, integrate_cycles=5)
    twice = parts.dwell(80.0, 2.5, settle_cycles=0, integrate_cycles=10).output_cycles
    np.testing.assert_allclose(once[:, 1], twice[:, 1], rtol=1e-4)


def test_current_limit_clips_motor_current():
    sections = drives.DRIVES["current"]
    free = sections | {"amplifier": {"kind": "current", "bandwidth_hz": 1000.0}}
    shown = [abs(simulate(drives.unit(s), 0.4, plan((63.0,))).gain[0]) for s in (sections, free)]
    assert shown[0] < 0.9 * shown[1]


def test_amplifier_and_reading_effects_ignore_clock():
    """A dead zone and a delay on a sampled bench are what they are without its clock."""
    for effect, values in (
        ("amplifier-dead-zone", {"V_d": 2.0}),
        ("amplifier-saturation", {"V_sat": 6.0}),
        ("amplifier-unevenness", {"scale": 0.7}),
        ("reading-delay", {"T_d": 3e-4}),
    ):
        settings = [EffectSetting(effect, values)]
        shown = []
        for sections in ({}, {"sampling": {"rate_hz": 5e4}}):
            unit = drives.unit(sections, free=True)
            shown.append(simulate(unit, 0.5, plan((60.0, 200.0)), effects=settings).gain)
        # Half a sample of 20 us late.
        np.testing.assert_allclose(shown[1], shown[0], rtol=0.02)
        assert np.abs(shown[0] / simulate(unit, 0.5, plan((60.0, 200.0))).gain - 1.0).max() > 0.03


def test_reading_delay_is_equal_for_every_sensor():
    """As an effect it is Pade's approximation with a tachometer, and exact with an encoder."""
    late = [EffectSetting("reading-delay", {"T_d": 5e-4})]
    for sections in ({}, drives.DRIVES["encoder, speed"], drives.DRIVES["tachometer sampled"]):
        unit, hertz = drives.unit(sections), np.array(LINEAR_HZ)
        turned = drivetrain_with(unit, 0.5, late).system().transfer(hertz)
        plain = drivetrain_with(unit, 0.5).system().transfer(hertz)
        np.testing.assert_allclose(turned / plain, np.exp(-2j * np.pi * hertz * 5e-4), rtol=1e-3)
