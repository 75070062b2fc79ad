"""What hangs on the load, as inertia that is felt at a frequency, against the linear drivetrain."""

import numpy as np
import pytest

from sim.catalogue import BUILT_IN
from sim.effects import EffectSetting, drivetrain_with
from sim.engine.system import PiecewiseLinearSystem
from sim.unit import Unit, load_unit

FREQUENCIES = np.geomspace(10.0, 400.0, 9)
AT_LOAD = {name: effect for name, effect in BUILT_IN.items() if effect.added_inertia is not None}


def system(unit: Unit, *effects: EffectSetting) -> PiecewiseLinearSystem:
    return drivetrain_with(unit, 0.4 if unit.stage2 else 1.0, effects).system()


def transfer_by_inertia(unit: Unit, inertia):
    """Transfer (rows,) of a unit whose load has a complex inertia (rows,).

    It is a ratio of two linear functions of the inertia, so that three real ones tell it whole.
    """
    known = unit.load.J_L * np.array([0.5, 1.0, 2.0])
    shown = [system(unit.with_parameters(J_L=J)).transfer(FREQUENCIES) for J in known]
    found = []
    for values, J in zip(np.transpose(shown), inertia, strict=True):
        # a + b J - c J H = H
        matrix = np.column_stack([np.ones(3), known, -known * values])
        scale = np.abs(matrix).max(axis=0)
        a, b, c = np.linalg.solve(matrix / scale, values) / scale
        found.append((a + b * J) / (1.0 + c * J))
    return np.array(found)


def test_four_effects_are_linear_at_the_load():
    assert set(AT_LOAD) == {
        "cable-stiffness", "load-inertia", "load-viscous-damping", "payload-flexibility"
    }  # fmt: skip


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("effect", AT_LOAD)
@pytest.mark.parametrize("name", ["adss", "edss"])
def test_added_inertia_gives_the_drivetrain_transfer(name, effect, share):
    unit = load_unit(name)
    ends = {p.name: p.range(unit) for p in AT_LOAD[effect].parameters}
    values = {key: low * (high / low) ** share for key, (low, high) in ends.items()}
    added = AT_LOAD[effect].added_inertia(unit, values, 2.0 * np.pi * FREQUENCIES)
    whole = system(unit, EffectSetting(effect, values)).transfer(FREQUENCIES)
    np.testing.assert_allclose(whole, transfer_by_inertia(unit, unit.load.J_L + added), rtol=1e-6)
