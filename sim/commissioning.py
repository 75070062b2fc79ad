"""How the values of a unit were identified, as the ``[commissioning]`` table of its file.

Owns the form of that record. Who identifies values and writes it is `analysis.commissioning`; no
answer depends on it but for the name that the datasheet had.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

__all__ = ["Commissioning", "CommissioningSweep"]

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class CommissioningSweep(_Table):
    """A sweep that a unit was commissioned by."""

    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    """Of its readings, see `analysis.commissioning`."""
    levels_vpk: tuple[Positive, ...]
    start_hz: Positive
    stop_hz: Positive
    points: Positive
    serial: str | None = None


class Commissioning(_Table):
    """How the values of a unit were identified while it was known to be good."""

    date: str
    of: str
    """Name of the unit whose datasheet it began with."""
    contribution_ratio: Annotated[float, Field(ge=0, le=1)] | None = None
    contribution_ratio_std: NonNegative | None = None
    datasheet: Mapping[str, Positive]
    """Values before, by symbol."""
    std: Mapping[str, NonNegative]
    """One standard deviation of each value as a share, whatever the others are."""
    order: tuple[str, ...]
    covariance: tuple[tuple[Annotated[float, Field(allow_inf_nan=False)], ...], ...]
    """Of the logarithms of the values in `order`; of the contribution ratio itself."""
    sweeps: tuple[CommissioningSweep, ...]

    @model_validator(mode="after")
    def _has_a_square_covariance(self) -> Self:
        sides = {len(self.covariance), *map(len, self.covariance)}
        if sides != {len(self.order)}:
            raise ValueError("covariance has not as many rows and columns as order has names")
        return self
