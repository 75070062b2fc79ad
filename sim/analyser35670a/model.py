"""The 35670A as one of the models that can be simulated; see `sim.models`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sim.faults import CATALOGUE
from sim.models import Bench, Model

if TYPE_CHECKING:
    from sim.instrument.bus import Instrument
    from sim.instrument.plant import Plant

__all__ = ["MODEL"]


def _build(plant: Plant, bench: Bench) -> Instrument:
    from sim.analyser35670a.choices import Choices
    from sim.analyser35670a.instrument import Analyser35670A

    options = Choices().options if bench.options is None else bench.options
    choices = Choices(
        seed=bench.seed,
        noise_v=bench.noise_v,
        converter_noise=bench.converter_noise,
        options=options,
    )
    return Analyser35670A(plant, choices, bench.board)


MODEL = Model("35670A", "", _build, CATALOGUE, has_options=True)
