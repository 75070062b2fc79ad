import numpy as np
import pytest

from analysis.inference.checkpoint import load_checkpoint
from analysis.inference.examples import Scales, read_batch
from analysis.inference.network import first_weights, set_logits, summarise
from analysis.inference.plans import Landmarks
from analysis.inference.prior import Prior
from sim.unit import load_unit

pytest.importorskip("jax", reason="training needs the extra `train`")

SMALL = {"widths": (8, 8), "blocks": 1, "hidden": 32, "queries": 2}


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """Two rounds of training, the second from the checkpoint of the first."""
    from analysis.inference.campaign import Rounds, train_unit

    folder = tmp_path_factory.mktemp("posterior")
    rounds = Rounds(batches=2, steps=40, examples=32, rate=3e-3)
    unit, told = load_unit("adss"), []
    for machines in (1, 100):
        train_unit(unit, folder, machines, rounds, SMALL, told=told.append)
    return folder, told


@pytest.mark.study
def test_training_goes_on_from_its_checkpoint(trained):
    folder, told = trained
    last = load_checkpoint(folder)
    assert [one.steps for one in told] == [40, 80]
    assert last.machines == told[-1].machines >= 100 > told[0].machines
    assert last.batches == 4


def test_numpy_computes_what_jax_trains():
    """One network, two array libraries: logits agree to single precision."""
    import jax.numpy as jnp

    scales = Scales(Prior(load_unit("adss")), Landmarks(116.0, 150.0))
    shape = scales.architecture(**SMALL)
    rng = np.random.default_rng(0)
    weights = first_weights(shape, rng)
    points = rng.standard_normal((3, 2, 14, 64)).astype(np.float32)
    points[:, :, 0] = 1.0
    rows = np.ones((3, 2, 6), dtype=np.float32)
    conditions = rng.standard_normal((3, shape.conditions)).astype(np.float32)
    content = points, rows, conditions
    ours = set_logits(weights, scales.sets, summarise(weights, shape, *content))
    summary = summarise(weights, shape, *content, xp=jnp)
    theirs = np.asarray(set_logits(weights, scales.sets, summary, jnp))
    np.testing.assert_allclose(ours, theirs, atol=2e-3)


@pytest.mark.study
def test_training_learns_what_a_batch_shows():
    """On one batch of runs the loss falls far below that of the prior."""
    from analysis.inference.runs import simulate_batch
    from analysis.inference.training import Schedule, Trainer

    scales = Scales(Prior(load_unit("adss")), Landmarks(116.0, 150.0))
    shape = scales.architecture(**SMALL)
    batch = simulate_batch(scales.prior, scales.marks, 1, 0)
    weights = first_weights(shape, np.random.default_rng(0))
    trainer = Trainer(scales, shape, Schedule(150, 32, 5e-3, dropout=0.0))
    weights, _ = trainer.train(weights, [batch], 1)
    _, progress = trainer.train(weights, [batch], 2)
    known = read_batch(scales, batch, np.random.default_rng(0))
    assert progress.loss["set"] < 0.6 * -scales.sets.log_prior[known.set].mean()
