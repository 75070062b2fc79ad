"""How large a cause could be and not show: what is ruled out, and what is hidden is not."""

from dataclasses import dataclass
from types import SimpleNamespace

import hidden
import numpy as np
import pytest

from analysis import bounds
from analysis.agreement import TAIL, TAIL_SCALE
from analysis.atlas import coarse_stride, make_atlas
from analysis.bounds import bound_beside, bound_causes
from analysis.calibration import Calibrated
from analysis.causes import Hypothesis
from analysis.hunt import Hunt
from analysis.observation import observe
from analysis.screening import Added, Additions, screen_singles
from analysis.sizing import size_candidate
from analysis.unseen import Unseen, describe_unseen, list_unseen
from daq.plan import SweepPlan, spaced_frequencies
from sim.effects import parse_effect
from sim.response import simulate
from sim.unit import load_unit

ADSS = load_unit("adss")
RULED_OUT = 10.0
PLAIN = 500.0


@dataclass
class Known:
    """A surface whose log-likelihood is known: a parabola in the size, whatever the ratio is."""

    best: float
    at: float
    curvature: float

    def scan(self, grid):
        size = grid[:, 1] if grid.shape[1] > 1 else np.full(len(grid), self.at)
        return self.best - self.curvature * (size - self.at) ** 2 - (grid[:, 0] - 0.3) ** 2


def bound(monkeypatch, effect, best, at, curvature, felt=None):
    """What is told of one cause with such a surface, and another by what the load is felt as."""
    key = (effect,)
    surfaces = {(): Known(PLAIN, 0.0, 0.0), key: Known(best, at, curvature)}
    monkeypatch.setattr(bounds, "surfaces_of", lambda *_: surfaces)
    more = {} if felt is None else {key: Known(felt, at, curvature)}
    monkeypatch.setattr(bounds, "felt_singles", lambda *_: more)
    (found,) = bound_causes(ADSS, None, {})
    return found


def size_at(effect, coordinate):
    return float(Hypothesis(ADSS, (effect,)).values(np.array([0.3, coordinate]))[0])


STEP = 1.0 / 60.0
"""How far apart sizes are looked at."""


def test_a_cause_that_may_be_absent_is_bounded_above_at_the_first_size_that_is_ruled_out(
    monkeypatch,
):
    # 10 less at 0.5 beyond its best.
    found = bound(monkeypatch, "cable-stiffness", PLAIN, 0.1, RULED_OUT / 0.5**2)
    low, high = size_at("cable-stiffness", 0.6), size_at("cable-stiffness", 0.6 + 2 * STEP)
    assert (found.low, found.datasheet) == (None, None)
    assert low < found.high <= high


def test_a_datasheet_value_is_bounded_both_ways(monkeypatch):
    found = bound(monkeypatch, "load-inertia", PLAIN, 0.5, RULED_OUT / 0.1**2)
    assert size_at("load-inertia", 0.4 - 2 * STEP) <= found.low < size_at("load-inertia", 0.4)
    assert size_at("load-inertia", 0.6) < found.high <= size_at("load-inertia", 0.6 + 2 * STEP)
    assert found.low < found.datasheet < found.high


def test_what_does_nothing_where_it_is_large_is_bounded_below(monkeypatch):
    found = bound(monkeypatch, "amplifier-saturation", PLAIN, 1.0, RULED_OUT / 0.2**2)
    assert found.high is None
    assert size_at("amplifier-saturation", 0.8 - 2 * STEP) <= found.low
    assert found.low < size_at("amplifier-saturation", 0.8)


def test_what_its_runs_do_worse_where_the_cause_does_nothing_speaks_against_no_size(monkeypatch):
    # They lie further apart than the plain model's, and are 40 behind these where it is the same.
    found = bound(monkeypatch, "load-inertia", PLAIN - 40.0, 0.5, RULED_OUT / 0.1**2)
    assert found == bound(monkeypatch, "load-inertia", PLAIN, 0.5, RULED_OUT / 0.1**2)


def test_what_is_ruled_out_at_every_size_is_below_the_least_and_what_is_at_none_may_be_any(
    monkeypatch,
):
    found = bound(monkeypatch, "cable-stiffness", PLAIN - 11.0, 0.0, 1.0)
    assert found.high == pytest.approx(size_at("cable-stiffness", 0.0))
    found = bound(monkeypatch, "cable-stiffness", PLAIN, 0.0, 1.0)
    assert (found.low, found.high) == (None, None)


def test_what_is_felt_alike_speaks_for_a_size_too(monkeypatch):
    alone = bound(monkeypatch, "cable-stiffness", PLAIN - 11.0, 0.0, 40.0)
    felt = bound(monkeypatch, "cable-stiffness", PLAIN - 11.0, 0.0, 40.0, felt=PLAIN)
    assert felt.high > size_at("cable-stiffness", 0.5) > alone.high


ROWS, SCATTER = 40, 0.1


def beside(monkeypatch, effect, slope, offset=0.0, left=0.0, wider=0.0):
    """What is told of a cause that adds so much per coordinate beside one that was found.

    `offset`: what the sum gets wrong at all sizes; `left`: what the one that was found leaves;
    `wider`: how much wider single runs of it scatter at its largest, as a share.
    """
    hypothesis = Hypothesis(ADSS, (effect,))
    coordinates = (np.arange(13) + 0.5) / 13
    known = hypothesis.datasheet[0]
    size = coordinates - (0.5 / 13 if np.isnan(known) else known)
    shift = np.tile((slope * size + offset)[None, :, None], (15, 1, 3 * ROWS))
    scatter = SCATTER * (1.0 + wider * coordinates)
    std = np.tile(scatter[None, :, None], (15, 1, 3 * ROWS))
    added = Added(coordinates[:, None], shift, std)
    additions = Additions(None, None, {(effect,): added, FOUND: added}, {})
    monkeypatch.setattr(bounds, "add_causes", lambda *_: additions)
    monkeypatch.setattr(bounds, "rows_of", lambda *_: np.arange(ROWS))
    shown = np.full((3, ROWS), left), np.full((3, ROWS), SCATTER)
    found = SimpleNamespace(
        hypothesis=Hypothesis(ADSS, FOUND),
        population=SimpleNamespace(places=np.array([[0.2, 0.3], [0.4, 0.5]])),
        surface=SimpleNamespace(observation=None, expected=lambda place: shown),
        best=SimpleNamespace(place=np.array([0.3, 0.4])),
    )
    (one,) = bound_beside(ADSS, None, {}, found, Calibrated(np.array([0.3, 0.4]), np.eye(2) / 100))
    return one


FOUND = ("filter-corner",)
AGAINST = 60.0


def apart_at(loss):
    """By how much all rows lie off where they lose so much of Student's t together."""
    each = np.expm1(2.0 * loss / (3 * ROWS * (TAIL + 1.0)))
    return TAIL_SCALE * SCATTER * float(np.sqrt(TAIL * each))


def test_beside_what_was_found_a_cause_is_bounded_by_what_it_would_add(monkeypatch):
    # Ruled out from 0.4 above nothing on.
    found = beside(monkeypatch, "cable-stiffness", apart_at(AGAINST) / 0.4)
    at = 0.5 / 13 + 0.4
    assert found.low is None
    assert size_at("cable-stiffness", at) <= found.high <= size_at("cable-stiffness", at + STEP)
    both = beside(monkeypatch, "load-inertia", apart_at(AGAINST) / 0.1)
    known = Hypothesis(ADSS, ("load-inertia",)).datasheet[0]
    assert size_at("load-inertia", known - 0.1 - STEP) <= both.low
    assert both.low <= size_at("load-inertia", known - 0.1)
    assert size_at("load-inertia", known + 0.1) <= both.high
    assert both.high <= size_at("load-inertia", known + 0.1 + STEP)


def test_what_a_sum_gets_wrong_where_a_cause_does_nothing_speaks_against_no_size(monkeypatch):
    off = 2.0 * apart_at(AGAINST)
    found = beside(monkeypatch, "load-inertia", apart_at(AGAINST) / 0.05, offset=off)
    assert found.low < found.datasheet < found.high


def test_what_would_take_away_what_is_left_is_not_ruled_out(monkeypatch):
    slope = apart_at(AGAINST) / 0.2
    # What was found leaves as much as a cable 0.6 above nothing would add.
    found = beside(monkeypatch, "cable-stiffness", slope, left=-0.6 * slope)
    assert (found.high or np.inf) > size_at("cable-stiffness", 0.5 / 13 + 0.6)


def test_that_runs_of_a_cause_lie_far_apart_speaks_against_no_size(monkeypatch):
    found = beside(monkeypatch, "cable-stiffness", 0.0, wider=2.0)
    assert (found.low, found.high) == (None, None)


@pytest.mark.parametrize(
    ("low", "high", "datasheet", "said"),
    [
        (None, 108.31, None, "K below 108 N.m/rad"),
        (17.02, None, None, "K above 17 N.m/rad"),
        (3.914, 4.2, 4.1, "K 3.91 to 4.2 N.m/rad (datasheet 4.1)"),
        (None, None, None, "K of any size N.m/rad"),
    ],
)
def test_bounds_are_told_in_words(low, high, datasheet, said):
    one = Unseen("cable-stiffness", "K", "N.m/rad", low, high, datasheet)
    assert describe_unseen(one.to_json()) == said.replace("size N.m/rad", "size")


def test_what_nothing_is_said_of_is_told_in_one_line_at_the_end():
    entries = [
        Unseen("payload-flexibility", "J_p", "kg.m^2", None, None, None),
        Unseen("load-inertia", "J_L", "kg.m^2", 0.0026, 0.0029, 0.00275),
        Unseen("shaft-hardening", "h", "", None, None, None),
    ]
    told = list_unseen([one.to_json() for one in entries])
    assert told == [
        "load-inertia: J_L 0.0026 to 0.0029 kg.m^2 (datasheet 0.00275)",
        "of any size: payload-flexibility, shaft-hardening",
    ]
    assert list_unseen([entries[1].to_json()]) == told[:1]


def swept(unit, effects, ratio, seed):
    """The usual sweep of a machine off its datasheet, on the rows of its atlas; and that atlas."""
    rng = np.random.default_rng(seed)
    machine = hidden.off_datasheet(unit, rng)
    band = hidden.BANDS_HZ[unit.name.lower()]
    plan = SweepPlan(spaced_frequencies(*band, 61), hidden.LEVELS_VPK)
    response = hidden.reading(simulate(machine, ratio, plan, effects=effects, seed=seed), rng)
    seen = observe(response)
    few = seen.thinned(coarse_stride(seen)).with_noise(hidden.NOISE_V)
    return few, make_atlas(unit, few)


def told(bounded):
    return {one.effect: one for one in bounded}


def test_what_a_plain_servo_shows_rules_out_what_no_sweep_would_miss():
    seed = int(np.random.SeedSequence().entropy % 2**31)
    ratio = float(np.random.default_rng(seed).uniform(0.1, 0.9))
    found = told(bound_causes(ADSS, *swept(ADSS, (), ratio, seed)))
    for text in hidden.LARGE:
        effect = parse_effect(text)
        ((_, size),) = effect.values.items()
        assert not may_be(found[effect.id], size), f"{text}, seed {seed}"


SMALL = (
    "load-inertia",
    "load-coulomb-friction",
    "load-viscous-damping",
    "shaft-stiffness",
    "motor-resistance",
    "filter-corner",
)


def test_a_small_cause_that_is_there_is_not_ruled_out():
    # Of 176 drawn so, either unit and all causes, one was; with one in sixty two of three are rarer
    # than one in a thousand.
    ruled_out = []
    for seed, unit, rng in drawn(3):
        cause, settings, size = small(
            unit, rng.choice(SMALL), ratio := rng.uniform(0.05, 0.95), rng
        )
        one = told(bound_causes(unit, *swept(unit, settings, ratio, seed)))[cause]
        if not may_be(one, size):
            ruled_out.append((seed, one, size))
    assert len(ruled_out) < 2, ruled_out


def drawn(count):
    """So many seeds of chance, each with a unit and what else is drawn from it."""
    for sequence in np.random.SeedSequence().spawn(count):
        seed = int(sequence.generate_state(1)[0] % 2**31)
        rng = np.random.default_rng(seed)
        yield seed, load_unit(str(rng.choice(["adss", "edss"]))), rng


def small(unit, effect, ratio, rng):
    """A cause hardly beyond what the datasheet has, or the least that is looked at."""
    hypothesis = Hypothesis(unit, (str(effect),))
    known = hypothesis.datasheet[0]
    least = 0.0 if np.isnan(known) else known - (0.06 if hypothesis.centred else 0.0)
    place = np.array([ratio, least + rng.uniform(0.0, 0.12)])
    return str(effect), hypothesis.settings(place), hypothesis.values(place)[0]


FOUND_FIRST = ("amplifier-saturation", "mesh2-damping", "shaft-damping", "tachometer-gain")


def test_a_small_cause_beside_a_larger_one_is_not_ruled_out_and_a_large_one_is():
    # Of 137 drawn so none was; were it one in fifty, two of three would be rarer than one in 800.
    ruled_out = []
    for seed, unit, rng in drawn(3):
        first, ratio = str(rng.choice(FOUND_FIRST)), rng.uniform(0.05, 0.95)
        cause, settings, size = small(unit, rng.choice(SMALL), ratio, rng)
        effects = (hidden.drawn_effect(unit, first, rng), *settings)
        few, atlas = swept(unit, effects, ratio, seed)
        found = hunted(unit, few, atlas, (first,), rng)
        sharp = size_candidate(found, few, rng)
        bounded = told(bound_beside(unit, few, atlas, found, sharp))
        assert first not in bounded
        assert not may_be(bounded["load-viscous-damping"], 0.4), seed
        if not may_be(bounded[cause], size):
            ruled_out.append((seed, first, bounded[cause], size))
    assert len(ruled_out) < 2, ruled_out


def hunted(unit, few, atlas, effects, rng):
    """The candidate of some causes that a search would have, on few rows."""
    hunt = Hunt(unit, few, rng, None, None, hidden.NOISE_V)
    glance = screen_singles(unit, few, atlas, [effects])[effects]
    hunt.start({effects: glance.place}, 8)
    if glance.other is not None:
        hunt.start({effects: glance.other}, 4)
    for _ in range(3):
        hunt.settle([effects], 6)
    return hunt.found[effects]


def may_be(one, size):
    return (one.low or 0.0) <= size <= (one.high or np.inf)
