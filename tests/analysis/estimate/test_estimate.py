"""The estimate of stage backlash: known truths come back, inside intervals that cover."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.advice import advise
from analysis.answer import accept_model
from analysis.ensemble.machine import Machine
from analysis.ensemble.run_cache import run_families
from analysis.estimate import Estimate, estimate_features, estimate_response
from analysis.estimate.from_features import fit_features, index_curve_of_response
from analysis.observation.observation import observe
from daq.errors import InputError
from daq.formats import read_response
from daq.frf import DB_PER_NEPER, FrequencyResponse
from daq.plan import SweepPlan, spaced_frequencies
from sim.response import simulate
from sim.unit import load_unit

PRACTICE = Path(__file__).parents[2] / "data" / "practice"
SHORT = SweepPlan(spaced_frequencies(115.0, 160.0, 19), (2.5,), settle_cycles=6, integrate_cycles=8)


@pytest.fixture(scope="session")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("machines")


def on_a_bench(response, seed, noise_v=5e-4):
    """A simulated response as a bench reads it: noise added, errors stated as a bench does."""
    rng = np.random.default_rng(seed)
    noise = noise_v / response.source_vpk
    reading = rng.standard_normal((2, len(response))) * noise
    gain = response.gain + reading[0] + 1j * reading[1]
    along = np.hypot(response.gain_std_db / DB_PER_NEPER, noise / np.abs(gain))
    return replace(response, gain=gain, gain_std_db=DB_PER_NEPER * along)


def within(found, truth, sigmas):
    return abs(found.value - truth) <= sigmas * found.std


@pytest.mark.parametrize("ratio", [0.15, pytest.param(0.6, marks=pytest.mark.long)])
def test_short_sweep_estimates_ratio_off_datasheet(ratio, cache):
    unit = load_unit("adss")
    machine = unit.with_parameters(
        R_m=1.004 * unit.motor.R_m, J_L=0.995 * unit.load.J_L, k_ts=1.005 * unit.electronics.k_ts
    )
    measured = on_a_bench(simulate(machine, ratio, SHORT, seed=77), seed=1)
    found = estimate_response(measured, unit, cache=cache)
    # Four standard deviations: missed by chance in one of some thousand runs.
    assert within(found.contribution_ratio, ratio, 4.0)
    assert 0.002 < found.contribution_ratio.std < 0.15
    low, high = found.contribution_ratio.interval95
    assert 0.0 <= low < high <= 1.0
    b_t = unit.backlash.b_t_deg
    r = found.contribution_ratio.value
    assert found.b1_deg.value == pytest.approx(r * b_t * unit.stage2.N)
    assert found.b2_deg.value == pytest.approx((1.0 - r) * b_t)
    assert (found.b_t_deg.value, found.b_t_deg.std) == (b_t, 0.0)


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.study) for n in (1, 2))])
def test_two_sweeps_are_estimated_together(seed, cache):
    """Other levels, band and direction."""
    unit = load_unit("adss")
    lower = replace(SHORT, frequencies_hz=SHORT.frequencies_hz[:13:2])
    plans = (SHORT, replace(lower, levels_vpk=(4.0, 2.5), direction="down"))
    first, second = (
        on_a_bench(simulate(unit, 0.35, plan, seed=20 + n), seed=n)
        for n, plan in enumerate(plans, start=2 * seed)
    )
    alone = [estimate_response(one, unit, cache=cache) for one in (first, second)]
    found = estimate_response(first, unit, further=[second], cache=cache)
    assert within(found.contribution_ratio, 0.35, 4.0)
    # Sweeps that lean apart by chance leave a wider answer than two that agree.
    assert found.contribution_ratio.std < 1.25 * min(one.contribution_ratio.std for one in alone)
    swept = found.to_json()["sweeps"]
    assert [(one["levels_vpk"], one["direction"]) for one in swept] == [
        ([2.5], "up"), ([2.5, 4.0], "down")
    ]  # fmt: skip
    assert "  sweep 2: 7 points from" in "\n".join(found.summary())
    assert "sweep 1" not in "\n".join(alone[0].summary())
    with pytest.raises(InputError, match="given twice"):
        estimate_response(first, unit, further=[first])


@pytest.mark.long
def test_error_index_uses_first_of_several_sweeps():
    """From the same runs, read with the same noise, though the second holds the same level."""
    unit = load_unit("adss")
    plan = replace(
        SHORT,
        frequencies_hz=spaced_frequencies(110.0, 170.0, 31),
        settle_cycles=10,
        integrate_cycles=12,
    )
    first, second = (
        on_a_bench(simulate(unit, 0.35, one, seed=n), seed=n)
        for n, one in enumerate((plan, replace(plan, levels_vpk=(2.5, 2.0), direction="down")))
    )
    machines = [tuple(Machine(r, seed=i) for i, r in enumerate(np.linspace(0.0, 1.0, 11)))]

    def curve(*responses):
        seen = observe(*responses).with_noise(observe(first).noise_v)
        return index_curve_of_response(responses[0], seen, run_families(unit, machines, seen))

    alone, together, other = curve(first), curve(first, second), curve(second, first)
    assert np.max(np.abs(together.hz - alone.hz)) < 1e-3
    assert np.max(np.abs(other.hz - alone.hz)) > 0.1


@pytest.mark.long
def test_driven_dc_offset_is_no_backlash():
    """It leans the gears on one side: taken for none, the ratio came out at 0.64 for 0.4."""
    unit, leaning = load_unit("adss"), replace(SHORT, dc_offset_v=1.0)
    measured = on_a_bench(simulate(unit, 0.4, leaning, seed=3), seed=4)
    assert measured.dc_offset_v == 1.0
    found = estimate_response(measured, unit)
    assert within(found.contribution_ratio, 0.4, 4.0)
    assert not found.warnings
    stripped = replace(measured, provenance={})
    assert estimate_response(stripped, unit).warnings


@pytest.mark.parametrize(
    ("level_vpk", "seed"),
    [(0.5, 2), *(pytest.param(*one, marks=pytest.mark.long) for one in ((0.25, 1), (0.5, 3)))],
)
def test_uninformative_sweep_leaves_ratio_open(level_vpk, seed, cache):
    """The motor is held by friction, or moves within its play: every ratio shows the same.

    It said 0.06 +- 0.04 for 0.4.
    """
    unit, gentle = load_unit("adss"), replace(SHORT, levels_vpk=(level_vpk,))
    measured = on_a_bench(simulate(unit, 0.4, gentle, seed=seed), seed=seed)
    found = estimate_response(measured, unit, seed=seed)
    # Evenly over 0 to 1 has a standard deviation of 0.29.
    assert found.contribution_ratio.std > 0.2
    low, high = found.contribution_ratio.interval95
    assert low < 0.2
    assert high > 0.8


@pytest.mark.long
def test_level_held_by_friction_does_no_harm(cache):
    """Its simulation moves by nothing, and what was read there is the noise of the reading."""
    unit, both = load_unit("adss"), replace(SHORT, levels_vpk=(0.25, 2.5))
    measured = on_a_bench(simulate(unit, 0.6, both, seed=9), seed=6)
    assert np.max(np.abs(measured.at_level(0.25).gain)) < 0.01
    alone = measured.take(measured.source_vpk == 2.5)
    found, known = (estimate_response(one, unit, cache=cache) for one in (measured, alone))
    assert within(found.contribution_ratio, 0.6, 4.0)
    assert found.contribution_ratio.std < 1.5 * known.contribution_ratio.std
    assert not found.warnings
    assert not found.refuted


def test_missing_phase_and_errors_widen_answer(cache):
    unit = load_unit("adss")
    measured = on_a_bench(simulate(unit, 0.5, SHORT, seed=5), seed=2)
    bare = FrequencyResponse.from_arrays(
        measured.frequency_hz,
        measured.source_vpk,
        np.abs(measured.gain),
        phase_known=False,
        unit="ADSS",
        settle_cycles=6,
        integrate_cycles=8,
    )
    full, less = (estimate_response(one, unit, cache=cache) for one in (measured, bare))
    assert within(less.contribution_ratio, 0.5, 4.0)
    assert less.contribution_ratio.std > 0.8 * full.contribution_ratio.std


def test_seed_gives_same_answer_with_cached_machines(tmp_path):
    unit = load_unit("adss")
    measured = on_a_bench(simulate(unit, 0.4, SHORT, seed=9), seed=3)
    new, kept = (
        estimate_response(measured, unit, seed=4, cache=tmp_path).to_json() for _ in range(2)
    )
    assert kept.pop("simulated_s") < 0.5 * new.pop("simulated_s")
    assert new == kept
    json.dumps(new, allow_nan=False)


@pytest.mark.parametrize(
    ("name", "truth"),
    [
        pytest.param("practice-09", 0.9328, marks=pytest.mark.long),
        # The dear one of the two; `make blind` runs it.
        pytest.param("practice-10", 0.5484, marks=pytest.mark.study),
    ],
)
def test_practice_sets_without_hidden_cause(name, truth):
    response = read_response(PRACTICE / f"{name}.csv")
    found: Estimate = estimate_response(response, load_unit(response.unit))
    low, high = found.contribution_ratio.interval95
    assert abs(found.contribution_ratio.value - truth) < 0.05
    assert low < truth < high
    assert found.contribution_ratio.std < 0.06
    assert not found.warnings


@pytest.mark.parametrize(
    "number",
    # It was advised on the wrong stage, as was 06; `make blind` runs these six more.
    [
        pytest.param("04", marks=pytest.mark.long),
        *(pytest.param(n, marks=pytest.mark.study) for n in ("02", "03", "05", "06", "07", "08")),
    ],
)
def test_hidden_causes_give_no_advice_before_diagnosis(number):
    response = read_response(PRACTICE / f"practice-{number}.csv")
    unit = load_unit(response.unit)
    document = estimate_response(response, unit).to_json()
    assert document["refuted"] is True
    advice = advise(accept_model(document), unit)
    assert advice.lines()[0].startswith("No advice before a diagnosis")
    assert "tage 1" not in " ".join(advice.lines())


@pytest.mark.parametrize(
    ("arf_hz", "rf_hz"), [(0.12, 0.14), (1e9, 2e9), (1.2e5, 1.4e5), (1.9, 100.0), (100.0, 2001.0)]
)
def test_frequencies_in_another_unit_are_refused(arf_hz, rf_hz):
    with pytest.raises(InputError, match="both must lie from 2 to 2000 Hz, .*; give them in Hz"):
        fit_features(arf_hz, rf_hz, load_unit("adss"))


@pytest.mark.study
def test_the_papers_edss_frequencies_are_warned_about():
    # No ratio brings the paper's model near 40 and 75 Hz: the least index is about 20 Hz.
    found = fit_features(40.0, 75.0, load_unit("edss"))
    least, std = found.curve.minimum
    assert 15.0 < least < 25.0
    assert least > 3.0 * std
    assert any("lacks something" in warning for warning in found.warnings)


@pytest.mark.parametrize(
    ("arf", "rf"), [(137.0, 128.0), (0.0, 100.0), (-5.0, 10.0), (float("nan"), 100.0)]
)
def test_impossible_frequencies_are_refused(arf, rf):
    with pytest.raises(InputError, match="ARF"):
        estimate_features(arf, rf, load_unit("adss"))
