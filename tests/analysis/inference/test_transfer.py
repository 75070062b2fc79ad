"""Weights of a posterior for a unit with other effects, sizes and datasheet values."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.inference.checkpoint import shipped_checkpoints
from analysis.inference.examples import conditions
from analysis.inference.inputs import CHANNELS, ROW_FACTS
from analysis.inference.network import densities, set_logits, summarise
from analysis.inference.nominal import FACTS
from analysis.inference.prior import COUNTS, Prior
from analysis.inference.sets import CauseSets
from analysis.inference.transfer import Vocabulary, transfer_weights, vocabulary_of
from sim.unit import load_unit

ADSS = vocabulary_of(Prior(load_unit("adss")))
NEW = ("own-effect", "a")


@pytest.fixture(scope="module")
def trained():
    return next(iter(shipped_checkpoints()))


def answers(checkpoint, vocabulary, shares, sets):
    """Logits of sets without their prior, by the names of members, and densities given one."""
    shape, rng = checkpoint.shape, np.random.default_rng(3)
    points = rng.standard_normal((1, 2, len(CHANNELS), 64)).astype(np.float32)
    points[:, :, 0] = 1.0
    rows = np.ones((1, 2, len(ROW_FACTS) + 1), dtype=np.float32)
    told = np.array([[shares.get(symbol, 0.0) for symbol in vocabulary.symbols]], np.float32)
    known = conditions(told, *(np.ones(1, dtype=bool) for _ in range(3)))
    facts = rng.standard_normal((1, FACTS)).astype(np.float32)
    summary = summarise(
        checkpoint.weights, shape, points, rows, np.concatenate([known, facts], axis=1)
    )
    every = CauseSets(vocabulary.effects, (1.0,) * shape.effects, COUNTS)
    logits = set_logits(checkpoint.weights, every, summary)[0] - every.log_prior
    number = {frozenset(every.names(i)): i for i in range(len(every.places))}
    chosen = np.zeros((1, shape.effects), dtype=np.float32)
    chosen[0, [vocabulary.effects.index(e) for e in ("load-inertia", "amplifier-lag")]] = 1.0
    given = densities(checkpoint.weights, shape, summary, chosen)
    sizes = dict(zip(vocabulary.sizes, given.size_mean[0], strict=True))
    errors = dict(zip(vocabulary.symbols, given.error_log_std[0], strict=True))
    return [logits[number[frozenset(s)]] for s in sets], given.ratio[0], sizes, errors


def changed(vocabulary):
    """Another order, an effect and a value less, and one more of each."""
    gone = vocabulary.effects[4]
    effects = (*reversed([e for e in vocabulary.effects if e != gone]), NEW[0])
    sizes = (NEW, *(s for s in vocabulary.sizes if s[0] != gone))
    symbols = ("bandwidth_hz", *(s for s in reversed(vocabulary.symbols) if s != "R_m"))
    return Vocabulary(effects, sizes, symbols)


def test_transferred_posterior_keeps_answers_of_shared_effects(trained):
    wanted = changed(ADSS)
    made = transfer_weights(trained, ADSS, wanted)
    assert (made.shape.effects, made.shape.parameters, made.shape.symbols) == (
        len(wanted.effects), len(wanted.sizes), len(wanted.symbols),
    )  # fmt: skip
    sets = [(), ("load-inertia",), ("amplifier-lag", "filter-corner"), ("gear-ratio",),
            ("load-inertia", "motor-constant", "reading-delay")]  # fmt: skip
    # A share of 0 is a number, too: all of what is left out is told alike.
    silent = transfer_weights(trained, ADSS, replace(ADSS, symbols=ADSS.symbols[:1]))
    assert silent.shape.symbols == 1
    shares = {"J_L": 0.05, "k_s1": 0.02, "R_m": 0.0}
    before = answers(trained, ADSS, shares, sets)
    same = answers(transfer_weights(trained, ADSS, ADSS), ADSS, shares, sets)
    np.testing.assert_array_equal(before[0], same[0])
    reordered = replace(wanted, symbols=tuple(reversed(ADSS.symbols)))
    after = answers(transfer_weights(trained, ADSS, reordered), reordered, shares, sets)
    np.testing.assert_allclose(after[0], before[0], atol=2e-3)
    np.testing.assert_allclose(after[1], before[1], atol=2e-3)
    for mine, theirs in ((after[2], before[2]), (after[3], before[3])):
        common = set(mine) & set(theirs)
        assert len(common) >= len(theirs) - 2
        for name in common:
            assert mine[name] == pytest.approx(theirs[name], abs=2e-3)


def test_untrained_symbol_has_no_influence(trained):
    """A tolerance that the network has not met says nothing to it."""
    more = replace(ADSS, symbols=(*ADSS.symbols, "bandwidth_hz"))
    made = transfer_weights(trained, ADSS, more)
    sets = [(), ("load-inertia",)]
    low, high = (answers(made, more, {"bandwidth_hz": s}, sets)[0] for s in (0.0, 0.3))
    np.testing.assert_array_equal(low, high)


@pytest.mark.parametrize("name", ["r3-1", "irb", "walkman-2300", "edss"])
def test_every_shipped_drive_accepts_paper_posterior_weights(name, trained):
    wanted = vocabulary_of(Prior(load_unit(name)))
    made = transfer_weights(trained, ADSS, wanted)
    logits = answers(made, wanted, {}, [(), ("load-inertia",)])[0]
    assert np.all(np.isfinite(logits))
