"""Reading of simulated sweeps, surfaces of features and the sums over the prior."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_t

from analysis.ensemble.model import Hypothesis
from analysis.paper_diagnosis.emulator import FREEDOM, Surface
from analysis.paper_diagnosis.evidence import RatioPrior, agree, log_density, reading_error
from analysis.paper_diagnosis.features import Reading, read_feature_sweep
from analysis.paper_diagnosis.pairs import guess_pairs
from analysis.paper_diagnosis.posterior import Knowledge, believe, index_of
from analysis.paper_diagnosis.simulation import Explored
from sim.unit import load_unit

READING = Reading(np.array([50.0, -20.0, 80.0, -5.0, 8.0]), np.full(5, 0.5))
EFFECTS = ("load-inertia", "load-viscous-damping", "tachometer-gain")
SLOPES = {
    "load-inertia": np.array([-20.0, 0.0, 0.0, 0.0, 0.0]),
    "load-viscous-damping": np.array([0.0, 12.0, 0.0, 0.0, 0.0]),
    "tachometer-gain": np.zeros(5),
}


def bump(f: np.ndarray, at: float, height: float, width: float) -> np.ndarray:
    return height / (1.0 + ((f - at) / width) ** 2)


def test_features_of_a_known_curve() -> None:
    f = np.linspace(30.0, 110.0, 321)
    gain = -15.0 + bump(f, 50.2, -10.0, 4.0) + bump(f, 80.6, 12.0, 6.0)
    arf, arf_db, rf, rf_db, width = read_feature_sweep(f, gain)
    # The tails of one bend the other a little.
    assert arf == pytest.approx(50.2, abs=0.15)
    assert rf == pytest.approx(80.6, abs=0.15)
    assert arf_db == pytest.approx(gain.min(), abs=0.01)
    assert rf_db == pytest.approx(gain.max(), abs=0.01)
    # 3.01 dB above a valley 10 dB deep: half width 4 sqrt(1/(1 - 0.301) - 1).
    assert width == pytest.approx(2.0 * 4.0 * np.sqrt(1.0 / 0.699 - 1.0), rel=0.05)


def test_falling_gain_does_not_hide_features() -> None:
    f = np.linspace(30.0, 110.0, 321)
    gain = -15.0 + bump(f, 50.0, -10.0, 3.0) + bump(f, 62.0, 6.0, 3.0) - 0.008 * (f - 30.0) ** 2
    arf, _, rf, _, _ = read_feature_sweep(f, gain)
    assert gain[-1] < gain[np.argmin(np.abs(f - arf))]
    assert arf == pytest.approx(50.0, abs=0.6)
    assert rf == pytest.approx(62.0, abs=0.6)


@pytest.mark.parametrize(
    "gain",
    [
        np.linspace(0.0, -30.0, 40),
        np.linspace(-30.0, 0.0, 40),
        np.zeros(40),
        np.full(40, -np.inf),
        np.where(np.arange(40) == 20, np.nan, -10.0),
        -10.0 + 0.1 * np.sin(np.arange(40.0)),
    ],
)
def test_absent_feature_is_not_read(gain: np.ndarray) -> None:
    assert np.isnan(read_feature_sweep(np.linspace(30.0, 110.0, 40), gain)).all()


def made(
    effects: tuple[str, ...], runs: int = 160, seed: int = 0, scatter: float = 0.8
) -> Explored:
    """A set whose features change with size as `SLOPES` say, and with the ratio not at all."""
    rng = np.random.default_rng(seed)
    hypothesis = Hypothesis(load_unit("edss"), effects)
    places = rng.uniform(size=(runs, hypothesis.d))
    centre = np.array([60.0, -30.0, 80.0, -5.0, 8.0])
    features = centre + scatter * rng.standard_normal((runs, 5))
    for k, effect in enumerate(effects):
        features += np.outer(places[:, 1 + k], SLOPES[effect])
    return Explored(hypothesis, Surface(places, features), np.tile([0.0, 1.0], (hypothesis.d, 1)))


def test_a_surface_finds_slope_scatter_and_correlation() -> None:
    rng = np.random.default_rng(3)
    places = rng.uniform(size=(400, 2))
    normal = rng.multivariate_normal(np.zeros(2), [[1.0, 0.8], [0.8, 1.0]], size=400)
    features = np.column_stack([100.0 + 30.0 * places[:, 1], np.full(400, -20.0)]) + normal
    features[::40] += 25.0  # runs on another branch
    features[::5, 1] = np.nan
    surface = Surface(places, features)
    mean, std, shown = surface.predict(np.array([[0.5, 0.3], [0.5, 0.7]]))
    assert mean[:, 0] == pytest.approx([109.0, 121.0], abs=1.0)
    assert std == pytest.approx(np.ones((2, 2)), abs=0.45)
    assert shown[:, 0] == pytest.approx([1.0, 1.0], abs=0.02)
    assert shown[:, 1] == pytest.approx([0.8, 0.8], abs=0.12)
    assert surface.correlation[0, 1] == pytest.approx(0.8, abs=0.15)


def test_feature_missing_in_all_runs_lowers_evidence() -> None:
    shown, hidden = made(("load-inertia",)), made(("load-inertia",))
    hidden.surface.features[:, 2:4] = np.nan
    a, b = (agree(x, READING, RatioPrior()) for x in (shown, hidden))
    assert np.isfinite(b.log_evidence)
    assert b.log_evidence < a.log_evidence - 5.0


def test_log_density_is_student_t() -> None:
    rng = np.random.default_rng(0)
    root = rng.standard_normal((5, 5))
    scale = root @ root.T + np.eye(5)
    apart = rng.standard_normal((7, 5))
    expected = multivariate_t(np.zeros(5), scale, df=FREEDOM).logpdf(apart)
    assert log_density(apart, np.tile(scale, (7, 1, 1))) == pytest.approx(expected)


def test_size_and_error_of_a_known_cause() -> None:
    """ARF falls by 20 Hz over the range, 10 Hz are seen: the size is a half."""
    one = made(("load-inertia",))
    reading = Reading(np.array([50.0, -30.0, 80.0, -5.0, 8.0]), np.full(5, 0.5))
    agreement = agree(one, reading, RatioPrior())
    mean, std = agreement.moments()
    assert mean[1] == pytest.approx(0.5, abs=0.06)
    # Scatter of 0.8, reading and tolerance of 0.5 Hz over a slope of 20 Hz.
    assert 0.03 < std[1] < 0.09
    assert mean[0] == pytest.approx(0.5, abs=0.1)
    assert std[0] == pytest.approx(np.sqrt(1.0 / 12.0), abs=0.06)


def test_evidence_ignores_useless_parameter_and_box() -> None:
    """A smaller box changes the volume only."""
    one = made(("load-inertia",))
    small = np.array([[0.0, 1.0], [0.25, 0.75]])
    whole, part = (agree(replace(one, box=box), READING, RatioPrior()) for box in (one.box, small))
    # All that agrees lies in the smaller box: the integral is the same, however it is taken.
    assert part.log_evidence == pytest.approx(whole.log_evidence, abs=0.25)
    assert part.log_volume == pytest.approx(np.log(0.5))


def test_unmeasured_number_has_no_influence() -> None:
    one = made(("load-inertia",))
    values = READING.values.copy()
    values[4] = np.nan
    blind = Reading(values, READING.std)
    wide = Reading(np.where(np.isnan(values), 500.0, values), READING.std)
    a, b = (agree(one, r, RatioPrior()) for r in (blind, wide))
    assert b.log_evidence < a.log_evidence - 3.0
    assert np.isnan(a.held_out()[0][4])
    assert np.isfinite(a.held_out()[0][:4]).all()
    assert reading_error(blind, load_unit("edss"))[4] == 0.0
    assert 0.0 <= a.probability_of_worse() <= 1.0


def test_held_out_prediction_uses_other_numbers_only() -> None:
    """ARF alone tells the size, so without it ARF is known no better than its range."""
    one = made(("load-inertia",))
    agreement = agree(one, READING, RatioPrior())
    mean, std = agreement.held_out()
    assert std[0] > 4.0
    assert std[2] < 1.5
    assert mean[2] == pytest.approx(80.0, abs=1.0)


@pytest.mark.parametrize("seed", range(3))
def test_a_known_ratio_is_kept(seed: int) -> None:
    one = made(("load-inertia",), seed=seed)
    prior = RatioPrior(0.04, 0.02)
    mean, std = agree(one, READING, prior).moments()
    assert mean[0] == pytest.approx(0.04, abs=0.015)
    assert std[0] < 0.03
    drawn = prior.draw(np.linspace(0.001, 0.999, 99))
    assert 0.0 <= drawn.min() < drawn.max() <= 1.0


def test_adequacy_is_calibrated() -> None:
    """Readings drawn from the likeliest place agree worse than one another evenly often."""
    one = made(("load-inertia",))
    agreement = agree(one, READING, RatioPrior())
    rng = np.random.default_rng(11)
    drawn = agreement.draw_runs(400, rng, at_best=True)
    mean, _ = agreement.at_best
    at = int(np.argmax(agreement.log_likelihood))
    inverse = np.linalg.inv(agreement.covariance[at])
    apart = drawn - mean
    squares = np.einsum("ni,ij,nj->n", apart, inverse, apart)
    here = READING.values - mean
    share = float(np.mean(squares > here @ inverse @ here))
    assert agreement.probability_of_worse() == pytest.approx(share, abs=0.07)


def test_pairs_are_guessed_additively_then_simulated() -> None:
    """Inertia takes ARF 10 Hz down, damping lifts it by 10 dB: only both give the reading."""
    baseline, *singles = (made(e) for e in ((), *((e,) for e in EFFECTS)))
    pairs = [
        ("load-inertia", "load-viscous-damping"),
        ("load-viscous-damping", "tachometer-gain"),
    ]
    first, second = guess_pairs(baseline, singles, READING, RatioPrior(), pairs)
    assert first.effects == pairs[0]
    assert first.log_evidence > second.log_evidence + 5.0
    assert first.box[1, 0] < 0.5 < first.box[1, 1]
    assert first.box[2, 0] < 10.0 / 12.0 < first.box[2, 1]
    both = made(pairs[0], runs=240)
    belief = believe([baseline, *singles, both], READING, Knowledge(RatioPrior()))
    assert belief.best.effects == pairs[0]
    assert belief.word == "explained"
    assert belief.inclusion()["load-inertia"] > 0.95
    before, after = index_of(belief.baseline.agreement), index_of(belief.best.agreement)
    # 10 Hz at ARF count twice, once more in the difference of both.
    assert before.value == pytest.approx(20.0, abs=1.5)
    assert after.value < 3.0
    assert after.expected == pytest.approx(after.floor, abs=1.5)


def test_useless_cause_lowers_the_probability() -> None:
    """Where the plain model is right, causes that change nothing stay less probable."""
    baseline, other = made(()), made(("tachometer-gain",))
    right = Reading(np.array([60.0, -30.0, 80.0, -5.0, 8.0]), np.full(5, 0.5))
    belief = believe([baseline, other], right, Knowledge(RatioPrior()))
    assert belief.word == "consistent"
    assert belief.baseline.probability == pytest.approx(0.63, abs=0.12)
    assert sum(one.probability for one in belief.judged) == pytest.approx(1.0)


def test_unreachable_features_are_unexplained() -> None:
    strange = Reading(np.array([60.0, -30.0, 80.0, -25.0, 8.0]), np.full(5, 0.5))
    sets = [made(()), made(("load-inertia",)), made(("load-viscous-damping",))]
    belief = believe(sets, strange, Knowledge(RatioPrior()))
    assert belief.word == "unexplained"
    assert belief.damping_alone is not None
    assert not belief.damping_is_enough
    assert np.isfinite(belief.behind(belief.damping_alone))
