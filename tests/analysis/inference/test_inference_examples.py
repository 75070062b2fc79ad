"""Examples: what a bench adds to runs, and what keeps a run from being learned by heart."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.inference.examples import Scales, read_batch
from analysis.inference.inputs import CHANNELS
from analysis.inference.plans import Landmarks
from analysis.inference.prior import Prior
from analysis.inference.runs import simulate_batch
from sim.unit import load_unit

VALID, GAIN = CHANNELS.index("valid"), CHANNELS.index("gain")


@pytest.fixture(scope="module")
def scales():
    return Scales(Prior(load_unit("adss")), Landmarks(116.0, 150.0), 5.0)


@pytest.fixture(scope="module")
def batch(scales):
    return simulate_batch(scales.prior, scales.marks, 5, 7)


def test_training_omits_band_in_half_of_examples(scales, batch):
    """A quarter of the points at most, at the same frequencies of every level."""
    lacking, rng = [], np.random.default_rng(1)
    for _ in range(12):
        valid = read_batch(scales, batch, rng).points[:, :, VALID]
        lacking.append(1.0 - (valid.sum(axis=2) / valid.sum(axis=2).max()).max(axis=1))
    share = np.concatenate(lacking)
    # Points that are lost one by one, and every second point, are rarer.
    assert 0.3 < np.mean(share > 0.02) < 0.8
    assert share.max() < 0.45


def test_a_measurement_lacks_no_band(scales, batch):
    valid = read_batch(scales, batch, np.random.default_rng(1), degrade=False).points[:, :, VALID]
    filled = valid.sum(axis=2)
    assert np.all((filled == filled.max()) | (filled == 0.0))


def test_readings_of_a_run_are_different_realisations(scales, batch):
    """As far apart as its cycle-to-cycle scatter allows, and no further."""
    scattered = replace(batch, variance=np.full_like(batch.variance, 0.5**2))
    steady = replace(batch, variance=np.zeros_like(batch.variance))

    def spread(runs):
        """Median standard deviation of log gain over readings, where every reading has it."""
        rng = np.random.default_rng(2)
        read = [read_batch(scales, runs, rng).points for _ in range(40)]
        alike = [p for p in read if p.shape == read[0].shape]
        gains = np.array([np.where(p[:, :, VALID] > 0, p[:, :, GAIN], np.nan) for p in alike])
        often = np.isfinite(gains).sum(axis=0) >= 5
        return np.median(np.nanstd(gains[:, often], axis=0))

    assert spread(scattered) > 1.3 * spread(steady)
