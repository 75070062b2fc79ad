import numpy as np
import pytest

from analysis.inference.checkpoint import (
    Checkpoint,
    find_checkpoint,
    posterior_name,
    read_checkpoint,
    write_checkpoint,
)
from analysis.inference.examples import Scales
from analysis.inference.inputs import CHANNELS, MOST_POINTS, SweptLevels, network_inputs
from analysis.inference.network import densities, first_weights, set_logits, summarise
from analysis.inference.plans import Landmarks, reference_response
from analysis.inference.posterior import Posterior, swept_levels
from analysis.inference.prior import Prior
from analysis.observation.observation import observe
from daq.configs import config_path
from daq.frf import FrequencyResponse
from sim.unit import load_unit


@pytest.fixture(scope="module")
def scales():
    return Scales(Prior(load_unit("adss")), Landmarks(116.0, 150.0), 5.0)


@pytest.fixture(scope="module")
def posterior(scales):
    shape = scales.architecture(widths=(8, 8), blocks=1, hidden=32, queries=2)
    rng = np.random.default_rng(0)
    weights = {k: w + 0.1 * rng.standard_normal(w.shape).astype(np.float32)
               for k, w in first_weights(shape, rng).items()}  # fmt: skip
    checkpoint = Checkpoint("ADSS", 116.0, 150.0, 5.0, shape, weights, 0)
    return Posterior(scales, checkpoint, lambda part: None)


def swept(gain, frequency_hz, levels_vpk, **changed):
    count = len(gain)
    content = {
        "frequency_hz": frequency_hz,
        "levels_vpk": np.asarray(levels_vpk, dtype=float),
        "gain": np.asarray(gain, dtype=np.complex64),
        "scatter": np.full(np.shape(gain), 0.01, dtype=np.float32),
        "noise_v": np.full(count, 5e-4, dtype=np.float32),
        "phase_known": np.ones((count, 1, 1), dtype=bool),
        "down": False,
        "settle_cycles": 20,
        "integrate_cycles": 30,
        "offset_v": 0.0,
    }
    return SweptLevels(**content | changed)


def read(scales, one):
    """Inputs of a sweep that departs nowhere from the datasheet's machine."""
    count, levels, points = one.gain.shape
    return scales.inputs(one, np.zeros((count, 4, levels, points), dtype=np.float32))


def test_reference_response_gives_zero_input(scales):
    """A response equal to the reference has no log gain and no phase beyond it."""
    frequency_hz = np.linspace(100.0, 180.0, 20)
    reference = reference_response(scales.prior.unit, frequency_hz)
    points, _ = read(scales, swept(reference[None, None], frequency_hz, [2.0]))
    for channel in ("gain", "phase_sin", "phase_cos"):
        np.testing.assert_allclose(points[0, 0, CHANNELS.index(channel), :20], 0.0, atol=1e-5)
    assert points[0, 0, 0].sum() == 20


@pytest.mark.parametrize("factor", [0.1, 2.0])
def test_factor_reads_as_log_gain(scales, factor):
    frequency_hz = np.linspace(100.0, 180.0, 20)
    gain = factor * reference_response(scales.prior.unit, frequency_hz)
    points, _ = read(scales, swept(gain[None, None], frequency_hz, [2.0]))
    expected = np.log(factor)
    np.testing.assert_allclose(points[0, 0, CHANNELS.index("gain"), :20], expected, rtol=1e-5)


def test_many_points_are_averaged_without_loss():
    frequency_hz = np.linspace(100.0, 180.0, 200)
    ramp = np.exp(np.linspace(0.0, 1.0, 200))
    one = swept(ramp[None, None], frequency_hz, [1.0])
    points, _ = network_inputs(
        one, np.ones(200), (110.0, 150.0), 5.0, np.zeros((1, 4, 1, 200), dtype=np.float32)
    )
    gain = points[0, 0, CHANNELS.index("gain")]
    assert gain.shape == (MOST_POINTS,)
    np.testing.assert_allclose(gain.mean(), 0.5, atol=0.01)
    assert np.all(np.diff(gain) > 0.0)


def test_missing_point_is_zero_in_every_channel(scales):
    frequency_hz = np.linspace(100.0, 180.0, 20)
    gain = np.ones((1, 1, 20), dtype=complex)
    gain[0, 0, 7] = np.nan
    points, _ = read(scales, swept(gain, frequency_hz, [2.0]))
    assert np.all(points[0, 0, :, 7] == 0.0)
    assert np.all(np.isfinite(points))


def inputs_of(posterior, levels, rng):
    scales = posterior.scales
    frequency_hz = np.linspace(100.0, 180.0, 30)
    gain = rng.standard_normal((2, len(levels), 30)) + 2.0
    points, facts = read(scales, swept(gain, frequency_hz, levels))
    rows = np.concatenate([facts, np.ones((2, len(levels), 1), dtype=np.float32)], axis=2)
    conditions = rng.standard_normal((2, posterior.checkpoint.shape.conditions))
    return points, rows, conditions.astype(np.float32)


def test_order_and_padding_of_levels_are_irrelevant(posterior):
    weights, shape = posterior.checkpoint.weights, posterior.checkpoint.shape
    points, rows, conditions = inputs_of(posterior, [1.0, 2.0, 3.0], np.random.default_rng(1))
    first = summarise(weights, shape, points, rows, conditions)
    turned = summarise(weights, shape, points[:, ::-1], rows[:, ::-1], conditions)
    np.testing.assert_allclose(turned, first, atol=2e-4)
    wide = np.pad(points, ((0, 0), (0, 2), (0, 0), (0, 0)))
    padded = summarise(weights, shape, wide, np.pad(rows, ((0, 0), (0, 2), (0, 0))), conditions)
    np.testing.assert_allclose(padded, first, atol=2e-4)
    changed = points.copy()
    changed[:, 1, CHANNELS.index("gain")] += 1.0
    assert np.abs(summarise(weights, shape, changed, rows, conditions) - first).max() > 1e-2


def test_set_logits_are_sums_over_members(posterior):
    """The logit of a triple holds its three singles and three pairs, by direct summation."""
    weights, sets = posterior.checkpoint.weights, posterior.scales.sets
    summary = np.random.default_rng(2).standard_normal((1, 32)).astype(np.float32)
    logits = set_logits(weights, sets, summary)[0] - sets.log_prior

    def linear(name):
        return (summary @ weights[f"{name}.w"] + weights[f"{name}.b"])[0]

    count, single = linear("count"), linear("single")
    factors = linear("pair").reshape(len(sets.effects), -1)
    like, unlike = np.split(factors, 2, axis=1)
    pair = (like @ like.T - unlike @ unlike.T) / 4.0
    for members in ((), (3,), (3, 11), (3, 11, 20)):
        expected = count[len(members)] + sum(single[i] for i in members)
        expected += sum(pair[i, j] for i in members for j in members if i < j)
        assert logits[sets.index[members]] == pytest.approx(expected, abs=1e-4)


def test_checkpoint_round_trip(posterior, tmp_path):
    write_checkpoint(tmp_path / "one.npz", posterior.checkpoint)
    loaded = read_checkpoint(tmp_path / "one.npz")
    assert loaded.shape == posterior.checkpoint.shape
    for name, values in posterior.checkpoint.weights.items():
        np.testing.assert_allclose(loaded.weights[name], values, rtol=2e-3, atol=1e-4)
    assert read_checkpoint(tmp_path / "elsewhere.npz") is None


def test_checkpoint_is_found_by_physics_alone(posterior, tmp_path):
    """Name, limits and tolerance do not matter; a changed inertia does; a damaged file is none."""
    unit = load_unit(str(config_path("templates", "two-stage")))
    file = tmp_path / posterior_name(unit)
    write_checkpoint(file, posterior.checkpoint)
    renamed = unit.model_copy(update={"name": "other"}).with_tolerance({"R_m": 0.1})
    assert find_checkpoint(renamed, tmp_path).shape == posterior.checkpoint.shape
    changed = unit.with_parameters(J_L=1.01 * unit.parameters["J_L"])
    assert find_checkpoint(changed, tmp_path) is None
    file.write_bytes(file.read_bytes()[:-200])
    assert find_checkpoint(unit, tmp_path) is None


def test_observation_reaches_network_in_order(posterior):
    """Two levels, one point without phase: every reading stands at its level and frequency."""
    frequency_hz = np.tile([100.0, 120.0, 140.0], 2)
    level = np.repeat([2.0, 1.0], 3)
    gain = (np.arange(6) + 1.0) * np.exp(0.3j)
    response = FrequencyResponse.from_arrays(frequency_hz, level, gain, unit="ADSS")
    seen = observe(response)
    (found,) = swept_levels(seen, seen.values[None])
    np.testing.assert_allclose(found.levels_vpk, [1.0, 2.0])
    np.testing.assert_allclose(np.abs(found.gain[0]), [[4.0, 5.0, 6.0], [1.0, 2.0, 3.0]], rtol=1e-5)
    np.testing.assert_allclose(np.angle(found.gain[0]), 0.3, rtol=1e-5)


def test_probabilities_without_effect(posterior):
    rng = np.random.default_rng(3)
    summary = rng.standard_normal((1, 32)).astype(np.float32)
    every = posterior.set_probabilities(summary)
    left = posterior.set_probabilities(summary, without=["load-inertia"])
    assert every.sum() == pytest.approx(1.0)
    assert left.sum() == pytest.approx(1.0)
    sets = posterior.scales.sets
    for number in np.flatnonzero(left == 0.0):
        assert "load-inertia" in sets.names(number)
    assert densities(
        posterior.checkpoint.weights,
        posterior.checkpoint.shape,
        summary,
        np.zeros((1, 29), dtype=np.float32),
    ).ratio.shape == (1, 40)
