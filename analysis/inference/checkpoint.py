"""Trained posteriors as files: weights, what they were trained on, and how well they answer.

Owns the format, the name of a unit's file, and where it is looked for: in the user's cache, then
among those that come with lashbench. A file appears whole or not at all. It trains nothing.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from analysis.inference.network import Architecture
from daq.configs import posterior_folder
from daq.formats.atomic import replacing
from daq.untrusted.trust import own_folder, read_own
from sim.catalogue import BUILT_IN
from sim.drive.sections import OPTIONAL_SECTIONS
from sim.unit import Unit

__all__ = [
    "Checkpoint",
    "find_checkpoint",
    "posterior_name",
    "read_checkpoint",
    "shipped_checkpoints",
    "write_checkpoint",
]

EDITION = 2
"""Counted up whenever inputs, prior, network or engine change what weights mean."""


_OF_DRIVES = 1
"""The same for units with sections that the paper's do not have, whose posteriors are not shipped:
their datasheet values that deviate, and ranges beside couplings."""


@dataclass(frozen=True)
class Checkpoint:
    """A trained posterior and where its training stands.

    `unit`: its name, for people. `arf_hz`, `rf_hz`, `most_v`: scales of its inputs. `seed`,
    `batches`: runs drawn so far. `machines`: in them. `steps`: of training. `figures`: measured on
    runs that training has not seen.
    """

    unit: str
    arf_hz: float
    rf_hz: float
    most_v: float
    shape: Architecture
    weights: dict[str, Any]
    seed: int
    batches: int = 0
    machines: int = 0
    steps: int = 0
    figures: dict[str, float] = field(default_factory=dict)


def posterior_name(unit: Unit) -> str:
    """File name of a unit's posterior, another for everything that it depends on."""
    effects = {e.id: [p.name for p in e.parameters] for e in BUILT_IN.values()}
    known: list[Any] = [EDITION, effects, unit.physics]
    if any(section in unit.physics for section in OPTIONAL_SECTIONS):
        known.append(_OF_DRIVES)
    text = json.dumps(known, sort_keys=True)
    return f"posterior-{hashlib.sha256(text.encode()).hexdigest()[:24]}.npz"


def find_checkpoint(unit: Unit, cache: Path | None = None) -> Checkpoint | None:
    """The posterior of a unit, from the cache or as it comes with lashbench; None without one."""
    name = posterior_name(unit)
    cache = None if cache is None else own_folder(cache)
    contents = (
        None if cache is None else read_own(cache / name),
        _shipped(name),
    )
    for content in filter(None, contents):
        # Damage is told by zip, zlib and numpy, each in many ways: the next one is tried.
        with suppress(Exception):
            return _parsed(content)
    return None


def shipped_checkpoints() -> Iterator[Checkpoint]:
    """The posteriors that come with lashbench."""
    for file in sorted(posterior_folder().glob("posterior-*.npz")):
        with suppress(Exception):
            yield _parsed(file.read_bytes())


def read_checkpoint(file: Path) -> Checkpoint | None:
    """A checkpoint that training goes on from; None where there is none."""
    return _parsed(file.read_bytes()) if file.exists() else None


def write_checkpoint(file: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint; weights in half precision lose nothing that matters."""
    file.parent.mkdir(parents=True, exist_ok=True)
    facts = asdict(checkpoint)
    facts.pop("weights")
    arrays: dict[str, Any] = {
        name: np.asarray(w, dtype=np.float16) for name, w in checkpoint.weights.items()
    }
    with replacing(file) as stream:
        np.savez_compressed(stream, facts=json.dumps(facts), **arrays)


def _shipped(name: str) -> bytes | None:
    file = posterior_folder() / name
    return file.read_bytes() if file.exists() else None


def _parsed(content: bytes) -> Checkpoint:
    with np.load(BytesIO(content), allow_pickle=False) as kept:
        weights = {name: kept[name].astype(np.float32) for name in kept.files if name != "facts"}
        facts = json.loads(str(kept["facts"]))
    shape = facts.pop("shape")
    shape["widths"] = tuple(shape["widths"])
    return Checkpoint(shape=Architecture(**shape), weights=weights, **facts)
