"""Weights of a trained posterior for a unit with other effects, sizes or datasheet values.

Owns which weights belong to which effect, size and value: what both units have keeps what was
learned of it, and what is new begins untrained. It trains nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.inference.checkpoint import Checkpoint
from analysis.inference.network import first_weights
from analysis.inference.prior import Prior

__all__ = ["Vocabulary", "transfer_weights", "vocabulary_of"]


Places = tuple[NDArray[np.int64], NDArray[np.int64]]

_DEPEND = ("single", "size", "error", "pair", "conditions", "hidden1", "given1")
"""Layers of which inputs or outputs are one for every effect, size or datasheet value."""


@dataclass(frozen=True)
class Vocabulary:
    """What a posterior tells apart: effects, (effect, parameter) of sizes, datasheet values."""

    effects: tuple[str, ...]
    sizes: tuple[tuple[str, str], ...]
    symbols: tuple[str, ...]


def vocabulary_of(prior: Prior) -> Vocabulary:
    """What a posterior for this prior tells apart."""
    sizes = tuple((effect, parameter.name) for effect, parameter in prior.parameters)
    return Vocabulary(prior.effects, sizes, prior.symbols)


def transfer_weights(trained: Checkpoint, known: Vocabulary, wanted: Vocabulary) -> Checkpoint:
    """The same network for another vocabulary.

    A value that is new has no influence at first, an effect that is new the probability of the
    prior.

    Parameters
    ----------
    trained
        A posterior of the vocabulary `known`.
    """
    counts = len(wanted.effects), len(wanted.sizes), len(wanted.symbols)
    before = trained.shape
    shape = replace(before, effects=counts[0], parameters=counts[1], symbols=counts[2])
    weights = first_weights(shape, np.random.default_rng(0))
    weights |= {k: w for k, w in trained.weights.items() if k.split(".")[0] not in _DEPEND}
    effects, sizes, symbols = (
        _places(a, b)
        for a, b in (
            (known.effects, wanted.effects),
            (known.sizes, wanted.sizes),
            (known.symbols, wanted.symbols),
        )
    )
    old = trained.weights

    def columns(name: str, places: Places, parts: int) -> None:
        """Outputs that come in `parts` blocks, each of one for every member."""
        source, target = places
        for kind in ("w", "b"):
            key = f"{name}.{kind}"
            was = old[key].reshape(*old[key].shape[:-1], parts, -1)
            now = weights[key].reshape(*weights[key].shape[:-1], parts, -1).copy()
            now[..., target] = was[..., source]
            weights[key] = now.reshape(weights[key].shape)

    columns("single", effects, 1)
    columns("size", sizes, 2)
    columns("error", symbols, 2)
    # Factors of pairs: every effect has a block of its own.
    source, target = effects
    for kind in ("w", "b"):
        key = f"pair.{kind}"
        was = old[key].reshape(*old[key].shape[:-1], before.effects, -1)
        now = weights[key].reshape(*weights[key].shape[:-1], shape.effects, -1).copy()
        now[..., target, :] = was[..., source, :]
        weights[key] = now.reshape(weights[key].shape)

    def rows(name: str, first: int, count: int, places: Places) -> None:
        """Inputs, of which those from `first` on are one for every member, then others."""
        source, target = places
        was = old[f"{name}.w"]
        now = np.zeros_like(weights[f"{name}.w"])
        now[:first] = was[:first]
        now[first + target] = was[first + source]
        others = len(now) - first - count
        if others:
            now[-others:] = was[-others:]
        weights[f"{name}.w"], weights[f"{name}.b"] = now, old[f"{name}.b"]

    rows("conditions", 0, shape.symbols, symbols)
    rows("hidden1", len(old["hidden1.w"]) - before.conditions, shape.symbols, symbols)
    rows("given1", before.hidden, shape.effects, effects)
    return replace(trained, shape=shape, weights=weights)


def _places(known: Sequence[object], wanted: Sequence[object]) -> Places:
    """Where what both have stands in the one and in the other."""
    at = {name: place for place, name in enumerate(known)}
    both = [(at[name], place) for place, name in enumerate(wanted) if name in at]
    pairs = np.array(both, dtype=np.int64).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]
