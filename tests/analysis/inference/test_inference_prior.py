from collections import Counter

import numpy as np
import pytest

from analysis.inference.examples import Scales, read_batch
from analysis.inference.plans import draw_plan, landmarks, reference_response
from analysis.inference.prior import COUNTS, Prior
from analysis.inference.runs import load_batch, save_batch, simulate_batch
from analysis.inference.sets import CauseSets
from sim.catalogue import CATALOGUE
from sim.drivetrain import paper_drivetrain
from sim.unit import load_unit


@pytest.fixture(scope="module")
def prior():
    return Prior(load_unit("adss"))


@pytest.fixture(scope="module")
def marks(prior):
    return landmarks(prior.unit)


def test_set_prior_sums_to_one(prior):
    sets = CauseSets(prior.effects, tuple(prior.weights), COUNTS)
    assert np.exp(sets.log_prior).sum() == pytest.approx(1.0)
    for count, share in enumerate(COUNTS):
        assert np.exp(sets.log_prior[sets.sizes == count]).sum() == pytest.approx(share)


def test_drawn_sets_follow_set_prior(prior):
    """Pairs by frequency: 4,000 draws, chi-square of 29 effects; fails once in 10^4 by chance."""
    rng = np.random.default_rng(1)
    drawn = [prior.draw_group(1, rng)[0].machine.effects for _ in range(4000)]
    counts = Counter(len(effects) for effects in drawn)
    for number, share in enumerate(COUNTS):
        std = np.sqrt(4000 * share * (1 - share))
        assert abs(counts[number] - 4000 * share) < 4.5 * std
    single = Counter(effects[0].id for effects in drawn if len(effects) == 1)
    expected = np.array([prior.weights[i] * sum(single.values()) for i in range(29)])
    seen = np.array([single[effect] for effect in prior.effects])
    assert np.sum((seen - expected) ** 2 / expected) < 65.0


def test_cause_exceeds_tolerance(prior):
    """A datasheet value is a cause only where it is off by more than its believed tolerance."""
    rng = np.random.default_rng(2)
    tried = 0
    for _ in range(400):
        (one,) = prior.draw_group(1, rng)
        tolerance = dict(zip(prior.symbols, one.tolerance, strict=True))
        for setting in one.machine.effects:
            for parameter in CATALOGUE[setting.id].parameters:
                known = prior.unit.parameters.get(parameter.name)
                low, high = parameter.range(prior.unit)
                if known is None or parameter.name in ("T_f_m", "T_f_L", "B_m", "b_t_deg"):
                    continue
                if len(CATALOGUE[setting.id].parameters) == 1 and low > 0.02 * high:
                    off = abs(np.log(setting.values[parameter.name] / known))
                    assert off > 2.4 * tolerance.get(parameter.name, 0.0)
                    tried += 1
    assert tried > 50


def test_machines_of_group_share_linear_part(prior):
    rng = np.random.default_rng(3)
    for _ in range(20):
        systems = [one.machine.servo(prior.unit).system for one in prior.draw_group(4, rng)]
        for system in systems[1:]:
            np.testing.assert_array_equal(system.A, systems[0].A)
            np.testing.assert_array_equal(system.o, systems[0].o)


@pytest.mark.parametrize("name", ["irb", "r3-1", "walkman-b11"])
def test_every_machine_of_other_drives_is_possible(name):
    """Counts, clock and current limit of a drive are no values of a datasheet that deviate."""
    unit, rng = load_unit(name), np.random.default_rng(4)
    drawn = [one for _ in range(10) for one in Prior(unit).draw_group(2, rng)]
    for one in drawn:
        one.machine.servo(unit)
    assert {symbol for one in drawn for symbol, _ in one.machine.deviations} <= set(unit.tolerances)


def test_reference_is_linear_response_far_from_resonance(prior):
    """Without friction and play the loss factor matters at resonances only."""
    frequency_hz = np.array([12.0, 20.0, 30.0])
    exact = paper_drivetrain(prior.unit, 0.5).system().transfer(frequency_hz)
    smoothed = reference_response(prior.unit, frequency_hz)
    assert np.max(np.abs(np.log(np.abs(smoothed / exact)))) < 0.15


@pytest.mark.parametrize("unit", ["adss", "edss"])
def test_drawn_plans_stay_within_limits(unit):
    unit = load_unit(unit)
    marks = landmarks(unit)
    rng = np.random.default_rng(4)
    assert unit.limits.start_hz < marks.arf_hz < marks.rf_hz < unit.limits.stop_hz
    for _ in range(200):
        plan = draw_plan(unit, marks, rng)
        assert unit.limits.start_hz <= plan.frequencies_hz[0]
        assert plan.frequencies_hz[-1] <= unit.limits.stop_hz
        assert max(plan.levels_vpk) <= unit.limits.source_vpk
        assert abs(plan.dc_offset_v) <= unit.limits.source_offset_v


def test_batch_depends_on_seed_and_number_alone(prior, marks, tmp_path):
    first, again = (simulate_batch(prior, marks, 5, 6) for _ in range(2))
    np.testing.assert_array_equal(first.mean, again.mean)
    assert first.plan == again.plan
    assert first.plan != draw_plan(prior.unit, marks, np.random.default_rng([5, 7]))
    save_batch(tmp_path / "batch.npz", first)
    loaded = load_batch(tmp_path / "batch.npz")
    assert loaded.plan == first.plan
    for name in ("mean", "variance", "effects", "sizes", "tolerance", "errors", "ratio"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(first, name))
    scales = Scales(prior, marks, 5.0)
    examples = read_batch(scales, first, np.random.default_rng(0))
    assert len(examples) == len(first)
    for number, one in zip(examples.set, first.effects, strict=True):
        assert [prior.effects[i] for i in np.flatnonzero(one)] == list(scales.sets.names(number))
    assert np.all(np.isfinite(examples.points))
