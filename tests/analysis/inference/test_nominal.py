import numpy as np
import pytest

from analysis.ensemble.batch import Family, read_family
from analysis.ensemble.machine import Machine
from analysis.inference.inputs import SweptLevels
from analysis.inference.nominal import RUNS, compare, expected, nominal_of, nominal_runs, relative
from analysis.observation.observation import unread
from analysis.observation.reading_noise import USUAL_NOISE_V
from daq.plan import SweepPlan, spaced_frequencies
from sim.unit import load_unit

ADSS = load_unit("adss")
PLAN = SweepPlan(
    spaced_frequencies(100.0, 165.0, 25), (1.5, 4.0), settle_cycles=15, integrate_cycles=20
)
RATIOS = (0.2, 0.5, 0.8)


@pytest.fixture(scope="module")
def runs():
    return nominal_runs(ADSS, PLAN)


@pytest.fixture(scope="module")
def machines():
    """Runs of other machines of the datasheet: starts of their own."""
    family = Family(
        ADSS,
        tuple(Machine(ratio, 90 + k) for ratio in RATIOS for k in range(4)),
        ((PLAN, np.arange(PLAN.points)),),
    )
    return read_family(family)


def swept(mean, variance):
    shape = (len(mean), 2, 25)
    noise_v = np.full(len(mean), USUAL_NOISE_V, dtype=np.float32)
    return SweptLevels(
        np.asarray(PLAN.frequencies_hz),
        np.asarray(PLAN.levels_vpk),
        mean.reshape(shape).astype(np.complex64),
        np.sqrt(variance * PLAN.integrate_cycles).reshape(shape).astype(np.float32),
        noise_v,
        np.ones((1, 1, 1), dtype=bool),
        down=False,
        settle_cycles=15,
        integrate_cycles=20,
        offset_v=0.0,
    )


def test_regression_reproduces_linear_ratio_dependence():
    ratio = np.linspace(0.015, 0.985, RUNS)
    mean = np.exp((0.3 + 0.5 * ratio) * (1.0 + 0.2j))[:, None, None].astype(np.complex64)
    found = expected(mean, np.full(mean.shape, 1e-4, dtype=np.float32))
    grid = np.linspace(0.015, 0.985, 33)
    np.testing.assert_allclose(found.mean[:, 0, 0, 0], 0.3 + 0.5 * grid, atol=1e-3)
    np.testing.assert_allclose(found.mean[:, 1, 0, 0], 0.2 * (0.3 + 0.5 * grid), atol=3e-3)
    np.testing.assert_allclose(found.mean[:, 2, 0, 0], np.log(0.01), atol=1e-2)


def test_datasheet_machine_departs_by_its_scatter(runs, machines):
    """Its ratio is found, and a typical reading lies within a standard deviation or so."""
    (departures,), facts = relative([(swept(*machines), expected(*runs))])
    assert departures.shape == (12, 4, 2, 25)
    ratio, typical = facts[:, -2], np.exp(facts[:, -1]) - 0.1
    true = (np.repeat(RATIOS, 4) - 0.015) / 0.97
    assert np.median(np.abs(ratio - true)) < 0.15
    assert 0.3 < np.median(typical) < 1.2


def test_wrong_gain_shows_as_departure(runs, machines):
    """A response 30 % too large departs further than one as it was simulated."""
    mean, variance = machines
    nominal = expected(*runs)
    as_it_is, scaled = (
        relative([(swept(k * mean, variance), nominal)])[1][:, -1] for k in (1, 1.3)
    )
    assert np.all(scaled > as_it_is)


def test_missing_reading_has_no_influence(runs, machines):
    one, nominal = swept(*machines), expected(*runs)
    gain = one.gain.copy()
    gain[:, 0, :5] = np.nan
    holed = SweptLevels(**{name: getattr(one, name) for name in one.__slots__} | {"gain": gain})
    log_likelihood, z = compare(holed, nominal)
    assert np.all(np.isfinite(log_likelihood))
    assert np.all(np.isnan(z[:, :, :, 0, :5]))
    assert np.all(np.isfinite(z[:, :, :, 1]))


def test_runs_of_a_plan_are_kept(runs, tmp_path):
    """A second look at the same sweep simulates nothing, and shows the same."""
    observation = unread(PLAN, USUAL_NOISE_V)
    first = nominal_of(ADSS, observation, tmp_path)
    kept = {file: file.stat().st_mtime_ns for file in tmp_path.iterdir()}
    again = nominal_of(ADSS, observation, tmp_path)
    assert {file: file.stat().st_mtime_ns for file in tmp_path.iterdir()} == kept
    np.testing.assert_array_equal(first.mean, again.mean)
    np.testing.assert_allclose(first.mean, expected(*runs).mean, atol=1e-4)
