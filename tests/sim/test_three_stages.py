"""A drive with three gear stages: held to a chain worked out by hand, and to a limit of two."""

import math
import tomllib

import numpy as np
import pytest
from worlds.chain_by_hand import chain

from daq.configs import config_path
from daq.errors import ConfigurationError
from daq.plan import SweepPlan
from sim.datasheet import find_impossible
from sim.drivetrain import paper_drivetrain
from sim.response import simulate
from sim.unit import load_unit, unit_from_mapping

TEMPLATE = config_path("templates", "three-stage")
THREE = load_unit(str(TEMPLATE))


def document():
    return tomllib.loads(TEMPLATE.read_text(encoding="utf-8"))


def test_linear_drive_equals_chain_by_hand():
    frequency = np.geomspace(5.0, 2000.0, 400)
    soft = THREE.with_parameters(k_3=400.0, J_g2=3e-3, k_2=500.0)
    for unit in (THREE, soft):
        system = paper_drivetrain(unit, 0.4).system()
        np.testing.assert_allclose(system.transfer(frequency), chain(unit, frequency), rtol=1e-7)
    # The third stage shows: another mode is in the band of the soft one.
    assert np.abs(chain(soft, frequency) / chain(THREE, frequency)).max() > 2.0


def test_stiff_third_stage_equals_two_stages():
    """Without play and ratio a third stage is a part of the load."""
    limit = document()
    limit["stage3"] = {"J_g2": 1e-7, "N_3": 1.0, "k_3": 1e6, "b3_deg": 0.0}
    limit["load"]["J_L"] /= 9.0
    two = dict(limit)
    del two["stage3"]
    plan = SweepPlan((80.0, 110.0, 150.0), (2.5,), settle_cycles=30, integrate_cycles=40)
    units = [unit_from_mapping(one, "limit") for one in (limit, two)]
    assert [unit.stages for unit in units] == [3, 2]
    seen = np.array([[simulate(u, 0.3, plan, seed=s).gain for s in range(6)] for u in units])
    off = np.abs(seen[0].mean(axis=0) / seen[1].mean(axis=0) - 1.0)
    spread = np.hypot(*seen.std(axis=1, ddof=1)) / np.abs(seen[1].mean(axis=0)) / math.sqrt(6)
    assert np.all(off < 5.0 * spread + 0.01), (off, spread)


@pytest.mark.parametrize("ratio", [0.0, 0.3, 1.0])
def test_stages_share_out_what_third_leaves(ratio):
    plays, b_t = THREE.split(ratio), THREE.backlash.b_t_deg
    N, N_3 = THREE.stage2.N, THREE.stage3.N_3
    assert plays.b3_deg == THREE.stage3.b3_deg
    at_load = plays.b1_deg / (N * N_3), plays.b2_deg / N_3, plays.b3_deg
    assert sum(at_load) == pytest.approx(b_t)
    assert at_load[0] == pytest.approx(ratio * (b_t - plays.b3_deg))


def test_smaller_total_sits_in_third_stage():
    plays = THREE.with_parameters(b_t_deg=0.01).split(0.5)
    assert (plays.b1_deg, plays.b2_deg, plays.b3_deg) == (0.0, 0.0, 0.01)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda d: d["stage3"].pop("b3_deg"), "here: stage3.b3_deg: Field required"),
        (lambda d: d["stage3"].update(N_3=0.0), "here: stage3.N_3"),
        (lambda d: (d.pop("stage2"), d["stage1"].pop("J_p2")), "here: .stage2. is required by"),
        (lambda d: d.update(stage4={}), "here: stage4"),
    ],
)
def test_wrong_third_stage_is_refused(change, said):
    wrong = document()
    change(wrong)
    with pytest.raises(ConfigurationError, match=said):
        unit_from_mapping(wrong, "here")


@pytest.mark.parametrize(("b_t_deg", "b3_deg"), [(0.12, 0.13), (0.0, 0.1)])
def test_more_than_total_cannot_be(b_t_deg, b3_deg):
    wrong = document()
    wrong["backlash"]["b_t_deg"], wrong["stage3"]["b3_deg"] = b_t_deg, b3_deg
    (said,) = find_impossible(unit_from_mapping(wrong, "here"))
    assert said.startswith(f"stage3.b3_deg {b3_deg:g} deg: stage 3 has")


def test_damping_of_missing_third_stage_is_refused():
    wrong = document() | {"damping": {"c_3": 0.2}}
    assert unit_from_mapping(wrong, "here").damping.c_3 == 0.2
    del wrong["stage3"]
    with pytest.raises(ConfigurationError, match="damping.c_3 is that of stage 3"):
        unit_from_mapping(wrong, "here")
