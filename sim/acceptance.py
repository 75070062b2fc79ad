"""The limits that decide whether a unit is accepted, as a table of a file.

Owns which quantities may be limited and the form of the ``[acceptance]`` table. Whether a
measured value lies within a limit is decided by `analysis.acceptance`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

__all__ = ["BACKLASH_QUANTITIES", "FEATURE_QUANTITIES", "Acceptance", "Bound"]

Finite = Annotated[float, Field(allow_inf_nan=False)]

FEATURE_QUANTITIES: Mapping[str, str] = {
    "arf_hz": "Hz",
    "rf_hz": "Hz",
    "difference_hz": "Hz",
    "arf_gain_db": "dB",
    "rf_gain_db": "dB",
    "arf_damping": "",
    "rf_damping": "",
}
"""Quantities of each source level, with their units."""
BACKLASH_QUANTITIES: Mapping[str, str] = {
    "r": "",
    "b1_deg": "deg",
    "b2_deg": "deg",
    "b_t_deg": "deg",
}
"""Quantities of the unit, with their units."""

_SIGNED = ("arf_gain_db", "rf_gain_db")


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Bound(_Table):
    """One limit: the least and the greatest value that is accepted."""

    lower: Finite | None = None
    upper: Finite | None = None
    level_vpk: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    """The source level that is meant, V peak; every level if left out."""

    @model_validator(mode="after")
    def _is_a_bound(self) -> Self:
        if self.lower is None and self.upper is None:
            raise ValueError("give lower, upper or both")
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            raise ValueError(f"lower {self.lower:g} is not below upper {self.upper:g}")
        return self


Bounds = Annotated[Sequence[Bound], Field(max_length=100)]


class Acceptance(_Table):
    """The ``[acceptance]`` table; a quantity has one limit or a list of them."""

    coverage_factor: Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)] = 2.0
    """k of ISO 14253-1: the guard band is k standard uncertainties wide."""
    r: Bounds = ()
    b1_deg: Bounds = ()
    b2_deg: Bounds = ()
    b_t_deg: Bounds = ()
    arf_hz: Bounds = ()
    rf_hz: Bounds = ()
    difference_hz: Bounds = ()
    arf_gain_db: Bounds = ()
    rf_gain_db: Bounds = ()
    arf_damping: Bounds = ()
    rf_damping: Bounds = ()
    causes_not_tolerated: Annotated[Sequence[str], Field(max_length=100)] = ()
    """Effects of the catalogue that a unit must not have."""

    @field_validator(*BACKLASH_QUANTITIES, *FEATURE_QUANTITIES, mode="before")
    @classmethod
    def _as_list(cls, value: Any) -> Any:
        if isinstance(value, int | float | str):
            raise ValueError("give a table, as in { upper = 0.4 }, or a list of them")
        return (value,) if isinstance(value, Mapping) else value

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        for quantity, bound in self.bounds():
            if bound.level_vpk is not None and quantity in BACKLASH_QUANTITIES:
                raise ValueError(f"{quantity} is one value of the unit; leave out level_vpk")
            for name in ("lower", "upper"):
                value = getattr(bound, name)
                if value is None or quantity in _SIGNED:
                    continue
                if value < 0 or (quantity == "r" and value > 1):
                    most = "0 to 1" if quantity == "r" else "0 or more"
                    raise ValueError(f"{quantity}.{name} {value:g} is not {most}")
        if not any(True for _ in self.bounds()) and not self.causes_not_tolerated:
            raise ValueError("there is no limit; set at least one, as in b1_deg = { upper = 0.4 }")
        return self

    def bounds(self) -> Iterator[tuple[str, Bound]]:
        """Every limit with the quantity that it is of."""
        for quantity in (*BACKLASH_QUANTITIES, *FEATURE_QUANTITIES):
            for bound in getattr(self, quantity):
                yield quantity, bound
