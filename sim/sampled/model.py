"""The sampled bench in the table of simulated instruments; see `sim.models`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sim.faults import CATALOGUE
from sim.models import Bench, Model

if TYPE_CHECKING:
    from sim.instrument.bus import Instrument
    from sim.instrument.plant import Plant

__all__ = ["MODEL"]

_SHARED = (
    "dropped-connection", "silence", "slow-reply", "garbage-bytes", "truncated-block",
    "wrong-length", "missing-eoi", "overload-burst", "lost-power", "adapter-reset", "link-away",
)  # fmt: skip


def _build(plant: Plant, bench: Bench) -> Instrument:
    from sim.sampled.instrument import SimulatedConverter

    return SimulatedConverter(plant, bench)


MODEL = Model("SAMPLED", "sampled", _build, {name: CATALOGUE[name] for name in _SHARED})
