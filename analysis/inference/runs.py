"""Training runs: machines of the prior taken through sweeps of the prior.

Owns batches: one sweep plan, groups of machines that share their linear part, the reading of each
run free of any bench's noise, and what is true of each machine. A batch is known by unit, seed and
number alone. It learns nothing.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble.batch import Family, read_families
from analysis.execution.executor import Executor
from analysis.inference.nominal import nominal_runs
from analysis.inference.plans import Landmarks, draw_plan
from analysis.inference.prior import DrawnMachine, Prior
from daq.formats.atomic import replacing
from daq.plan import SweepPlan

__all__ = ["Batch", "load_batch", "save_batch", "simulate_batch"]

_LANES = 16
"""Lanes of the engine that one group of machines fills, at all its levels."""

_MACHINES = 96
"""Machines in a batch, about."""


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """Runs of n machines through one plan of L levels and F frequencies.

    `mean` (n, L, F) complex: V_o/V_i. `variance` (n, L, F): relative variance of the mean over
    both components, free of reading noise. `effects` (n, E) 0 or 1; `sizes` (n, P) physical
    values, NaN where the effect is absent; `tolerance`, `errors` (n, T) as shares; `ratio`,
    `total_backlash` (as a multiple of the datasheet's), `total_known` (n,). `plain_mean`,
    `plain_variance` (RUNS, L, F): of the datasheet's machine, see `analysis.inference.nominal`.
    """

    plan: SweepPlan
    mean: NDArray[np.complex64]
    variance: NDArray[np.float32]
    effects: NDArray[np.uint8]
    sizes: NDArray[np.float32]
    tolerance: NDArray[np.float32]
    errors: NDArray[np.float32]
    ratio: NDArray[np.float32]
    total_backlash: NDArray[np.float32]
    total_known: NDArray[np.bool_]
    plain_mean: NDArray[np.complex64]
    plain_variance: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.ratio)


def simulate_batch(
    prior: Prior, marks: Landmarks, seed: int, number: int, executor: Executor | None = None
) -> Batch:
    """Draw and simulate the batch of a number.

    Raises
    ------
    AnalysisError
        If a motion grew without bound even at the shortest step.
    """
    rng = np.random.default_rng([seed, number])
    plan = draw_plan(prior.unit, marks, rng)
    lanes = max(_LANES // len(plan.levels_vpk), 1)
    groups = [prior.draw_group(lanes, rng) for _ in range(max(_MACHINES // lanes, 1))]
    rows = np.arange(plan.points)
    families = [
        Family(prior.unit, tuple(one.machine for one in group), ((plan, rows),)) for group in groups
    ]
    readings = read_families(families, executor)
    plain_mean, plain_variance = nominal_runs(prior.unit, plan, executor)
    shape = (-1, len(plan.levels_vpk), len(plan.frequencies_hz))
    machines = [one for group in groups for one in group]
    return Batch(
        plan=plan,
        mean=np.concatenate([m for m, _ in readings]).astype(np.complex64).reshape(shape),
        variance=np.concatenate([v for _, v in readings]).astype(np.float32).reshape(shape),
        plain_mean=plain_mean,
        plain_variance=plain_variance,
        **_truths(prior, machines),
    )


def save_batch(file: Path, batch: Batch) -> None:
    """Write a batch; it appears whole or not at all."""
    arrays = {name: getattr(batch, name) for name in Batch.__slots__ if name != "plan"}
    with replacing(file) as stream:
        np.savez(stream, plan=json.dumps(asdict(batch.plan)), **arrays)


def load_batch(file: Path) -> Batch:
    """Read a batch that was saved."""
    with np.load(file, allow_pickle=False) as kept:
        fields = {name: kept[name] for name in kept.files}
    plan: dict[str, Any] = json.loads(str(fields.pop("plan")))
    for name in ("frequencies_hz", "levels_vpk"):
        plan[name] = tuple(plan[name])
    return Batch(SweepPlan(**plan), **fields)


def _truths(prior: Prior, machines: list[DrawnMachine]) -> Mapping[str, NDArray[Any]]:
    place = {name: i for i, name in enumerate(prior.effects)}
    size_place = {(e, p.name): i for i, (e, p) in enumerate(prior.parameters)}
    symbol_place = {s: i for i, s in enumerate(prior.symbols)}
    count = len(machines)
    effects = np.zeros((count, len(place)), dtype=np.uint8)
    sizes = np.full((count, len(size_place)), np.nan, dtype=np.float32)
    errors = np.zeros((count, len(symbol_place)), dtype=np.float32)
    known_deg = prior.unit.backlash.b_t_deg
    for row, one in enumerate(machines):
        for setting in one.machine.effects:
            effects[row, place[setting.id]] = 1
            for name, value in setting.values.items():
                sizes[row, size_place[setting.id, name]] = value
        for symbol, error in one.machine.deviations:
            errors[row, symbol_place[symbol]] = error
    total = [1.0 if m.machine.b_t_deg is None else m.machine.b_t_deg / known_deg for m in machines]
    return {
        "effects": effects,
        "sizes": sizes,
        "errors": errors,
        "tolerance": np.array([m.tolerance for m in machines], dtype=np.float32),
        "ratio": np.array([m.machine.ratio for m in machines], dtype=np.float32),
        "total_backlash": np.array(total, dtype=np.float32),
        "total_known": np.array([m.total_known for m in machines]),
    }
