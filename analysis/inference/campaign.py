"""Simulation and training of one unit's posterior, interruptible and resumable.

Owns the order of the work: simulate the batches that are missing, train on all of them by one
schedule, measure on batches that training never sees, and save what is no worse than what training
began with. Batches are files, so that what is interrupted loses one of them at most.
Answers are made by `analysis.inference.posterior`.

    python -m analysis.inference.campaign --unit adss --machines 200000 --folder build/runs/adss
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.execution.executor import Executor, LocalExecutor
from analysis.execution.pace import Pace, duration
from analysis.inference.checkpoint import (
    Checkpoint,
    posterior_name,
    read_checkpoint,
    write_checkpoint,
)
from analysis.inference.examples import Scales, read_batch
from analysis.inference.network import densities, first_weights, set_logits, summarise
from analysis.inference.runs import Batch, load_batch, save_batch, simulate_batch
from daq.configs import posterior_folder
from daq.errors import AnalysisError, InputError
from sim.unit import Unit, load_unit

__all__ = ["Recipe", "measure", "simulate_runs", "train_unit"]

HELD_OUT = 20
"""One batch in so many is kept for measuring."""

_STANDS = "training.npz"
"""File of a training that has not ended."""

_AT_ONCE = 200
"""Steps of training between two checkpoints."""

_STEP_S = 0.6
"""Processor time of a step of 192 examples, before any was made; then it is measured."""

_ATTEMPTS, _APART = 5, 10**7
"""A batch whose motion grew without bound is drawn anew under a number so far off."""


@dataclass(frozen=True)
class Recipe:
    """How a posterior is made.

    `seed`: of the batches, whose numbers begin at `first`. `epochs`: how often training sees each
    machine; `rate`: the highest learning rate, which falls to nothing along a cosine; `examples` in
    a step; `dropout` of the summary's units; `decay` of weights. `shape`: see
    `analysis.inference.network`.
    """

    seed: int = 1
    first: int = 0
    epochs: float = 8.0
    examples: int = 192
    rate: float = 1e-3
    dropout: float = 0.2
    decay: float = 0.05
    shape: Mapping[str, Any] | None = None


def simulate_runs(
    scales: Scales,
    folder: Path,
    machines: int,
    recipe: Recipe,
    executor: Executor | None = None,
    told: Callable[[int], object] = lambda machines: None,
) -> list[Path]:
    """Files of batches that hold so many machines; those that are missing are simulated.

    `told` of the machines that there are, from time to time.
    """
    executor = executor or LocalExecutor()
    folder.mkdir(parents=True, exist_ok=True)
    files: list[Path] = []
    held, number = 0, recipe.first
    while held < machines:
        numbers = range(number, number + 2 * getattr(executor, "cores", 8))
        missing = [n for n in numbers if not _file(folder, n).exists()]
        made = executor.each(partial(_simulate, scales, recipe.seed), missing)
        for n, batch in zip(missing, made, strict=True):
            save_batch(_file(folder, n), batch)
        for n in numbers:
            files.append(_file(folder, n))
            held += len(load_batch(files[-1]))
        number = numbers.stop
        told(held)
    return files


def train_unit(
    unit: Unit,
    file: Path,
    runs: Path,
    machines: int,
    recipe: Recipe | None = None,
    start: Checkpoint | None = None,
    beside: Sequence[tuple[Unit, Path]] = (),
    executor: Executor | None = None,
    told: Callable[[str], object] = lambda text: None,
) -> Checkpoint:
    """Make the posterior of a unit, or go on with one that was interrupted.

    What training began with is kept where it is better on batches that neither has seen.

    Parameters
    ----------
    file
        Where the posterior is kept; it appears when training has ended.
    runs
        Folder of the batches, and of where training stands, which is written about every minute.
    start
        A posterior, of another unit perhaps, whose weights training begins with; that of `file`
        if there is one.
    beside
        Other units with folders of their batches, which training sees as well: what the network
        learns of one holds for others, as it reads both relative to their datasheets.
    told
        Told what is being done, with figures.

    Raises
    ------
    InputError
        If JAX is not installed.
    AnalysisError
        If a motion grew without bound.
    """
    try:
        # JAX, which nobody who answers needs.
        from analysis.inference.training import Schedule, Trainer
    except ImportError as error:
        raise InputError(
            f"training needs JAX ({error}); install it: in a clone pip install -e '.[train]', "
            "else pip install 'lashbench[train]'"
        ) from error

    recipe = recipe or Recipe()
    state, start = read_checkpoint(runs / _STANDS), read_checkpoint(file) or start
    known = state or start
    scales = Scales.of(unit) if state is None else Scales.from_facts(unit, state)
    to_train_s = _STEP_S * recipe.epochs * machines / 192
    pace = Pace()

    def simulated(held: int) -> None:
        left = _left(pace.remaining_s(held / machines))
        of = f"{held} of {max(held, machines)} machines simulated"
        told(f"{of}{left}; training follows, about {duration(to_train_s)}")

    files = simulate_runs(scales, runs, machines, recipe, executor, simulated)
    batches = [load_batch(one) for one in files]
    apart = set(range(HELD_OUT - 1, len(batches), HELD_OUT)) or {len(batches) - 1}
    held_out = [batches[number] for number in sorted(apart)]
    seen = [(scales, one) for number, one in enumerate(batches) if number not in apart]
    for other, folder in beside:
        others = Scales.of(other)
        seen += [(others, load_batch(one)) for one in sorted(folder.glob("[0-9]*.npz"))]
    count = sum(len(one) for _, one in seen)
    steps = max(int(recipe.epochs * count / recipe.examples), 1)
    schedule = Schedule(steps, recipe.examples, recipe.rate, recipe.dropout, recipe.decay)
    if state is None or state.machines != count:
        shape = known.shape if known else scales.architecture(**recipe.shape or {})
        weights = known.weights if known else first_weights(shape, np.random.default_rng(0))
        state = Checkpoint(
            unit.name, scales.marks.arf_hz, scales.marks.rf_hz, scales.most_v, shape, weights,
            recipe.seed, len(files), count,
        )  # fmt: skip
    trainer, trained = Trainer(scales, state.shape, schedule), state.steps < steps
    pace = Pace()
    pace.remaining_s(state.steps / steps)
    while state.steps < steps:
        more = min(_AT_ONCE, steps - state.steps)
        weights, progress = trainer.train(state.weights, seen, state.steps, more)
        state = replace(state, weights=weights, steps=state.steps + more)
        state = replace(state, figures=measure(scales, state, held_out))
        write_checkpoint(runs / _STANDS, state)
        figures = ", ".join(f"{name} {value:.3f}" for name, value in state.figures.items())
        left = _left(pace.remaining_s(state.steps / steps))
        loss = ", ".join(f"{name} {value:.3f}" for name, value in progress.loss.items())
        told(f"step {state.steps} of {steps}{left}: loss {loss}; unseen {figures}")
    if start is not None and trained:
        before = replace(state, weights=start.weights)
        figures_before = measure(scales, before, held_out)
        # Weights that grew without bound have no figure, and are no better.
        if not state.figures["nll"] < figures_before["nll"]:
            told("no better than what training began with, which is kept; simulate more machines")
            state = replace(before, figures=figures_before)
    write_checkpoint(file, state)
    return state


def _left(seconds: float | None) -> str:
    return "" if seconds is None else f", about {duration(seconds)} left"


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


def _file(folder: Path, number: int) -> Path:
    return folder / f"{number:06d}.npz"


def _simulate(scales: Scales, seed: int, number: int) -> Batch:
    """The batch of a number; the next one of its own where a motion grew without bound."""
    for attempt in range(_ATTEMPTS):
        try:
            key = number + attempt * _APART
            return simulate_batch(scales.prior, scales.marks, seed, key, LocalExecutor(1))
        except AnalysisError:
            continue
    raise AnalysisError(f"batch {number}: every motion grew without bound")


def main(arguments: Sequence[str]) -> int:
    """Train, and print what is being done."""
    parser = argparse.ArgumentParser(prog="python -m analysis.inference.campaign")
    parser.add_argument("--unit", required=True)
    parser.add_argument("--machines", type=int, required=True)
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--file", type=Path)
    parser.add_argument("--start", type=Path)
    parser.add_argument("--beside", nargs=2, action="append", default=[])
    for name in ("seed", "first"):
        parser.add_argument(f"--{name}", type=int, default=getattr(Recipe(), name))
    for name in ("epochs", "rate", "dropout"):
        parser.add_argument(f"--{name}", type=float, default=getattr(Recipe(), name))
    given = parser.parse_args(arguments)
    recipe = Recipe(given.seed, given.first, given.epochs, 192, given.rate, given.dropout)
    start = None if given.start is None else read_checkpoint(given.start)
    train_unit(
        load_unit(given.unit),
        given.file or posterior_folder() / posterior_name(load_unit(given.unit)),
        given.folder,
        given.machines,
        recipe,
        start,
        [(load_unit(name), Path(folder)) for name, folder in given.beside],
        told=lambda text: sys.stderr.write(f"{text}\n"),
    )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
