"""Sweep recipes: a plan on file, with limits of its own and a target for refinement.

Owns the recipe file. A recipe can tighten what bench and unit allow and
cannot loosen it, since every limit is checked by itself. It drives nothing.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from daq.configs import config_path
from daq.limits import Limits
from daq.plan import Direction, Spacing, SweepPlan, spaced_frequencies
from daq.untrusted.toml_files import NonNegative, Positive, Section, load_toml

__all__ = ["Recipe", "load_recipe"]


class RecipeSweep(Section):
    """The ``[sweep]`` table."""

    levels_vpk: Annotated[list[Positive], Field(min_length=1)]
    start_hz: Positive
    stop_hz: Positive
    points: Annotated[int, Field(ge=2, le=100_000)]
    spacing: Spacing = "lin"
    direction: Direction = "up"
    settle_cycles: Annotated[int, Field(ge=0)] = 20
    integrate_cycles: Annotated[int, Field(ge=1)] = 30
    dc_offset_v: Annotated[float, Field(allow_inf_nan=False)] = 0.0


class RecipeLimits(Section):
    """The ``[limits]`` table; what is left out is left to bench and unit."""

    source_vpk: Positive | None = None
    source_offset_v: NonNegative | None = None
    source_peak_v: Positive | None = None
    start_hz: Positive | None = None
    stop_hz: Positive | None = None
    duration_s: Positive | None = None


class RecipeRefine(Section):
    """The ``[refine]`` table: go on around anti-resonance and resonance until they are known."""

    target_std_hz: Positive
    budget_points: Annotated[int, Field(ge=3)]
    """Points per level, those of the sweep included."""


class Recipe(Section):
    """A way of measuring a kind of unit."""

    schema_: Literal[1] = Field(alias="schema")
    name: Annotated[str, Field(min_length=1, max_length=64)]
    sweep: RecipeSweep
    limits: RecipeLimits = RecipeLimits()
    refine: RecipeRefine | None = None

    def plan(self) -> SweepPlan:
        """The sweep plan.

        Raises
        ------
        InputError
            If the values do not make one, such as an empty band.
        """
        sweep = self.sweep
        return SweepPlan(
            frequencies_hz=spaced_frequencies(
                sweep.start_hz, sweep.stop_hz, sweep.points, sweep.spacing
            ),
            levels_vpk=tuple(sweep.levels_vpk),
            direction=sweep.direction,
            settle_cycles=sweep.settle_cycles,
            integrate_cycles=sweep.integrate_cycles,
            dc_offset_v=sweep.dc_offset_v,
        )

    def bounds(self) -> Limits:
        """What this recipe allows."""
        given = {key: value for key, value in self.limits.model_dump().items() if value is not None}
        return Limits(set_by=f"recipe {self.name}", **given)


def load_recipe(name_or_path: str) -> Recipe:
    """Read a recipe by the name of one that comes with lashbench, or by path.

    Raises
    ------
    ConfigurationError
        If the file is not there, or anything in it is wrong.
    """
    return load_toml(Recipe, config_path("recipes", name_or_path))
