"""The gear stages of a unit file.

Owns their names, units and bounds. It builds no equations: `sim.drivetrain` does.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from sim.drive.sections import NonNegative, Positive, Section

__all__ = ["Stage1", "Stage2", "Stage3"]

Efficiency = Annotated[float, Field(ge=0.2, le=1.0)]


class Stage1(Section):
    """First gear stage and shaft 1, equations (5) to (10)."""

    LATER = ("eta_1",)

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


class Stage2(Section):
    """Second gear stage, equations (10) to (13)."""

    LATER = ("eta_2",)

    N: Positive
    """Revolution ratio seen by pinion 2: N_2 + 1 where gear 2 is fixed, else N_2."""
    k_2: Positive
    """Mesh stiffness at the output, N.m/rad (with shaft 2 in series where there is one)."""
    eta_2: Efficiency | None = None
    """Efficiency while pinion 2 drives; 1 where it is left out."""


class Stage3(Section):
    """Third gear stage, behind the two of the paper: gear 2, shaft 2 and the gear at the load.

    The play of this stage is known; the contribution ratio shares out what it leaves of the total.
    """

    LATER = ("eta_3",)

    J_g2: Positive
    """Gear 2 with shaft 2 and pinion 3, kg.m^2; the shaft's stiffness is in series with k_2."""
    N_3: Positive
    """Revolution ratio seen by pinion 3."""
    k_3: Positive
    """Mesh stiffness at the output, N.m/rad."""
    b3_deg: NonNegative
    """Play at the output with pinion 3 held, degrees; all of the total where that is smaller."""
    eta_3: Efficiency | None = None
    """Efficiency while pinion 3 drives; 1 where it is left out."""
