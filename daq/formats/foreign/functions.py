"""One function of a file that holds several: its axes, where it was measured, and its values.

Owns that record, whatever format it was read from. Numbers of quantities and function types are
those of data set 58 of universal files.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["COHERENCE", "RESPONSE", "Axis", "Function"]

RESPONSE, COHERENCE = 4, 6
"""Function types: frequency response, and coherence."""


@dataclass(frozen=True, slots=True)
class Axis:
    """What an axis holds: the format's number of the quantity, and its label and unit as text."""

    kind: int = 0
    label: str = ""
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Function:
    """One function. `number` counts the functions of the file from 1."""

    number: int
    kind: int
    titles: tuple[str, ...]
    response: str
    reference: str
    names: tuple[str, str]
    abscissa: Axis
    ordinate: Axis
    denominator: Axis
    third: Axis
    third_value: float
    x: NDArray[np.float64] = field(repr=False)
    values: NDArray[Any] = field(repr=False)

    @property
    def degrees_of_freedom(self) -> str:
        """Response over reference, such as ``1:+X/2:+Z``."""
        return f"{self.response}/{self.reference}"

    @property
    def title(self) -> str:
        """The first line of description that says something."""
        return next((title for title in self.titles if title not in ("", "NONE")), "")
