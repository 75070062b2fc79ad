"""Where groups of runs go about a place."""

import numpy as np
import pytest
from worlds import synthetic

from analysis.ensemble.model import Hypothesis
from analysis.inference.run_design import runs_about


@pytest.mark.parametrize(
    ("effects", "size_reach"),
    [
        (("load-inertia",), 0.06),
        (("payload-flexibility",), np.array([0.2, 0.04, 0.3])),
        (("load-inertia", "mesh1-damping"), 0.12),
    ],
)
@pytest.mark.parametrize("seed", range(3))
def test_sizes_and_ratio_cover_reach_evenly(effects, size_reach, seed):
    hypothesis = Hypothesis(synthetic.ADSS, effects)
    best, rng = np.full(hypothesis.d, 0.5), np.random.default_rng(seed)
    groups = list(runs_about(hypothesis, best, 4, rng, (0.14, size_reach)))
    reaches = np.broadcast_to(size_reach, hypothesis.d - 1)
    for sizes, reach in zip(np.array([group.sizes for group in groups]).T, reaches, strict=True):
        quarters = np.floor((sizes - 0.5 + reach) / (reach / 2.0))
        assert sorted(quarters) == [0, 1, 2, 3]
    for group in groups:
        offset = group.ratios - 0.5 + 0.14
        assert list(np.floor(offset / (0.14 / 2.5))) == list(range(5))


def test_groups_stay_inside_the_plausible_range():
    hypothesis = Hypothesis(synthetic.ADSS, ("amplifier-lag", "load-inertia"))
    rng = np.random.default_rng(1)
    for group in runs_about(hypothesis, np.array([1.0, 0.0, 1.0]), 8, rng, (0.3, 0.12)):
        assert np.all((group.places >= 0.0) & (group.places <= 1.0))


def test_plain_model_has_no_sizes_to_spread():
    rng = np.random.default_rng(2)
    groups = list(runs_about(Hypothesis(synthetic.ADSS), np.array([0.4]), 3, rng, (0.14, 0.06)))
    assert [group.sizes.shape for group in groups] == [(0,)] * 3
