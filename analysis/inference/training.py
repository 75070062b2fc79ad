"""Training of the posterior network with JAX: weights in, better weights out.

Owns the loss, the optimiser and the loop over batches of runs. The loss is the negative log
posterior probability of what is true, averaged over the prior (neural posterior estimation,
Greenberg et al. 2019). It is imported by whoever trains, and by nobody who answers.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import jax  # pyright: ignore[reportMissingImports] # an extra
import jax.numpy as jnp  # pyright: ignore[reportMissingImports] # an extra
import numpy as np
import optax  # pyright: ignore[reportMissingImports] # an extra

from analysis.inference.examples import ROWS, Examples, Scales, read_batch
from analysis.inference.network import Architecture, densities, set_logits, summarise
from analysis.inference.runs import Batch

__all__ = ["Progress", "Run", "Schedule", "Trainer"]

Run = tuple[Scales, Batch]
"""Runs, and the scales of the unit that they are of."""

_SHARES = {"set": 1.0, "ratio": 0.5, "size": 0.3, "error": 0.2, "total": 0.05}
"""How much each part of the loss counts. The set and the ratio are what is asked for."""

_POOL = 24
"""Batches that are mixed at a time, so that one step sees many sweeps."""


@dataclass(frozen=True)
class Schedule:
    """How long to train in all, and how fast.

    `steps` of `examples` each; `rate` the highest learning rate, after a warm-up of 2 % and
    before a cosine decay; `dropout` of the summary's units; `decay` of weights.
    """

    steps: int
    examples: int = 192
    rate: float = 1.2e-3
    dropout: float = 0.2
    decay: float = 0.05

    def rate_at(self, step: int) -> float:
        """Learning rate of a step."""
        share = step / self.steps
        return self.rate * min(
            share / 0.02 + 1e-3, 1.0, max(0.01, 0.5 + 0.5 * np.cos(np.pi * share))
        )


@dataclass(frozen=True)
class Progress:
    """What training came to: steps made, parts of the loss in the mean, and processor time, s."""

    steps: int
    loss: dict[str, float]
    processor_s: float


class Trainer:
    """Compiles one step of training and makes many; the optimiser's state goes on between calls.

    Parameters
    ----------
    scales, shape
        A unit whose sets of causes are told apart, and the network for it.
    schedule
        Of all calls of `train` together.
    """

    def __init__(self, scales: Scales, shape: Architecture, schedule: Schedule) -> None:
        self._schedule = schedule
        self._optimiser = optax.chain(
            optax.clip_by_global_norm(1.0),
            optax.scale_by_adam(b2=0.99),
            optax.add_decayed_weights(schedule.decay),
        )
        self._state: Any = None

        def step(weights: Any, state: Any, batch: Any, key: Any, rate: Any) -> Any:
            def loss(weights: Any) -> Any:
                parts = losses(scales, shape, weights, batch, key, schedule.dropout)
                return sum(_SHARES[name] * part for name, part in parts.items()), parts

            gradient, parts = jax.grad(loss, has_aux=True)(weights)
            change, state = self._optimiser.update(gradient, state, weights)
            return jax.tree.map(lambda w, c: w - rate * c, weights, change), state, parts

        self._step = jax.jit(step)

    def train(
        self, weights: dict[str, Any], runs: Sequence[Run], first: int, steps: int
    ) -> tuple[dict[str, Any], Progress]:
        """Make some steps of the schedule on some runs, from the step of a number.

        Weights, and what it came to.

        That number draws the order, the bench's part of the examples, and dropout.
        """
        if self._state is None:
            self._state = self._optimiser.init(weights)
        key, began_s, recent = jax.random.PRNGKey(first), time.process_time(), []
        stream = mixed_examples(runs, self._schedule.examples, np.random.default_rng([first, 1]))
        for number in range(first, first + steps):
            key, one = jax.random.split(key)
            some = next(stream)
            content = {name: getattr(some, name) for name in Examples.__slots__}
            rate = self._schedule.rate_at(number)
            weights, self._state, parts = self._step(weights, self._state, content, one, rate)
            recent.append(parts)
        mean = {name: float(np.mean([one[name] for one in recent])) for name in _SHARES}
        return (
            {name: np.asarray(weight) for name, weight in weights.items()},
            Progress(steps, mean, time.process_time() - began_s),
        )


def mixed_examples(runs: Sequence[Run], count: int, rng: np.random.Generator) -> Iterator[Examples]:
    """Examples in lots of `count`, from many batches at a time, for ever.

    A lot holds examples of the same number of rows.
    """
    pools: dict[int, list[Examples]] = {rows: [] for rows in ROWS}
    while True:
        order = rng.permutation(len(runs))
        for first in range(0, len(order), _POOL):
            for number in order[first : first + _POOL]:
                scales, batch = runs[number]
                some = read_batch(scales, batch, rng)
                pools[some.rows.shape[1]].append(some)
            for rows, pool in pools.items():
                if sum(map(len, pool)) < _POOL * count // 8:
                    continue
                mixed = Examples.joined(pool)
                mixed = mixed.taken(rng.permutation(len(mixed)))
                whole = len(mixed) // count * count
                for start in range(0, whole, count):
                    yield mixed.taken(slice(start, start + count))
                pools[rows] = [mixed.taken(slice(whole, None))]


def losses(
    scales: Scales, shape: Architecture, weights: Any, batch: Any, key: Any, dropout: float
) -> dict[str, Any]:
    """Negative log densities of what is true, by what they are of."""
    keys = jax.random.split(key, 3)

    def drop(layer: int, array: Any) -> Any:
        kept = jax.random.bernoulli(keys[layer], 1.0 - dropout, array.shape)
        return jnp.where(kept, array / (1.0 - dropout), 0.0)

    inputs = batch["points"], batch["rows"], batch["conditions"]
    summary = summarise(weights, shape, *inputs, dropout=drop, xp=jnp)
    logits = set_logits(weights, scales.sets, summary, jnp)
    found = densities(weights, shape, summary, batch["chosen"], jnp)
    bins = jnp.clip((batch["ratio"] * shape.bins).astype(int), 0, shape.bins - 1)
    cross = optax.softmax_cross_entropy_with_integer_labels
    return {
        "set": cross(logits, batch["set"]).mean(),
        "ratio": cross(found.ratio, bins).mean(),
        "size": _normal(batch["size"], found.size_mean, found.size_log_std),
        "error": _normal(batch["error"], found.error_mean, found.error_log_std),
        "total": _normal(batch["total"], found.total_mean, found.total_log_std),
    }


def _normal(value: Any, mean: Any, log_std: Any) -> Any:
    """Negative log of a normal density, where there is a value."""
    known = jnp.isfinite(value)
    z = (jnp.where(known, value, 0.0) - mean) * jnp.exp(-log_std)
    return jnp.where(known, 0.5 * z * z + log_std, 0.0).sum() / (known.sum() + 1.0)
