"""Unit files with [loop]: what is refused, what is unstable, and what a person is told."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from worlds import drives

from daq.configs import config_names
from daq.errors import AnalysisError, ConfigurationError
from daq.plan import SweepPlan
from sim.catalogue import BUILT_IN, not_of_unit
from sim.datasheet import describe_chain, find_impossible, find_unusual
from sim.datasheet.stability import gain_margin, loop_features
from sim.drivetrain import paper_drivetrain
from sim.effects import EffectSetting, drivetrain_with
from sim.engine.linear import poles
from sim.response import simulate
from sim.servo import linear_key
from sim.tolerance import response_scales
from sim.unit import load_unit

CLOCKED = drives.DRIVES["encoder, speed"]
POSITION = drives.LOOPS["position"]
SPEED = drives.SPEED
EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "loop.toml"

WRONG = (
    ({"loop": SPEED | {"K_p": 0.0}}, "loop.K_p"),
    ({"loop": SPEED | {"T_i_s": -1.0}}, "loop.T_i_s"),
    ({"loop": SPEED | {"controls": "torque"}}, "torque"),
    ({"loop": SPEED | {"excited": "load"}}, "load"),
    ({"loop": SPEED | {"K_d": 1.0}}, "K_d"),
    ({"loop": SPEED | {"computing_s": 0.2}}, "loop.computing_s"),
    ({"loop": SPEED | {"K_v": 10.0}}, "loop.K_v is that of a position loop"),
    ({"loop": SPEED | {"controls": "position"}}, "loop.K_v is required"),
    ({"loop": POSITION["loop"]}, "a tachometer reads speed"),
    (POSITION | {"loop": SPEED}, "sensor.reads is 'position'"),
    (POSITION | {"sampling": {"rate_hz": 2e3, "holds_command": False}}, "holds_command"),
    (CLOCKED | {"loop": SPEED | {"filtered": True}}, "loop.filtered"),
)


@pytest.mark.parametrize(("sections", "named"), WRONG)
def test_contradiction_of_loop_is_refused(sections, named):
    with pytest.raises(ConfigurationError) as error:
        drives.unit(sections)
    assert named in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["speed, command", "speed by an encoder", "position"])
def test_engine_agrees_with_poles_on_stability(name):
    unit = drives.unit(drives.finely(drives.LOOPS[name]), free=True)
    plan, seen = SweepPlan((40.0,), (0.2,), settle_cycles=20, integrate_cycles=5), []
    for factor in (1.0, 8.0, 25.0, 80.0):
        other = unit.with_parameters(K_p=factor * unit.loop.K_p)
        system = paper_drivetrain(other, 0.5).system()
        growth = poles(system).real.max()
        if 1e-3 < growth < 5.0:
            continue
        (expected,) = system.transfer(np.array(plan.frequencies_hz))
        try:
            (shown,) = simulate(other, 0.5, plan).gain
        except (AnalysisError, RuntimeWarning):
            shown = np.inf
        assert (abs(shown / expected - 1.0) < 0.05) == (growth < 5.0), (shown, expected, growth)
        seen.append(growth < 5.0)
    assert set(seen) == {True, False}


def test_unstable_loop_is_refused_with_plausible_gain():
    unit = drives.unit({"loop": SPEED | {"filtered": True, "K_p": 30.0}})
    (text,) = find_impossible(unit)
    assert text.startswith("loop.K_p 30: the closed loop is unstable at ")
    most = float(text.split("at most ")[1].rstrip(")"))
    assert not find_unusual(unit.with_parameters(K_p=most))
    assert find_unusual(unit.with_parameters(K_p=1.5 * most))
    assert not find_impossible(unit.with_parameters(K_p=1.5 * most))


def test_file_with_unstable_loop_is_refused(tmp_path):
    path = tmp_path / "fast.toml"
    text = EXAMPLE.read_text(encoding="utf-8").replace("K_p = 2.0 ", "filtered = true\nK_p = 90.0 ")
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError, match=r"fast\.toml: .*loop\.K_p 90: the closed loop is"):
        load_unit(str(path))


def test_loop_around_load_shows_resonance_alone():
    """A speed of the load has no anti-resonance."""
    load = {"sensor": {"kind": "tachometer", "at": "load"}, "loop": SPEED | {"K_p": 0.01}}
    found = loop_features(drives.unit(load))
    assert found.arf_hz is None
    assert found.rf_hz == pytest.approx(155.0, rel=0.02)


def test_loop_may_be_unstable_inside_the_play():
    """Without the load the motor is lighter, and the loop faster."""
    stiff = {"stage1": {"k_s1": 1e5}, "damping": {"c_s1": 1.0, "c_g1": 1.0, "c_2": 30.0}}
    heavy = {"load": {"J_L": 0.2}, "loop": SPEED | {"filtered": True}}
    unit = drives.unit(stiff | heavy)
    more = unit.with_parameters(K_p=1.2 * gain_margin(unit) * unit.loop.K_p)
    system = paper_drivetrain(more, 0.5).system()
    assert poles(system).real.max() < 1.0
    assert poles(system.opened()).real.max() > 5.0


@pytest.mark.parametrize("where", ["reference", "command"])
def test_loop_moves_resonance_and_keeps_anti_resonance(where):
    unit = drives.unit({"loop": SPEED | {"K_p": 6.0, "excited": where}})
    open_loop = loop_features(unit.model_copy(update={"loop": None}))
    closed = loop_features(unit)
    assert closed.arf_hz == pytest.approx(open_loop.arf_hz, rel=0.002)
    assert closed.rf_hz > 1.005 * open_loop.rf_hz


@pytest.mark.parametrize(
    "effect", [("amplifier-gain", {"k_a": 41.1}), ("amplifier-unevenness", {"scale": 0.1})]
)
def test_unstable_loop_moves_within_bounds(effect):
    """So that it is one of the machines that a response is compared with."""
    unit = drives.unit({"loop": SPEED | {"filtered": True, "K_p": 1.0}})
    plan = SweepPlan((60.0,), (2.5,), settle_cycles=20, integrate_cycles=5)
    shown = simulate(unit, 0.5, plan, effects=[EffectSetting(*effect)]).gain[0]
    assert abs(shown) < 1e6


def test_limit_of_loop_changes_no_uneven_amplifier():
    """The amplifier of a loop has a limit, which nothing else reaches."""
    uneven, plan = (
        [EffectSetting("amplifier-unevenness", {"scale": 0.7})],
        SweepPlan((60.0,), (2.5,)),
    )
    hardly = {"loop": SPEED | {"K_p": 1e-9, "excited": "command"}}
    shown = [
        simulate(drives.unit(sections, free=True), 0.5, plan, effects=uneven).gain[0]
        for sections in (hardly, {})
    ]
    assert shown[0] == pytest.approx(shown[1], rel=1e-6)


def test_chain_is_told_with_its_loop():
    unit = drives.unit(POSITION | {"loop": POSITION["loop"] | {"computing_s": 2e-4}})
    text = "\n".join(describe_chain(unit))
    for part in ("position, K_v 40 1/s, K_p 1, T_i 0.02 s, 0.2 ms to compute", "its reference",
                 "times its K_p, meshes closed or open", "shows ARF 148.9 Hz, RF"):  # fmt: skip
        assert part in text
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize("name", drives.LOOPS)
def test_closed_loop_accepts_every_possible_effect(name):
    unit = drives.unit(drives.LOOPS[name])
    for effect in BUILT_IN.values():
        if effect.id not in not_of_unit(unit):
            ends = {p.name: sum(p.range(unit)) / 2.0 for p in effect.parameters}
            drivetrain_with(unit, 0.5, [EffectSetting(effect.id, ends)]).system()


def test_gains_of_controller_are_exact_unless_named():
    unit = drives.unit(POSITION | {"tolerance": {"default": 0.1, "K_p": 0.03}})
    assert unit.tolerances["K_p"] == 0.03
    assert unit.tolerances["T_i_s"] == unit.tolerances["K_v"] == 0.0
    changed = unit.with_parameters(K_p=2.0, K_v=10.0)
    assert (changed.loop.K_p, changed.loop.K_v) == (2.0, 10.0)


def test_tachometer_gain_in_loop_is_no_scale():
    """It decides the loop gain; the filter behind it is a scale, if the loop is before it."""
    before, behind = (drives.unit({"loop": SPEED | {"filtered": f}}) for f in (False, True))
    hertz = np.array([20.0, 150.0])
    for unit in (drives.unit({}), before, behind):
        plain = paper_drivetrain(unit, 0.5).system().transfer(hertz)
        scales = response_scales(unit)
        for symbol in ("k_ts", "filter_numerator"):
            value = 1.1 * unit.parameters[symbol]
            other = paper_drivetrain(unit.with_parameters(**{symbol: value}), 0.5).system()
            is_scale = np.allclose(other.transfer(hertz) / plain, 1.1, rtol=1e-9)
            assert is_scale == (symbol in scales), symbol


DIGESTS = {
    "adss": "21995ecd34af163c",
    "edss": "90ec1d205a395103",
    "feed-axis": "17754b8d2fe4bbdc",
    "irb": "99afda6947db94f6",
    "r3-1": "e78369e4fca9b9e2",
    "r3-2": "25d0febb3d46bcab",
    "r3-3": "e4635f33dc7f84b8",
    "srv02-torsion": "b15fd37bfad0547b",
    "walkman-2300": "6ab9a60427d15e4e",
    "walkman-b11": "9bf031bcca2e3b39",
}
"""Of the equations as they were before there were loops."""


@pytest.mark.parametrize("name", config_names("units"))
def test_drive_without_loop_is_bit_identical(name):
    """What is stored of a drive stays valid: its equations are as they were, to the last bit."""
    unit = load_unit(name)
    system = paper_drivetrain(unit, 1.0 if unit.stages == 1 else 0.3).system()
    assert hashlib.sha256(linear_key(system)).hexdigest()[:16] == DIGESTS[name]


def test_delay_outside_loop_is_told():
    late = {"sensor": {"kind": "tachometer", "delay_s": 5e-4}, "loop": SPEED}
    (text,) = find_unusual(drives.unit(late))
    assert "sensor.delay_s 0.0005 s is outside the loop" in text
    assert not find_unusual(drives.unit(late | {"loop": SPEED | {"computing_s": 0.0}}))


def test_small_reference_of_loop_may_overcome_friction():
    """What the motor gets is the controller's command, not the source: so are ranges of effects."""
    limits = {"source_vpk": 0.05, "source_offset_v": 0.0}
    amplifier = {"current_limit_a": 1.6, "kind": "current", "bandwidth_hz": 1000.0}
    sections = POSITION | {"limits": limits, "amplifier": amplifier, "electronics": {"k_a": 0.1}}
    unit = drives.unit(sections)
    assert not find_impossible(unit)
    without = unit.model_copy(update={"loop": None})
    assert "T_f_m" in find_impossible(without)[0]
    (dead,) = BUILT_IN["amplifier-dead-zone"].parameters
    assert dead.range(unit)[1] == pytest.approx(40.0 * dead.range(without)[1], rel=1e-3)


def test_example_of_loop_is_plausible():
    unit = load_unit(str(EXAMPLE))
    assert not find_unusual(unit)
    assert unit.loop is not None
