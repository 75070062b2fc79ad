"""The posterior network: from readings to the probability of every set of causes.

Owns the architecture and its arithmetic, written once for numpy (answers) and JAX (training).
Weights are a flat dictionary of arrays by name. It must not import a training library.

Readings enter as rows, one per level of each sweep, with points in ascending frequency.
Convolutions along frequency are shared by all rows, in stages that halve the number of points;
in each block the mean over rows is added back, so that the order and number of rows does not matter
(Zaheer et al. 2017, deep sets). Attention with learned queries pools points and rows (Lee et al.
2019). The logit of a set is

    log p(S) + c_|S| + sum_i a_i + sum_{i<j} b_ij,      b = U U' - V V'  of low rank,

and contribution ratio, sizes and datasheet errors have a density given the set (Radev et al. 2021,
amortised model comparison).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.inference.inputs import CHANNELS, ROW_FACTS
from analysis.inference.nominal import FACTS
from analysis.inference.sets import MOST_CAUSES, CauseSets

__all__ = ["Architecture", "Densities", "Weights", "densities", "first_weights", "set_logits"]

Weights = Mapping[str, Any]

_DILATIONS = (1, 2)
"""Spacing of the taps in the blocks of a stage, in turn."""

_RANK = 8
_GIVEN = 256
_LEAST_LOG_STD, _MOST_LOG_STD = -6.0, 3.0


@dataclass(frozen=True)
class Architecture:
    """Shape of the network.

    `effects`, `parameters`, `symbols`: how many effects, sizes and datasheet values there are.
    `widths`: channels of each stage; `blocks` of two convolutions in each; `hidden`: units of the
    summary; `queries`: of the attention; `bins`: of the contribution ratio.
    """

    effects: int
    parameters: int
    symbols: int
    widths: tuple[int, ...] = (32, 64, 96)
    blocks: int = 2
    hidden: int = 384
    queries: int = 16
    bins: int = 40

    @property
    def conditions(self) -> int:
        """What is known beforehand: tolerances, and whether total backlash, scatter, phase are."""
        return self.symbols + 3 + FACTS


@dataclass(frozen=True, slots=True, eq=False)
class Densities:
    """Densities of n answers given a set of causes.

    `ratio` (n, bins): logits over equal bins of 0 to 1. `size_mean`, `size_log_std` (n, P): of the
    position of each size in its range by logarithm. `error_mean`, `error_log_std` (n, T): of each
    datasheet error in units of its tolerance. `total_mean`, `total_log_std` (n,): of the logarithm
    of total backlash over the datasheet's.
    """

    ratio: Any
    size_mean: Any
    size_log_std: Any
    error_mean: Any
    error_log_std: Any
    total_mean: Any
    total_log_std: Any


def first_weights(shape: Architecture, rng: np.random.Generator) -> dict[str, NDArray[np.float32]]:
    """Weights before any training."""
    weights: dict[str, NDArray[np.float32]] = {}

    def linear(name: str, inputs: int, outputs: int, scale: float = 1.0) -> None:
        drawn = scale * rng.standard_normal((inputs, outputs)) / np.sqrt(inputs)
        weights[f"{name}.w"] = drawn.astype(np.float32)
        weights[f"{name}.b"] = np.zeros(outputs, dtype=np.float32)

    widths, hidden = shape.widths, shape.hidden
    linear("points", 3 * len(CHANNELS), widths[0])
    linear("rows", len(ROW_FACTS) + 1, widths[0])
    linear("conditions", shape.conditions, widths[0])
    for stage, width in enumerate(widths):
        if stage:
            linear(f"stage{stage}", 2 * widths[stage - 1], width)
        for block in range(shape.blocks):
            name = f"stage{stage}.block{block}"
            linear(f"{name}.along", 3 * width, width)
            linear(f"{name}.across", width, width, 0.3)
            linear(f"{name}.out", 3 * width, width, 0.3)
            for norm in ("first", "second"):
                weights[f"{name}.{norm}"] = np.ones(width, dtype=np.float32)
    width = widths[-1]
    linear("attention", width, shape.queries)
    linear("value", width, width)
    linear("hidden1", (shape.queries + 2) * width + shape.conditions, hidden)
    linear("hidden2", hidden, hidden)
    linear("hidden3", hidden, hidden)
    weights["hidden.norm"] = np.ones(hidden, dtype=np.float32)
    linear("count", hidden, MOST_CAUSES + 1, 0.1)
    linear("single", hidden, shape.effects, 0.1)
    linear("pair", hidden, shape.effects * 2 * _RANK, 0.1)
    linear("given1", hidden + shape.effects, _GIVEN)
    linear("given2", _GIVEN, _GIVEN)
    linear("ratio", _GIVEN, shape.bins, 0.1)
    linear("size", _GIVEN, 2 * shape.parameters, 0.1)
    linear("error", _GIVEN, 2 * shape.symbols, 0.1)
    linear("total", _GIVEN, 2, 0.1)
    return weights


def summarise(
    weights: Weights,
    shape: Architecture,
    points: Any,
    rows: Any,
    conditions: Any,
    dropout: Any = None,
    xp: Any = np,
) -> Any:
    """Summary (n, hidden) of readings.

    Parameters
    ----------
    points, rows
        (n, R, C, G) and (n, R, facts + 1): see `analysis.inference.inputs`; the last fact of a row
        is 1 where it is there, 0 where it is padding.
    conditions
        (n, conditions).
    dropout
        Function of (layer, array) that drops units in training.
    xp
        `numpy` or `jax.numpy`.
    """
    drop = dropout or (lambda layer, array: array)
    there = rows[:, :, -1]
    live = points[:, :, 0, :] * there[:, :, None]
    h = _along(xp.swapaxes(points, 2, 3), weights, "points", 1, xp)
    h = h + _linear(rows, weights, "rows")[:, :, None, :]
    h = h + _linear(conditions, weights, "conditions")[:, None, None, :]
    share = (there / there.sum(axis=1, keepdims=True))[:, :, None, None]
    for stage in range(len(shape.widths)):
        if stage:
            h = _linear(h.reshape(*h.shape[:2], -1, 2 * h.shape[3]), weights, f"stage{stage}")
            live = live.reshape(*live.shape[:2], -1, 2).max(axis=3)
        for block in range(shape.blocks):
            name = f"stage{stage}.block{block}"
            g = xp.maximum(_normed(h, weights[f"{name}.first"], xp), 0.0)
            g = _along(g, weights, f"{name}.along", _DILATIONS[block % len(_DILATIONS)], xp)
            mean = (g * share).sum(axis=1, keepdims=True)
            g = g + _linear(mean, weights, f"{name}.across")
            g = xp.maximum(_normed(g, weights[f"{name}.second"], xp), 0.0)
            h = h + _along(g, weights, f"{name}.out", 1, xp)
    h = h.reshape(h.shape[0], -1, h.shape[-1])
    held = live.reshape(live.shape[0], -1, 1)
    score = xp.where(held > 0, _linear(h, weights, "attention"), -1e9)
    attention = xp.exp(score - score.max(axis=1, keepdims=True))
    attention = attention / attention.sum(axis=1, keepdims=True)
    pooled = xp.einsum("ntq,ntw->nqw", attention, _linear(h, weights, "value"))
    mean = (h * held).sum(axis=1) / (held.sum(axis=1) + 1e-6)
    highest = xp.where(held > 0, h, -1e9).max(axis=1)
    z = xp.concatenate([pooled.reshape(len(pooled), -1), mean, highest, conditions], axis=-1)
    z = drop(0, _gelu(_linear(z, weights, "hidden1"), xp))
    z = z + drop(1, _gelu(_linear(z, weights, "hidden2"), xp))
    z = _normed(z, weights["hidden.norm"], xp)
    return z + drop(2, _gelu(_linear(z, weights, "hidden3"), xp))


def set_logits(weights: Weights, sets: CauseSets, summary: Any, xp: Any = np) -> Any:
    """Unnormalised log posterior probability (n, sets) of every set of causes."""
    factors = _linear(summary, weights, "pair").reshape(len(summary), -1, 2 * _RANK)
    like, unlike = factors[..., :_RANK], factors[..., _RANK:]
    first, second = sets.pairs
    pair = xp.einsum("nir,njr->nij", like, like) - xp.einsum("nir,njr->nij", unlike, unlike)
    singles, pairs = sets.incidence
    return (
        _linear(summary, weights, "count") @ sets.of_size
        + _linear(summary, weights, "single") @ singles
        + pair[:, first, second] @ (pairs / 4.0)
        + sets.log_prior.astype(np.float32)
    )


def densities(
    weights: Weights, shape: Architecture, summary: Any, chosen: Any, xp: Any = np
) -> Densities:
    """Densities given sets of causes: `chosen` (n, effects) is 1 for each member."""
    q = _gelu(_linear(xp.concatenate([summary, chosen], axis=-1), weights, "given1"), xp)
    q = q + _gelu(_linear(q, weights, "given2"), xp)
    sizes, errors, total = (_linear(q, weights, name) for name in ("size", "error", "total"))

    def log_std(values: Any) -> Any:
        return xp.clip(values, _LEAST_LOG_STD, _MOST_LOG_STD)

    return Densities(
        ratio=_linear(q, weights, "ratio"),
        size_mean=sizes[:, : shape.parameters],
        size_log_std=log_std(sizes[:, shape.parameters :]),
        error_mean=errors[:, : shape.symbols],
        error_log_std=log_std(errors[:, shape.symbols :]),
        total_mean=total[:, 0],
        total_log_std=log_std(total[:, 1]),
    )


def _linear(h: Any, weights: Weights, name: str) -> Any:
    return h @ weights[f"{name}.w"] + weights[f"{name}.b"]


def _along(h: Any, weights: Weights, name: str, dilation: int, xp: Any) -> Any:
    """Convolution of three taps along the points (n, R, G, channels)."""
    wide = xp.pad(h, ((0, 0), (0, 0), (dilation, dilation), (0, 0)))
    taps = [wide[:, :, : -2 * dilation], h, wide[:, :, 2 * dilation :]]
    return _linear(xp.concatenate(taps, axis=-1), weights, name)


def _gelu(h: Any, xp: Any) -> Any:
    return 0.5 * h * (1.0 + xp.tanh(0.7978845608 * (h + 0.044715 * h * h * h)))


def _normed(h: Any, gain: Any, xp: Any) -> Any:
    """Scaled to a root mean square of one over the channels (Zhang and Sennrich 2019)."""
    return h * gain / xp.sqrt((h * h).mean(axis=-1, keepdims=True) + 1e-6)
