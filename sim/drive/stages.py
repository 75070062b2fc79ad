"""The gear stages of a unit file.

Owns their names, units and bounds. It builds no equations: `sim.drivetrain` does.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
)

__all__ = ["Stage1", "Stage2"]

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Efficiency = Annotated[float, Field(ge=0.2, le=1.0)]


class _Stage(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    @model_serializer(mode="wrap")
    def _without_later_keys(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        # They are no part of a unit's physics where they are not given: older units lack them.
        return {k: v for k, v in handler(self).items() if v is not None or not k.startswith("eta")}


class Stage1(_Stage):
    """First gear stage and shaft 1, equations (5) to (10)."""

    N_1: Positive
    """Gear ratio."""
    k_g1: Positive
    """Mesh stiffness at gear 1, N.m/rad."""
    J_g1: Positive
    """Gear 1, kg.m^2."""
    k_s1: Positive
    """Stiffness of shaft 1, N.m/rad; each half is 2 k_s1."""
    J_s1: Positive
    """Lumped inertia in the middle of shaft 1, kg.m^2."""
    J_p2: Positive | None = None
    """Pinion 2, kg.m^2; left out where there is no second stage."""
    eta_1: Efficiency | None = None
    """Efficiency while the motor drives; 1 where it is left out."""


class Stage2(_Stage):
    """Second gear stage, equations (10) to (13)."""

    N: Positive
    """Revolution ratio seen by pinion 2: N_2 + 1 where gear 2 is fixed, else N_2."""
    k_2: Positive
    """Mesh stiffness at the output, N.m/rad (with shaft 2 in series where there is one)."""
    eta_2: Efficiency | None = None
    """Efficiency while pinion 2 drives; 1 where it is left out."""
