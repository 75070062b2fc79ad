"""What a datasheet may be off by, of drives that are not the paper's: delays, couplings, loops."""

import numpy as np
import pytest
from worlds import drives

from analysis.ensemble.datasheet_spread import feature_spread, spread_of
from analysis.ensemble.linear_response import linear_response
from analysis.ensemble.machine import Machine, safe_cycles
from daq.errors import ConfigurationError
from daq.plan import SweepPlan

LATE = drives.DRIVES["encoder, speed"]


def test_delay_is_exact_without_stated_tolerance():
    unit = drives.unit(LATE)
    assert unit.tolerances["delay_s"] == 0.0
    told = unit.with_tolerance({"default": 0.0, "delay_s": 0.3})
    spread = spread_of(told)
    assert spread.symbols == ("delay_s",)
    assert spread.sigmas[0] == pytest.approx(0.3)
    with pytest.raises(ConfigurationError, match="delay_s"):
        drives.unit({}).with_tolerance({"delay_s": 0.3})


def test_deviating_delay_delays_the_machine():
    unit = drives.unit(LATE, free=True)
    plan = SweepPlan((60.0, 200.0), (2.5,), settle_cycles=8, integrate_cycles=4)
    machines = [Machine(0.5, 1), Machine(0.5, 1, None, (("delay_s", 0.4),))]
    plain, late = safe_cycles([one.servo(unit) for one in machines], plan)
    turn = np.angle(late[..., 1] / plain[..., 1])
    expected = -2.0 * np.pi * np.array([60.0, 200.0]) * 0.4 * 5e-4
    np.testing.assert_allclose(turn[0].mean(axis=1), expected, rtol=1e-3)


@pytest.mark.parametrize("name", [*drives.DRIVES, *drives.LOOPS])
def test_every_toleranced_drive_value_may_deviate(name):
    """By 5 % of all, as an answer about it takes for granted: every way has a finite effect."""
    unit = drives.unit((drives.DRIVES | drives.LOOPS)[name])
    spread = spread_of(unit)
    assert 1 <= len(spread) <= 7
    assert np.all(np.isfinite(spread.ways))
    assert all(np.isfinite(feature_spread(unit)))
    shown = linear_response(unit, np.array([40.0, 120.0]), (1.5, 4.0))
    assert np.all(np.isfinite(shown))


def test_gain_of_controller_belongs_to_datasheet_spread():
    """It is exact unless it is named, and then changes a response."""
    loop = drives.unit(drives.LOOPS["position"])
    told = loop.with_tolerance({"default": 0.0, "K_v": 0.1})
    assert spread_of(told).symbols == ("K_v",)
    assert "K_v" not in spread_of(loop.with_tolerance({"default": 0.05})).symbols


def test_coupling_stiffness_belongs_to_datasheet_spread():
    couplings = drives.unit(drives.COUPLINGS).with_tolerance({"default": 0.0, "k_cL": 0.1})
    assert spread_of(couplings).symbols == ("k_cL",)
