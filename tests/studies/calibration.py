"""Simulation-based calibration of a trained posterior (Talts et al. 2018), as a picture.

Owns machines drawn from the prior that training has not seen, and where the truth lies in what the
network says of them. Ranks of a calibrated posterior are uniform. It trains and refines nothing.

    python tests/studies/calibration.py UNIT PICTURE [--batches 24] [--seed 7] [--runs FOLDER]
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from analysis.inference.checkpoint import Checkpoint
from analysis.inference.examples import Scales, read_batch
from analysis.inference.network import densities, set_logits, summarise
from analysis.inference.posterior import Posterior
from analysis.inference.runs import Batch, load_batch, save_batch, simulate_batch
from sim.unit import load_unit

sys.path.insert(0, str(Path(__file__).parents[1]))

from studies.compare import binned_calibration_error

Vector = NDArray[np.float64]

_BARS, _INTERVAL = 20, 0.95
_BELIEFS = np.linspace(0.0, 1.0, 11).tolist()


@dataclass(frozen=True, slots=True, eq=False)
class Ranks:
    """Where truths lie in their posteriors.

    `ratio`, `size`, `error` (each n): probability that the posterior gives to less than the truth.
    `believed` (n): probability of the likeliest set; `right` (n): whether it is the true one.
    """

    ratio: Vector
    size: Vector
    error: Vector
    believed: Vector
    right: NDArray[np.bool_]


def ranks_of(scales: Scales, known: Checkpoint, batch: Batch, rng: np.random.Generator) -> Ranks:
    """Ranks of the machines of a batch, ratio and sizes given the true set."""
    one = read_batch(scales, batch, rng)
    summary = summarise(known.weights, known.shape, one.points, one.rows, one.conditions)
    found = densities(known.weights, known.shape, summary, one.chosen)
    share = _softmax(np.asarray(found.ratio, dtype=float))
    place = one.ratio.astype(float) * share.shape[1]
    bins = np.minimum(place.astype(int), share.shape[1] - 1)
    rows = np.arange(len(share))
    below = np.cumsum(share, axis=1)[rows, bins] - share[rows, bins] * (1.0 - (place - bins))
    probability = _softmax(set_logits(known.weights, scales.sets, summary).astype(float))
    likeliest = probability.argmax(axis=1)
    return Ranks(
        below,
        _normal_ranks(one.size, found.size_mean, found.size_log_std),
        _normal_ranks(one.error, found.error_mean, found.error_log_std),
        probability[rows, likeliest],
        likeliest == one.set,
    )


def _softmax(logits: Vector) -> Vector:
    weight = np.exp(logits - logits.max(axis=1, keepdims=True))
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))


def _normal_ranks(truth: NDArray, mean: NDArray, log_std: NDArray) -> Vector:
    seen = np.isfinite(truth)
    return np.asarray(norm.cdf((truth - mean)[seen] / np.exp(log_std)[seen]))


def batches(scales: Scales, count: int, seed: int, folder: Path | None) -> Iterator[Batch]:
    """Batches of a seed that training does not use, kept in a folder if there is one."""
    for number in range(count):
        file = None if folder is None else folder / f"{seed}-{number:04d}.npz"
        if file is not None and file.exists():
            yield load_batch(file)
            continue
        made = simulate_batch(scales.prior, scales.marks, seed, number)
        if file is not None:
            file.parent.mkdir(parents=True, exist_ok=True)
            save_batch(file, made)
        yield made


def coverage(ranks: Vector) -> float:
    """Share of the truths inside their central 95 % interval."""
    tail = 0.5 * (1.0 - _INTERVAL)
    return float(np.mean((ranks > tail) & (ranks < 1.0 - tail)))


def draw(ranks: Ranks, title: str, picture: Path) -> None:
    """Rank histograms with the band in which 95 % of the bars of a calibrated posterior lie."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 5.6), layout="constrained")
    figure.suptitle(title, fontsize=10)
    places = figure.subplots(2, 2).ravel()
    for axes, name, values in zip(
        places,
        ("contribution ratio", "sizes of causes", "datasheet errors"),
        (ranks.ratio, ranks.size, ranks.error),
        strict=False,
    ):
        mean = len(values) / _BARS
        reach = 1.96 * np.sqrt(mean * (1.0 - 1.0 / _BARS))
        axes.axhspan(mean - reach, mean + reach, color="0.85")
        axes.hist(values, bins=_BARS, range=(0.0, 1.0), color="tab:blue", rwidth=0.9)
        axes.set(xlabel=f"rank of the true value: {name}", ylabel="count")
        axes.set_title(f"95 % intervals hold {100.0 * coverage(values):.1f} %", fontsize=9)
    axes = places[3]
    edges = np.quantile(ranks.believed, np.linspace(0.0, 1.0, 11))
    place = np.clip(np.searchsorted(edges, ranks.believed, side="right") - 1, 0, 9)
    said = [ranks.believed[place == one].mean() for one in range(10)]
    hit = [ranks.right[place == one].mean() for one in range(10)]
    error = [1.96 * np.sqrt(h * (1 - h) / np.sum(place == i)) for i, h in enumerate(hit)]
    axes.plot([0.0, 1.0], [0.0, 1.0], color="0.6")
    axes.errorbar(said, hit, error, fmt="o", color="tab:orange", markersize=4)
    axes.set(xlabel="probability of the likeliest set", ylabel="share of them that is true")
    wrong = binned_calibration_error(ranks.believed, ranks.right, _BELIEFS)
    axes.set_title(f"expected calibration error {wrong:.3f}", fontsize=9)
    figure.savefig(picture, dpi=110)


def main() -> None:
    """Simulate, rank, draw, and say what came out."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("unit")
    asked.add_argument("picture", type=Path)
    asked.add_argument("--batches", type=int, default=24)
    asked.add_argument("--seed", type=int, default=7)
    asked.add_argument("--runs", type=Path)
    given = asked.parse_args()
    unit = load_unit(given.unit)
    posterior = Posterior.find(unit)
    if posterior is None:
        raise SystemExit(f"no posterior for unit {given.unit}")
    rng = np.random.default_rng(given.seed)
    scales, known = posterior.scales, posterior.checkpoint
    parts = [
        ranks_of(scales, known, batch, rng)
        for batch in batches(scales, given.batches, given.seed, given.runs)
    ]
    whole = Ranks(*(np.concatenate([getattr(p, f) for p in parts]) for f in Ranks.__slots__))
    count = len(whole.ratio)
    draw(whole, f"{unit.name}: the network alone, {count:,} machines", given.picture)
    for name in ("ratio", "size", "error"):
        print(f"{name}: 95 % intervals hold {100.0 * coverage(getattr(whole, name)):.1f} %")
    wrong = binned_calibration_error(whole.believed, whole.right, _BELIEFS)
    print(f"sets: expected calibration error {wrong:.3f} over {count} machines")


if __name__ == "__main__":
    main()
