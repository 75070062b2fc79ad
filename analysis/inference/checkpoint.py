"""Checkpoints of a posterior: weights, optimiser, and where simulation and training stand.

Owns one folder per unit. A checkpoint appears whole or not at all, and holds what is needed to go
on: how many batches were drawn, by which seed, and how many steps were made. It trains nothing.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from analysis.inference.network import Architecture
from daq.errors import ConfigurationError
from daq.formats.atomic import replacing

__all__ = ["Checkpoint", "load_checkpoint", "save_checkpoint"]

EDITION = 1
"""Counted up whenever inputs, prior, network or engine change what weights mean."""


@dataclass(frozen=True)
class Checkpoint:
    """Where the training of a posterior stands.

    `unit`: key of its physics. `seed`, `batches`: runs drawn so far. `machines`: in them.
    `steps`: of training. `figures`: measured on runs that training has not seen.
    """

    unit: str
    shape: Architecture
    weights: dict[str, Any]
    seed: int
    batches: int = 0
    machines: int = 0
    steps: int = 0
    figures: dict[str, float] = field(default_factory=dict)


def save_checkpoint(folder: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint; weights in half precision lose nothing that matters."""
    folder.mkdir(parents=True, exist_ok=True)
    facts = asdict(checkpoint)
    facts.pop("weights")
    facts["edition"] = EDITION
    arrays: dict[str, Any] = {
        name: np.asarray(w, dtype=np.float16) for name, w in checkpoint.weights.items()
    }
    with replacing(folder / "posterior.npz") as stream:
        np.savez_compressed(stream, facts=json.dumps(facts), **arrays)


def load_checkpoint(folder: Path) -> Checkpoint | None:
    """Read a checkpoint; None where there is none.

    Raises
    ------
    ConfigurationError
        If it is of another edition.
    """
    file = folder / "posterior.npz"
    if not file.exists():
        return None
    with np.load(file, allow_pickle=False) as kept:
        arrays = {name: kept[name].astype(np.float32) for name in kept.files if name != "facts"}
        facts = json.loads(str(kept["facts"]))
    if facts.pop("edition") != EDITION:
        raise ConfigurationError(f"{file}: weights of another edition; train the posterior anew")
    shape = facts.pop("shape")
    shape["widths"] = tuple(shape["widths"])
    return Checkpoint(shape=Architecture(**shape), weights=arrays, **facts)
