"""Hypotheses about what a unit has that its model lacks, and their coordinates.

Owns the map between a hypothesis (a set of effects of the catalogue), its
coordinates of order one, and machines that can be simulated. It judges nothing
and simulates nothing.

Coordinates: the contribution ratio first, 0 to 1; then, for each parameter of
each effect, the logarithm of its value between the ends of its plausible
range, scaled to 0 to 1; Table 1 parameters lie at a half where they are as the
datasheet says.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble.machine import Machine
from sim.catalogue import CATALOGUE, EffectParameter, not_of_unit
from sim.effects import EffectSetting
from sim.unit import Unit

__all__ = ["Hypothesis", "every_single_cause"]

_KNOWN_WELL = 0.005
"""Standard deviation of a datasheet value, as a share, up to which runs of the plain model show
what it does; of wider ones runs of the value itself do so better, and say the same."""

_LEAST_SHARE = 0.01
"""Ranges that begin at zero begin here instead, as a share of their end, so that logs exist."""


@dataclass(frozen=True)
class Hypothesis:
    """A set of effects on a unit; no effect at all is the baseline.

    `effects` are identifiers, sorted. d = 1 + number of parameters.
    """

    unit: Unit
    effects: tuple[str, ...] = ()

    @cached_property
    def parameters(self) -> tuple[tuple[str, EffectParameter], ...]:
        """(effect identifier, parameter) of every coordinate after the ratio."""
        return tuple((e, p) for e in self.effects for p in CATALOGUE[e].parameters)

    @cached_property
    def logs(self) -> NDArray[np.float64]:
        """(d - 1, 2): logarithms of the ends of every parameter's range."""
        ends = [p.range(self.unit) for _, p in self.parameters]
        floored = [(max(low, _LEAST_SHARE * high), high) for low, high in ends]
        return np.log(np.array(floored).reshape(-1, 2))

    @property
    def d(self) -> int:
        """Number of coordinates."""
        return 1 + len(self.parameters)

    def values(self, place: NDArray[np.float64]) -> NDArray[np.float64]:
        """Physical parameter values at a place (d,), in the order of `parameters`."""
        low, high = self.logs[:, 0], self.logs[:, 1]
        return np.exp(low + (high - low) * np.asarray(place)[1:])

    def place(self, ratio: float, values: Sequence[float]) -> NDArray[np.float64]:
        """The place (d,) of a ratio and physical parameter values."""
        low, high = self.logs[:, 0], self.logs[:, 1]
        return np.concatenate([[ratio], (np.log(np.asarray(values)) - low) / (high - low)])

    def settings(self, place: NDArray[np.float64]) -> tuple[EffectSetting, ...]:
        """The effects with their values at a place (d,)."""
        found: dict[str, dict[str, float]] = {effect: {} for effect in self.effects}
        for (effect, parameter), value in zip(self.parameters, self.values(place), strict=True):
            found[effect][parameter.name] = float(value)
        return tuple(EffectSetting(effect, values) for effect, values in found.items())

    def machine(
        self,
        place: NDArray[np.float64],
        seed: int,
        deviations: tuple[tuple[str, float], ...] = (),
    ) -> Machine:
        """A machine at a place (d,); its gears start near the middle of their play."""
        ratio = float(np.clip(place[0], 0.0, 1.0))
        return Machine(ratio, seed, None, deviations, self.settings(place))

    @property
    def amid(self) -> list[bool]:
        """Whether each parameter is a datasheet value that lies amid its range."""
        nominal = [parameter.nominal(self.unit) for _, parameter in self.parameters]
        return [
            known is not None and bool(0.5 * known**2 < low * high < 2.0 * known**2)
            for known, (low, high) in zip(nominal, np.exp(self.logs), strict=True)
        ]

    @property
    def datasheet(self) -> NDArray[np.float64]:
        """Sizes (d - 1,) as the datasheet has them, NaN where it says nothing of one."""
        values = [parameter.nominal(self.unit) or np.nan for _, parameter in self.parameters]
        return self.place(0.0, values)[1:]

    @property
    def spread(self) -> NDArray[np.float64]:
        """Standard deviations (d - 1,) of sizes that are believed of the datasheet, 0 where none.

        Along the logarithms that sizes are coordinates of.
        """
        shares = np.array([parameter.spread(self.unit) for _, parameter in self.parameters])
        return np.asarray(shares / np.ptp(self.logs, axis=1))

    def within_tolerance(self, place: NDArray[np.float64]) -> list[bool]:
        """Whether each parameter is a datasheet value (or a factor on some) hardly off it."""
        nominal = [parameter.nominal(self.unit) for _, parameter in self.parameters]
        return [
            known is not None and abs(value / known - 1.0) < parameter.within(self.unit)
            for (_, parameter), known, value in zip(
                self.parameters, nominal, self.values(place), strict=True
            )
        ]

    def is_tolerance(self, place: NDArray[np.float64]) -> bool:
        """Whether all there is at a place (d,) is what is believed of the datasheet anyway.

        Of values that are believed no better than those of the shipped units.
        """
        return bool(self.effects) and not self.beyond_tolerance(place)

    def beyond_tolerance(self, place: NDArray[np.float64]) -> tuple[str, ...]:
        """Those of its effects of which something at a place (d,) is not, see `is_tolerance`."""
        wide = [parameter.spread(self.unit) > _KNOWN_WELL for _, parameter in self.parameters]
        if not any(wide):
            return self.effects
        within = zip(self.parameters, wide, self.within_tolerance(place), strict=True)
        beyond = {effect for (effect, _), one, near in within if not (one and near)}
        return tuple(effect for effect in self.effects if effect in beyond)

    @property
    def sites(self) -> tuple[str, ...]:
        """Where its effects sit: "plant", "chain"."""
        return tuple(sorted({CATALOGUE[effect].site for effect in self.effects}))


def every_single_cause(unit: Unit) -> Iterator[Hypothesis]:
    """The hypotheses of one usual effect each, in the order of the catalogue."""
    foreign = not_of_unit(unit)
    for effect in CATALOGUE.values():
        if not effect.rare and effect.id not in foreign:
            yield Hypothesis(unit, (effect.id,))
