from pathlib import Path
from shutil import copytree

import numpy as np
import pytest
from studies.calibration import coverage, ranks_of
from studies.compare import binned_calibration_error
from worlds.untrained import SIZE, SIZE_STD, Untrained

from analysis.inference.checkpoint import read_checkpoint
from analysis.inference.examples import Scales, read_batch
from analysis.inference.network import first_weights, set_logits, summarise
from analysis.inference.plans import Landmarks
from analysis.inference.prior import Prior
from analysis.inference.runs import load_batch
from sim.unit import load_unit

pytest.importorskip("jax", reason="training needs the extra `train`")

SMALL = {"widths": (8, 8), "blocks": 1, "hidden": 32, "queries": 2}


@pytest.fixture(scope="module")
def scales():
    return Scales(Prior(load_unit("adss")), Landmarks(116.0, 150.0), 5.0)


@pytest.fixture(scope="module", autouse=True)
def compiled_once(tmp_path_factory):
    """Every trainer compiles its step; equal ones are compiled once."""
    import jax

    jax.config.update("jax_compilation_cache_dir", str(tmp_path_factory.mktemp("compiled")))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    """A folder with the first batches of machines, which all of these tests train on."""
    from analysis.inference.campaign import Recipe, simulate_runs

    folder = tmp_path_factory.mktemp("runs")
    simulate_runs(Scales.of(load_unit("adss")), folder, 150, Recipe())
    return folder


@pytest.fixture
def runs(simulated, tmp_path):
    """The same in a folder of the test's own."""
    return Path(copytree(simulated, tmp_path / "runs"))


def test_numpy_network_equals_jax_network(scales):
    """One network, two array libraries: logits agree to single precision."""
    import jax.numpy as jnp

    shape = scales.architecture(**SMALL)
    rng = np.random.default_rng(0)
    weights = first_weights(shape, rng)
    points = rng.standard_normal((3, 2, 18, 64)).astype(np.float32)
    points[:, :, 0] = 1.0
    rows = np.ones((3, 2, 6), dtype=np.float32)
    conditions = rng.standard_normal((3, shape.conditions)).astype(np.float32)
    content = points, rows, conditions
    ours = set_logits(weights, scales.sets, summarise(weights, shape, *content))
    summary = summarise(weights, shape, *content, xp=jnp)
    theirs = np.asarray(set_logits(weights, scales.sets, summary, jnp))
    np.testing.assert_allclose(ours, theirs, atol=2e-3)


@pytest.mark.study
def test_training_fits_its_batch(scales, simulated):
    """On one batch of runs the loss falls far below that of the prior."""
    from analysis.inference.runs import load_batch
    from analysis.inference.training import Schedule, Trainer

    shape = scales.architecture(**SMALL)
    batch = load_batch(simulated / "000000.npz")
    weights = first_weights(shape, np.random.default_rng(0))
    trainer = Trainer(scales, shape, Schedule(300, 32, 5e-3, dropout=0.0))
    weights, _ = trainer.train(weights, [(scales, batch)], 0, 150)
    _, progress = trainer.train(weights, [(scales, batch)], 150, 150)
    known = read_batch(scales, batch, np.random.default_rng(0))
    assert progress.loss["set"] < 0.6 * -scales.sets.log_prior[known.set].mean()


@pytest.mark.study
def test_interrupted_training_resumes(runs, tmp_path):
    """Runs that are there are not simulated again, one that is missing is; steps are kept."""
    from analysis.inference.campaign import Recipe, train_unit

    unit, file = load_unit("adss"), tmp_path / "posterior.npz"
    recipe = Recipe(epochs=2.0, examples=32, rate=3e-3, shape=SMALL)
    told = []

    def stop(text):
        told.append(text)
        if text.startswith("step"):
            raise KeyboardInterrupt

    whole = {one: one.stat().st_mtime_ns for one in runs.glob("0*.npz")}
    missing = max(whole)
    missing.unlink()
    with pytest.raises(KeyboardInterrupt):
        train_unit(unit, file, runs, 150, recipe, told=stop)
    kept = {one: one.stat().st_mtime_ns for one in runs.glob("0*.npz")}
    assert {one for one in whole if kept[one] != whole[one]} == {missing}
    assert not file.exists(), "what is not trained to its end answers nothing"
    state = read_checkpoint(runs / "training.npz")
    assert state.steps > 0
    assert state.machines >= 90
    done = train_unit(unit, file, runs, 150, recipe)
    assert {one: one.stat().st_mtime_ns for one in runs.glob("0*.npz")} == kept
    assert done.steps == state.steps
    assert read_checkpoint(file).steps == done.steps


@pytest.mark.study
def test_worsening_training_keeps_old_weights(runs, tmp_path):
    """A learning rate that destroys the weights: those that were there are kept, and it is said."""
    from analysis.inference.campaign import Recipe, train_unit

    unit, file, told = load_unit("adss"), tmp_path / "posterior.npz", []
    first = train_unit(unit, file, runs, 150, Recipe(epochs=2.0, examples=32, shape=SMALL))
    (runs / "training.npz").unlink()
    again = train_unit(
        unit, file, runs, 150, Recipe(epochs=2.0, examples=32, rate=10.0), told=told.append
    )
    assert "which is kept" in told[-1]
    for name, values in first.weights.items():
        np.testing.assert_allclose(again.weights[name], values, rtol=2e-3, atol=1e-4)


def test_ranks_of_truth_match_its_density(simulated):
    """Untrained, the ratio has a flat density, of which the truth's rank is the ratio itself."""
    from scipy.stats import norm

    posterior, batch = Untrained(), load_batch(min(simulated.glob("[0-9]*.npz")))
    rng = np.random.default_rng(3)
    found = ranks_of(posterior.scales, posterior.checkpoint, batch, rng)
    np.testing.assert_allclose(found.ratio, batch.ratio, atol=1e-6)
    low, high = posterior.scales.size_ends.T
    place = ((np.log(np.abs(batch.sizes)) - low) / (high - low)).ravel()
    there = norm.cdf((place[np.isfinite(place)] - SIZE) / SIZE_STD)
    np.testing.assert_allclose(found.size, there, atol=1e-4)


def test_too_narrow_intervals_are_detected():
    ranks = np.random.default_rng(1).uniform(size=20_000)
    assert coverage(ranks) == pytest.approx(0.95, abs=0.006)
    assert coverage(np.round(ranks)) == 0.0
    right, edges = ranks < 0.6, (0.0, 0.5, 1.0)
    assert binned_calibration_error(np.full(20_000, 0.6), right, edges) < 0.02
    too_sure = binned_calibration_error(np.full(20_000, 0.9), right, edges)
    assert too_sure == pytest.approx(0.3, abs=0.02)
