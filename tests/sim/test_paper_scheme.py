"""The paper's scheme is RK4 at its step, and its step does what is said of it."""

import numpy as np
import pytest
from oracle import rk4

from sim.paper_scheme import PAPER_STEP_S, paper_gains
from sim.unit import load_unit, stage_backlash


@pytest.fixture(params=["adss", "edss"])
def unit(request):
    return load_unit(request.param)


def play(unit, ratio):
    return stage_backlash(ratio, unit.backlash.b_t_deg, unit.stage2.N)


def decibels(gains):
    return 20.0 * np.log10(np.abs(gains))


@pytest.mark.parametrize("ratio", [0.0, 0.5, 1.0])
def test_plain_start_matches_the_oracle(unit, ratio):
    # 80 and 160 Hz hold whole numbers of steps, so both sum the same instants. One cycle:
    # from the second on, chaos makes much of the last bit.
    backlash = play(unit, ratio)
    gains = paper_gains(
        unit, backlash, [80.0, 160.0], starts=1, settle_cycles=0, integrate_cycles=1
    )
    for frequency, gain in zip([80.0, 160.0], gains[0], strict=True):
        cycles, _ = rk4.simulate_cycles(
            unit.parameters, *backlash.half_plays_rad, 2.5, frequency, 1, PAPER_STEP_S
        )
        assert gain == pytest.approx(cycles[0, 1], rel=1e-6)


def test_step_not_dividing_cycle_reads_same_gain():
    unit = load_unit("adss")
    near = paper_gains(unit, play(unit, 0.0), [149.9, 150.0, 150.1], starts=1)[0]
    assert abs(near[1] - 0.5 * (near[0] + near[2])) < 1e-4 * abs(near[1])


def test_starts_are_seeded_first_is_plain():
    unit = load_unit("edss")
    runs = {"settle_cycles": 5, "integrate_cycles": 3}
    one = paper_gains(unit, play(unit, 0.5), [70.0], starts=4, seed=1, **runs)
    again = paper_gains(unit, play(unit, 0.5), [70.0], starts=4, seed=1, **runs)
    other = paper_gains(unit, play(unit, 0.5), [70.0], starts=4, seed=2, **runs)
    same = paper_gains(unit, play(unit, 0.5), [70.0], starts=4, start_spread=0.0, **runs)
    assert np.array_equal(one, again)
    assert one[0] == other[0] == same[0]
    assert np.unique(one).size == 4
    assert not np.any(one[1:] == other[1:])
    assert np.unique(same).size == 1


def test_every_start_rests_inside_the_backlash():
    # Too weak to overcome the motor's friction: whatever moved would have been pushed by a mesh.
    unit = load_unit("adss")
    gains = paper_gains(
        unit, play(unit, 0.5), [60.0], starts=16, start_spread=1.0, source_vpk=0.2,
        settle_cycles=0, integrate_cycles=5,
    )  # fmt: skip
    assert np.abs(gains).max() < 5e-3


def test_progress_is_reported_after_each_frequency():
    unit = load_unit("adss")
    told = []
    paper_gains(
        unit, play(unit, 0.0), [150.0, 151.0, 152.0], starts=1, settle_cycles=1,
        integrate_cycles=1, progress=lambda: told.append(None),
    )  # fmt: skip
    assert len(told) == 3


def test_ten_microseconds_damp_two_do_not():
    # EDSS 50 %, 83 Hz: -5.4 dB and steady at 10 us, -14 dB and chattering at 2 us.
    unit = load_unit("edss")
    coarse, fine = (
        decibels(paper_gains(unit, play(unit, 0.5), [83.0], starts=8, step_s=step))
        for step in (PAPER_STEP_S, 2e-6)
    )
    assert np.median(coarse) == pytest.approx(-5.4, abs=0.6)
    assert np.median(fine) < np.median(coarse) - 4.0
    assert fine.std() > 2.0 * coarse.std()


def test_two_motions_exist_at_table_2_resonance():
    # EDSS 0 % at 79 Hz, the printed RF of -3.4 dB: some starts end there, others 3.6 dB lower.
    unit = load_unit("edss")
    gains = decibels(paper_gains(unit, play(unit, 0.0), [79.0], starts=24, start_spread=1.0))
    high, low = np.abs(gains + 3.4) < 0.3, np.abs(gains + 7.0) < 0.3
    assert high.any()
    assert low.any()
    assert np.all(high | low)
