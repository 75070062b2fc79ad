"""Coordinates of a drive's parameters in which the prior is standard normal.

Owns which parameters are identified and the map between coordinates and values. A tolerance of
zero means that a value is exact, and a share of zero is zero; neither has a coordinate. It
simulates nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from analysis.ensemble.machine import Machine
from daq.errors import InputError
from sim.tolerance import response_scales
from sim.unit import Unit

Vector = NDArray[np.float64]

__all__ = ["BACKLASH", "NOISE", "RATIO", "Coordinates"]

RATIO = "contribution_ratio"
"""Name of the contribution ratio among the coordinates."""

BACKLASH = "b_t_deg"
"""Name of the total backlash."""

NOISE = "reading_noise"
"""Name of the reading noise among the coordinates: of the bench, not of the drive."""

_BACKLASH_SPREAD = 0.5
"""Standard deviation of the logarithm of a total backlash that is unknown."""

_FREE = ("T_f_m", "T_f_L", BACKLASH, "b3_deg", RATIO, NOISE)
"""Parameters that leave the linear part alone: drives that differ in them are stepped together."""


@dataclass(frozen=True)
class Coordinates:
    """Names of the parameters of a unit that are identified, and their prior.

    A value is the datasheet's times exp(share * z), the ratio is Phi(z); z is standard normal. So
    every value stays positive, and every ratio is as likely as any other. `shares` (d,) is NaN
    for the ratio.
    """

    unit: Unit
    symbols: tuple[str, ...]
    shares: tuple[float, ...]

    @classmethod
    def of(cls, unit: Unit, *, total_backlash_unknown: bool = False) -> Self:
        """All parameters that are not zero nor exact, and the ratio of two or three stages.

        Raises
        ------
        InputError
            If a total backlash of zero is to be identified.
        """
        known = unit.parameters
        held = {s: share for s, share in unit.tolerances.items() if share > 0.0 < known[s]}
        if total_backlash_unknown:
            if known[BACKLASH] == 0.0:
                raise InputError(
                    f"unit {unit.name}: backlash.b_t_deg is 0, and a multiple of it would be 0, "
                    "too; write about how much it is to identify the total backlash"
                )
            held[BACKLASH] = _BACKLASH_SPREAD
        if unit.stages > 1:
            held[RATIO] = float("nan")
        return cls(unit, tuple(held), tuple(held.values()))

    def with_noise(self, spread: float) -> Self:
        """The same and the reading noise, last: a multiple exp(spread * z) of the observation's."""
        return replace(self, symbols=(*self.symbols, NOISE), shares=(*self.shares, spread))

    def __len__(self) -> int:
        return len(self.symbols)

    @property
    def free(self) -> NDArray[np.bool_]:
        """Which coordinates (d,) may differ among machines that are stepped together."""
        return np.array([symbol in _FREE for symbol in self.symbols])

    @property
    def scales(self) -> NDArray[np.bool_]:
        """Which coordinates (d,) do no more than scale the response."""
        scales = response_scales(self.unit)
        return np.array([symbol in scales for symbol in self.symbols])

    def factors(self, z: Vector) -> Vector:
        """Values (..., d) as multiples of the datasheet's; the ratio itself in its place."""
        shares = np.nan_to_num(np.array(self.shares))
        ratio = np.array([symbol == RATIO for symbol in self.symbols])
        return np.where(ratio, ndtr(z), np.exp(shares * z))

    def slopes(self, z: Vector) -> Vector:
        """Derivative (d,) of the logarithm of each value by its coordinate; of the ratio itself."""
        shares = np.nan_to_num(np.array(self.shares))
        ratio = np.array([symbol == RATIO for symbol in self.symbols])
        return np.where(ratio, np.exp(-0.5 * z**2) / math.sqrt(2.0 * math.pi), shares)

    def nominal(self) -> Vector:
        """Coordinates (d,) of the datasheet, the ratio amid its range."""
        return np.zeros(len(self))

    def machine(self, z: Vector, seed: int) -> Machine:
        """The machine at coordinates (d,)."""
        factors = dict(zip(self.symbols, self.factors(z).tolist(), strict=True))
        ratio = factors.pop(RATIO, 1.0)
        factors.pop(NOISE, None)
        b_t_deg = None
        if BACKLASH in factors:
            b_t_deg = self.unit.backlash.b_t_deg * factors.pop(BACKLASH)
        deviations = tuple((symbol, factor - 1.0) for symbol, factor in factors.items())
        return Machine(ratio, seed, b_t_deg, deviations)

    def values(self, z: Vector) -> dict[str, float]:
        """Physical values at coordinates (d,), by symbol, the ratio among them."""
        known = self.unit.parameters
        factors = zip(self.symbols, self.factors(z).tolist(), strict=True)
        return {s: factor if s == RATIO else known[s] * factor for s, factor in factors}
