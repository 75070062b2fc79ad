"""Simulation and training of one unit's posterior, in rounds, from a checkpoint onward.

Owns the order of the work: draw batches, keep the latest of them, train on these, measure on
batches that training never sees, and save. It may be interrupted at any moment and loses one round
at most. Answers are made by `analysis.inference.posterior`.

    python -m analysis.inference.campaign --unit adss --machines 20000 --folder FOLDER
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.executor import LocalExecutor
from analysis.inference.checkpoint import Checkpoint, load_checkpoint, save_checkpoint
from analysis.inference.examples import Scales, read_batch
from analysis.inference.network import densities, first_weights, set_logits, summarise
from analysis.inference.plans import landmarks
from analysis.inference.prior import Prior
from analysis.inference.runs import Batch, simulate_batch
from analysis.inference.training import Schedule, Trainer
from daq.errors import AnalysisError
from sim.unit import Unit, load_unit

__all__ = ["Rounds", "measure", "train_unit"]

_HELD_OUT_SEED = 1_000_003
"""Added to the seed of training for batches that training never sees."""


@dataclass(frozen=True)
class Rounds:
    """How the work is divided.

    `batches` are simulated in a round; the latest `kept` of all rounds are trained on, for `steps`
    steps a round.
    """

    batches: int = 60
    kept: int = 4000
    steps: int = 300
    examples: int = 192
    rate: float = 8e-4


def train_unit(
    unit: Unit,
    folder: Path,
    machines: int,
    rounds: Rounds | None = None,
    shape: dict[str, Any] | None = None,
    seed: int = 1,
    told: Callable[[Checkpoint], None] = lambda checkpoint: None,
) -> Checkpoint:
    """Go on until so many machines were simulated, from the checkpoint in a folder.

    Parameters
    ----------
    shape
        Of a new network; see `analysis.inference.network.Architecture`.
    told
        Told of the checkpoint after each round.
    """
    rounds = rounds or Rounds()
    scales = Scales(Prior(unit), landmarks(unit))
    state = load_checkpoint(folder)
    if state is None:
        network = scales.architecture(**shape or {})
        weights = first_weights(network, np.random.default_rng(seed))
        state = Checkpoint(unit.name, network, weights, seed)
    schedule = Schedule(rounds.steps, rounds.examples, rounds.rate)
    trainer = Trainer(scales, state.shape, schedule)
    recent: list[Batch] = []
    held_out = _simulated(scales, state.seed + _HELD_OUT_SEED, range(rounds.batches // 3 + 1))
    while state.machines < machines:
        numbers = range(state.batches, state.batches + rounds.batches)
        fresh = _simulated(scales, state.seed, numbers)
        recent = [*recent, *fresh][-rounds.kept :]
        weights, _ = trainer.train(state.weights, recent, state.seed + state.steps)
        state = replace(
            state,
            weights=weights,
            batches=numbers.stop,
            machines=state.machines + sum(map(len, fresh)),
            steps=state.steps + rounds.steps,
        )
        state = replace(state, figures=measure(scales, state, held_out))
        save_checkpoint(folder, state)
        told(state)
    return state


def measure(scales: Scales, state: Checkpoint, batches: list[Batch]) -> dict[str, float]:
    """Figures on runs that training has not seen.

    ``nll``: negative log probability of the true set, in the mean. ``first_k``: share of sets of k
    causes that come first; ``five_k``: among the first five. ``sure``: share of answers at 0.95 or
    more; ``sure_right``: share of these that are right. ``ratio_error``: median.
    """
    parts = [read_batch(scales, one, np.random.default_rng(3), degrade=False) for one in batches]
    probability, ratios = [], []
    for some in parts:
        summary = summarise(state.weights, state.shape, some.points, some.rows, some.conditions)
        logits = set_logits(state.weights, scales.sets, summary)
        weight = np.exp(logits - logits.max(axis=1, keepdims=True))
        probability.append(weight / weight.sum(axis=1, keepdims=True))
        found = densities(state.weights, state.shape, summary, some.chosen).ratio
        belief = np.exp(found - found.max(axis=1, keepdims=True))
        centres = (np.arange(state.shape.bins) + 0.5) / state.shape.bins
        ratios.append(belief @ centres / belief.sum(axis=1))
    true = np.concatenate([some.set for some in parts])
    missed = np.concatenate(ratios) - np.concatenate([some.ratio for some in parts])
    return _figures(scales, true, np.concatenate(probability), missed)


def _figures(
    scales: Scales, true: NDArray[np.int32], probability: np.ndarray, missed: np.ndarray
) -> dict[str, float]:
    of_truth = probability[np.arange(len(true)), true]
    rank = (probability > of_truth[:, None]).sum(axis=1)
    sure = probability.max(axis=1) >= 0.95
    figures = {
        "nll": float(-np.log(np.maximum(of_truth, 1e-12)).mean()),
        "sure": float(sure.mean()),
        "sure_right": float((rank[sure] == 0).mean()) if sure.any() else 1.0,
        "ratio_error": float(np.median(np.abs(missed))),
    }
    causes = scales.sets.sizes[true]
    for count in np.unique(causes):
        some = rank[causes == count]
        figures[f"first_{count}"] = float((some == 0).mean())
        figures[f"five_{count}"] = float((some < 5).mean())
    return figures


def _simulated(scales: Scales, seed: int, numbers: range) -> list[Batch]:
    """Batches of these numbers, each on a core; one whose motion grew without bound is left out."""
    one_core = LocalExecutor(1)

    def simulated(number: int) -> Batch | None:
        try:
            return simulate_batch(scales.prior, scales.marks, seed, number, one_core)
        except AnalysisError:
            return None

    with ThreadPoolExecutor(LocalExecutor().cores) as pool:
        return [batch for batch in pool.map(simulated, numbers) if batch is not None]


def main(arguments: list[str]) -> int:
    """Train, and print the figures of every round."""
    parser = argparse.ArgumentParser(prog="python -m analysis.inference.campaign")
    parser.add_argument("--unit", required=True)
    parser.add_argument("--machines", type=int, required=True)
    parser.add_argument("--folder", type=Path, required=True)
    given = parser.parse_args(arguments)

    def told(state: Checkpoint) -> None:
        figures = ", ".join(f"{name} {value:.3f}" for name, value in state.figures.items())
        sys.stderr.write(f"{state.machines} machines, {state.steps} steps: {figures}\n")

    train_unit(load_unit(given.unit), given.folder, given.machines, told=told)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
