"""The SR785 as one of the models that can be simulated; see `sim.models`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sim.faults import CATALOGUE, FaultKind
from sim.models import Bench, Model

if TYPE_CHECKING:
    from sim.instrument.bus import Instrument
    from sim.instrument.plant import Plant

__all__ = ["FAULTS", "MODEL"]

_SHARED = (
    "dropped-connection", "silence", "slow-reply", "garbage-bytes", "truncated-block",
    "missing-eoi", "overload-burst", "stuck-measuring-bit", "stuck-parser", "lost-power",
    "adapter-reset", "link-away",
)  # fmt: skip
FAULTS = {name: CATALOGUE[name] for name in _SHARED} | {
    "outx-elsewhere": FaultKind("replies go to the other interface", point=3),
    "psd-stuck": FaultKind("PSD units are on and spoil the data", phase="prepare"),
    "display-off-line": FaultKind("display A is frozen", point=3),
    "key-pressed": FaultKind("somebody changes the integration at the panel", point=3),
    "panel-pause": FaultKind("somebody pauses the sweep at the panel", point=3),
    "range-moved": FaultKind("the range of input 2 falls to its lowest", point=3),
}
"""Every fault by its stable name; those that the 35670A has, too, are called alike."""


def _build(plant: Plant, bench: Bench) -> Instrument:
    from sim.sr785.choices import Choices
    from sim.sr785.instrument import SR785

    choices = Choices(seed=bench.seed, noise_v=bench.noise_v, converter_noise=bench.converter_noise)
    return SR785(plant, choices, bench.board)


MODEL = Model("SR785", "sr785", _build, FAULTS, has_serial=True)
