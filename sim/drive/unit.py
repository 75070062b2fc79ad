"""The record of a unit: its physical parameters, each value checked.

Owns the names, units and bounds of the paper's Table 1 and the bookkeeping of
backlash between the stages. It reads no file (`sim.unit`) and builds no equations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Self

from pydantic import Field, PrivateAttr, ValidationError, model_validator

from daq.errors import ConfigurationError
from sim.acceptance import Acceptance
from sim.commissioning import Commissioning
from sim.drive.sections import (
    OPTIONAL_SECTIONS,
    CurrentAmplifier,
    Damping,
    LoadCoupling,
    Loop,
    MotorCoupling,
    NonNegative,
    Positive,
    Sampling,
    Section,
    Sensor,
    find_contradiction,
)
from sim.drive.stages import Stage1, Stage2, Stage3
from sim.own_effects.sources import EffectSource, OwnEffects, announce
from sim.tolerance import Share, believed_shares, find_fault

__all__ = ["StageBacklash", "Unit", "stage_backlash", "unit_from_mapping"]

NO_PHYSICS = {
    "schema_", "schema", "name", "limits", "acceptance", "tolerance", "commissioning",
    "own_effects",
}  # fmt: skip
"""Sections of a unit that do not decide how it moves."""


class Motor(Section):
    """Armature circuit and rotor, equations (2) and (5)."""

    L_a: Positive | None = None
    """Armature inductance, H; left out with a current-controlled amplifier, as are the next two."""
    R_m: Positive | None = None
    """Armature resistance, ohm."""
    k_b: Positive | None = None
    """Back-EMF constant, V.s/rad."""
    k_t: Positive
    """Torque constant, N.m/A."""
    J_m: Positive
    """Rotor inertia with pinion 1, kg.m^2."""
    B_m: NonNegative
    """Viscous friction of the rotor, N.m.s/rad."""
    T_f_m: NonNegative
    """Dry friction of the rotor, N.m."""


class Electronics(Section):
    """Amplifier, tachometer and filter, equations (1), (3) and (4)."""

    k_a: Positive
    """Amplifier gain; A/V of one that controls the current."""
    k_ts: Positive
    """Gain of the sensor: V.s/rad of a tachometer, else `sim.drive.sections.Sensor.gain_unit`."""
    filter_numerator: Positive | None = None
    """Numerator of G_f, 1/s^2; other sensors may have no filter."""
    filter_denominator: tuple[Positive, NonNegative, Positive] | None = None
    """Coefficients of s^2, s and 1 in the denominator of G_f."""


class Load(Section):
    """The load, equation (14)."""

    J_L: Positive
    """Inertia, kg.m^2."""
    T_f_L: NonNegative
    """Dry friction, N.m."""


class Backlash(Section):
    """Play of the whole gear train."""

    b_t_deg: NonNegative
    """Total backlash seen at the output, full angular play, degrees."""


class Limits(Section):
    """What this unit may be driven with; a bench may tighten it."""

    source_vpk: Positive
    source_offset_v: NonNegative
    start_hz: Positive
    stop_hz: Positive
    b1_deg: NonNegative | None = None
    """Most backlash of stage 1 that is acceptable, degrees."""
    b2_deg: NonNegative | None = None
    """Most backlash of stage 2 that is acceptable, degrees."""


class Unit(Section):
    """A geared servo under test. Symbols are the paper's; SI units, degrees for backlash."""

    # Not Literal[1]: true equals 1 there.
    schema_: Annotated[int, Field(alias="schema", ge=1, le=1)]
    name: Annotated[str, Field(min_length=1, max_length=64)]
    motor: Motor
    electronics: Electronics
    stage1: Stage1
    stage2: Stage2 | None = None
    """Left out by a drive with one gear stage, whose shaft 1 carries the load itself."""
    load: Load
    backlash: Backlash
    limits: Limits
    stage3: Stage3 | None = None
    """Behind stage 2, of a drive with three gear stages."""
    damping: Damping | None = None
    amplifier: CurrentAmplifier | None = None
    sampling: Sampling | None = None
    sensor: Sensor | None = None
    motor_coupling: MotorCoupling | None = None
    load_coupling: LoadCoupling | None = None
    loop: Loop | None = None
    acceptance: Acceptance | None = None
    """What `--judge` decides by, with ``b1_deg`` and ``b2_deg`` of the limits."""
    tolerance: Mapping[str, Share] | None = None
    """One standard deviation of datasheet values, as a share, by symbol or ``default``."""
    commissioning: Commissioning | None = None
    """Where the values and their tolerance come from, if not from a datasheet."""
    own_effects: OwnEffects | None = None
    _override: dict[str, float] = PrivateAttr(default_factory=dict)
    """The same, as told on a command line in place of the file."""
    _sources: tuple[EffectSource, ...] = PrivateAttr(default=())
    """What the files of `own_effects` hold; empty where they were not read, as of a stored unit."""

    def __setstate__(self, state: dict[Any, Any]) -> None:
        super().__setstate__(state)
        announce(self._sources)

    @model_validator(mode="after")
    def _has_no_contradiction(self) -> Self:
        fault = find_contradiction(self)
        if fault:
            raise ValueError(fault)
        return self

    @model_validator(mode="after")
    def _has_known_tolerances(self) -> Self:
        fault = find_fault(self.parameters, self.tolerance or {})
        if fault:
            raise ValueError(fault)
        return self

    @model_validator(mode="after")
    def _has_whole_stages(self) -> Self:
        if self.stage2 is not None and self.stage1.J_p2 is None:
            raise ValueError("stage1.J_p2 is required by [stage2]; a one-stage drive has neither")
        if self.stage2 is None and self.stage1.J_p2 is not None:
            raise ValueError("[stage2] is required by stage1.J_p2; a one-stage drive has neither")
        if self.stage2 is None and self.stage3 is not None:
            raise ValueError("[stage2] is required by [stage3], which is behind it")
        if self.stage2 is None and self.limits.b2_deg is not None:
            raise ValueError("limits.b2_deg limits stage 2, and there is none; leave it out")
        if self.stage2 is None and self.acceptance is not None and self.acceptance.b2_deg:
            raise ValueError("acceptance.b2_deg limits stage 2, and there is none; leave it out")
        return self

    @property
    def stages(self) -> int:
        """Number of gear stages, 1 to 3."""
        return 1 if self.stage2 is None else 2 if self.stage3 is None else 3

    @property
    def output_ratio(self) -> float:
        """Ratio from shaft 1 to the load: that of the stages behind it, or 1 without any."""
        return self.last_ratio * (1.0 if self.stage2 is None else self.stage2.N)

    @property
    def last_ratio(self) -> float:
        """Ratio from gear 2 to the load: that of stage 3, or 1 where there is none."""
        return 1.0 if self.stage3 is None else self.stage3.N_3

    def split(self, ratio: float) -> StageBacklash:
        """The backlash of each stage at a contribution ratio, that of stage 3 as it is known.

        Raises
        ------
        ConfigurationError
            If the ratio is outside 0 to 1, or not 1 where there is one stage only.
        """
        if self.stage2 is None and ratio != 1.0:
            raise ConfigurationError(
                f"contribution ratio {ratio}: unit {self.name} has one gear stage, which holds "
                "all of the backlash; give 1"
            )
        b_t_deg = self.backlash.b_t_deg
        if self.stage3 is None:
            return stage_backlash(ratio, b_t_deg, self.output_ratio)
        b3_deg = min(self.stage3.b3_deg, b_t_deg)
        known = stage_backlash(ratio, b_t_deg - b3_deg, self.output_ratio)
        return replace(known, b2_deg=known.b2_deg * self.last_ratio, b3_deg=b3_deg)

    @property
    def parameters(self) -> dict[str, float]:
        """All scalar physical parameters by symbol."""
        sections = (
            self.motor,
            self.electronics,
            self.stage1,
            self.stage2,
            self.load,
            self.backlash,
            *(getattr(self, name) for name in OPTIONAL_SECTIONS),
        )
        return {
            name: value
            for section in sections
            if section is not None
            for name, value in section.model_dump().items()
            if isinstance(value, float)
        }

    @property
    def effect_sources(self) -> tuple[EffectSource, ...]:
        """Its files of further effects; empty where they were not read, as of a stored unit."""
        return self._sources

    def with_effect_sources(self, sources: tuple[EffectSource, ...]) -> Unit:
        """A copy with the files of its own effects."""
        copy = self.model_copy()
        copy._sources = sources
        return copy

    @property
    def tolerances(self) -> dict[str, float]:
        """What is believed of the datasheet: one standard deviation of each value, as a share."""
        return {symbol: share for symbol, (share, _) in self.believed.items()}

    @property
    def believed(self) -> dict[str, tuple[float, str]]:
        """The same with where it comes from: ``option``, ``unit file`` or ``default``."""
        return believed_shares(self.parameters, self._override, self.tolerance or {})

    def with_tolerance(self, shares: Mapping[str, float]) -> Unit:
        """A copy of which the datasheet is believed otherwise.

        Parameters
        ----------
        shares
            By symbol, or ``default`` for all values but exact ones; they override the file's.

        Raises
        ------
        ConfigurationError
            If a symbol has no tolerance, or a share is not between 0 and 0.5.
        """
        fault = find_fault(self.parameters, shares)
        if fault:
            raise ConfigurationError(f"unit {self.name}: {fault}")
        copy = self.model_copy()
        copy._override = {**self._override, **shares}
        return copy

    @property
    def physics(self) -> dict[str, Any]:
        """What decides how it moves, as JSON: not its name, limits, tolerance or commissioning.

        Files of its own effects count by their digests.

        Whatever is stored of a unit, and every seed, depends on this alone.
        """
        known = self.model_dump(mode="json", exclude=NO_PHYSICS)
        known = {k: v for k, v in known.items() if v is not None or k not in OPTIONAL_SECTIONS}
        if self._sources:
            known["own_effects"] = [source.digest for source in self._sources]
        return known

    def with_parameters(self, **changes: float) -> Unit:
        """A copy with some parameters changed by symbol, checked like a file.

        Raises
        ------
        ConfigurationError
            If a symbol does not exist or a value is not allowed.
        """
        document = self.model_dump(by_alias=True, exclude_none=True)
        known = self.parameters
        for symbol, value in changes.items():
            if symbol not in known:
                raise ConfigurationError(
                    f"unit {self.name}: there is no parameter {symbol!r}; "
                    f"use one of: {', '.join(sorted(known))}"
                )
            for name, section in document.items():
                if name in NO_PHYSICS or not isinstance(section, dict):
                    continue
                if symbol in section:
                    section[symbol] = float(value)
        changed = unit_from_mapping(document, source=f"unit {self.name}")
        changed._override = dict(self._override)
        changed._sources = self._sources
        return changed


def unit_from_mapping(document: dict[str, Any], source: str) -> Unit:
    """Check a parsed unit file; every fault is named in one message.

    Raises
    ------
    ConfigurationError
        Names `source`, then key and fault for each thing that is wrong.
    """
    try:
        return Unit.model_validate(_lists_as_tuples(document))
    except ValidationError as error:
        faults = "; ".join(map(_told, error.errors()))
        raise ConfigurationError(f"{source}: {faults}") from error


def _told(fault: Any) -> str:
    """One thing that is wrong: key, what it is, and the value where that says more."""
    key = ".".join(str(part) for part in fault["loc"])
    if fault["type"] == "value_error":
        words = str(fault["msg"]).removeprefix("Value error, ")
        return words if not key or words.startswith(key) else f"{key}: {words}"
    got = "" if fault["type"] == "missing" else f" (got {fault['input']!r})"
    return f"{key}: {fault['msg']}{got}"


def _lists_as_tuples(value: Any) -> Any:
    # TOML has integers where a person means a real number, and lists where the
    # model has tuples; both are meant, so only these two are converted.
    if isinstance(value, dict):
        return {
            key: (item if key == "schema" else _lists_as_tuples(item))
            for key, item in value.items()
        }
    if isinstance(value, list):
        return tuple(_lists_as_tuples(item) for item in value)
    if isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    return value


@dataclass(frozen=True, slots=True)
class StageBacklash:
    """Backlash of each stage, equations (15), (16) and (20)."""

    b1_deg: float
    """Full play at gear 1 with the pinion held, degrees."""
    b2_deg: float
    """Full play at gear 2 with pinion 2 held, degrees: at the output, but with three stages."""
    b3_deg: float = 0.0
    """Full play at the output of a third stage, degrees."""

    @property
    def half_plays_rad(self) -> tuple[float, float]:
        """Half of each play in rad, equation (16): delta_i = pi b_i / 360."""
        return math.pi * self.b1_deg / 360.0, math.pi * self.b2_deg / 360.0


def stage_backlash(ratio: float, b_t_deg: float, N: float) -> StageBacklash:
    """Split the total backlash by the contribution ratio, equations (15) and (20).

    Parameters
    ----------
    ratio
        Contribution ratio r = (b_1/N)/b_t of stage 1, 0 to 1.
    b_t_deg
        Total backlash at the output, degrees.
    N
        Ratio of stage 2.

    Raises
    ------
    ConfigurationError
        If the ratio is outside 0 to 1.
    """
    if not 0.0 <= ratio <= 1.0:
        raise ConfigurationError(f"contribution ratio {ratio} is outside 0 to 1")
    return StageBacklash(b1_deg=ratio * b_t_deg * N, b2_deg=(1.0 - ratio) * b_t_deg)
