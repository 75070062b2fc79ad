"""Where groups of runs go about a place."""

import numpy as np
import pytest
import synthetic

from analysis.causes import Hypothesis
from analysis.placement import groups_about, groups_beside


@pytest.mark.parametrize(
    ("effects", "ratio_reach", "size_reach"),
    [
        (("load-inertia",), 0.14, 0.06),
        # Where a payload resonates is known at first, how heavy it is less, and hardly its damping.
        (("payload-flexibility",), 0.14, (0.2, 0.04, 0.3)),
        (("load-inertia", "mesh1-damping"), 0.3, 0.12),
    ],
)
@pytest.mark.parametrize("seed", range(3))
def test_every_size_and_the_ratio_are_spread_evenly_over_the_reach(
    effects, ratio_reach, size_reach, seed
):
    hypothesis = Hypothesis(synthetic.ADSS, effects)
    best = np.full(hypothesis.d, 0.5)
    groups = list(groups_about(hypothesis, best, 4, np.random.default_rng(seed)))
    reaches = np.broadcast_to(size_reach, hypothesis.d - 1)
    for sizes, reach in zip(np.array([group.sizes for group in groups]).T, reaches, strict=True):
        quarters = np.floor((sizes - 0.5 + reach) / (reach / 2.0))
        assert sorted(quarters) == [0, 1, 2, 3]
    for group in groups:
        offset = group.ratios - 0.5 + ratio_reach
        assert list(np.floor(offset / (ratio_reach / 2.5))) == list(range(5))


def test_groups_stay_inside_the_plausible_range():
    hypothesis = Hypothesis(synthetic.ADSS, ("amplifier-lag", "load-inertia"))
    rng = np.random.default_rng(1)
    for group in groups_about(hypothesis, np.array([1.0, 0.0, 1.0]), 8, rng):
        assert np.all((group.places >= 0.0) & (group.places <= 1.0))


def test_the_plain_model_has_no_sizes_to_spread():
    groups = list(
        groups_about(Hypothesis(synthetic.ADSS), np.array([0.4]), 3, np.random.default_rng(2))
    )
    assert [group.sizes.shape for group in groups] == [(0,)] * 3


def test_groups_lie_no_farther_about_a_place_than_they_are_told():
    hypothesis = Hypothesis(synthetic.ADSS, ("load-inertia", "mesh1-damping"))
    rng = np.random.default_rng(4)
    for group in groups_about(hypothesis, np.full(3, 0.5), 5, rng, (0.12, 0.03)):
        assert np.all(abs(group.sizes - 0.5) <= 0.03)
        assert np.all(abs(group.ratios - 0.5) <= 0.12)


@pytest.mark.parametrize(
    ("further", "tried"),
    [
        # To either side of the datasheet's value, which is known: nothing is added there.
        ("shaft-stiffness", [[0.36], [0.64]]),
        ("mesh1-damping", [[0.4], [0.65]]),
        ("load-stribeck-friction", [[0.4, 0.4], [0.4, 0.65], [0.65, 0.4], [0.65, 0.65]]),
    ],
)
def test_a_further_cause_is_tried_at_sizes_all_over_its_range(further, tried):
    known, place = Hypothesis(synthetic.ADSS, ("load-inertia",)), np.array([0.9, 0.23])
    one = Hypothesis(synthetic.ADSS, (further,))
    rng = np.random.default_rng(5)
    groups = list(groups_beside(known, place, one, np.array([100.0, 180.0]), rng))
    assert [list(group.sizes) for group in groups] == [[0.23, *sizes] for sizes in tried]
    for group in groups:
        assert group.hypothesis.effects == ("load-inertia", further)
        assert np.all((group.ratios >= 0.7) & (group.ratios <= 1.0))


def test_what_resonates_by_itself_is_tried_in_the_band_that_was_measured():
    known = Hypothesis(synthetic.ADSS, ("motor-resistance",))
    payload = Hypothesis(synthetic.ADSS, ("payload-flexibility",))
    groups = groups_beside(
        known, np.array([0.5, 0.6]), payload, np.array([100.0, 180.0]), np.random.default_rng(6)
    )
    named = [dict(zip([p.name for _, p in g.hypothesis.parameters],
                      g.hypothesis.values(np.array([0.5, *g.sizes])), strict=True))
             for g in groups]  # fmt: skip
    resonances = sorted({round(one["f_p"], 6) for one in named})
    assert len(named) == 6
    assert resonances == pytest.approx([106.0, 134.2, 169.7], abs=0.1)
