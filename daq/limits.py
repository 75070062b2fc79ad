"""Limits on what may be driven, checked on this side before any byte is sent.

Owns the limits of bench, unit and recipe and the verdict on a plan. Each of
them is checked by itself, so that none can loosen another. They are
independent of the instrument's own ranges and of its auto-level limits, and
they do not replace hardware protection.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from daq.configs import config_path
from daq.errors import LimitError
from daq.plan import SweepPlan
from daq.untrusted.toml_files import NonNegative, Positive, Section, load_toml

__all__ = ["Bench", "Limits", "check_plan", "load_bench", "tightest"]


@dataclass(frozen=True, slots=True)
class Limits:
    """What one authority allows; a bound that it does not set is infinite (or 0 Hz).

    Parameters
    ----------
    set_by
        Who sets them, as in ``"bench default"`` or ``"unit ADSS"``.
    source_vpk
        Highest source level, V peak.
    source_offset_v
        Largest magnitude of the DC offset, V.
    source_peak_v
        Largest level plus magnitude of the offset, V.
    start_hz, stop_hz
        Band in which may be driven, Hz.
    duration_s
        Longest time that one plan may drive, s.
    """

    set_by: str
    source_vpk: float = math.inf
    source_offset_v: float = math.inf
    source_peak_v: float = math.inf
    start_hz: float = 0.0
    stop_hz: float = math.inf
    duration_s: float = math.inf


class BenchLimits(Section):
    """The ``[limits]`` table of a bench."""

    source_vpk: Positive
    source_offset_v: NonNegative
    source_peak_v: Positive
    start_hz: Positive
    stop_hz: Positive
    duration_s: Positive


class BenchDrive(Section):
    """The ``[drive]`` table of a bench: how the source comes up, how the inputs are ranged."""

    slew_vpk_per_s: NonNegative
    channel1_range_vpk: Positive | None = None
    """Fixed input range, V peak; left out, the analyser ranges by itself."""
    channel2_range_vpk: Positive | None = None


class BenchInstrument(Section):
    """The ``[instrument]`` table of a bench: which one it is, and when it was calibrated."""

    address: Annotated[str, Field(min_length=1, max_length=200)] | None = None
    """Where it is reached, as for ``--instrument``."""
    calibrated: date | None = None
    calibration_due: date | None = None
    certificate: Annotated[str, Field(max_length=200)] | None = None
    """Number of its calibration certificate."""

    @model_validator(mode="after")
    def _is_in_order(self) -> Self:
        if self.calibrated and self.calibration_due and self.calibrated > self.calibration_due:
            raise ValueError(f"calibrated {self.calibrated} is after due {self.calibration_due}")
        return self


class BenchReport(Section):
    """The ``[report]`` table of a bench: whose certificates it writes."""

    organisation: Annotated[str, Field(max_length=200)] | None = None
    logo: Annotated[str, Field(min_length=1, max_length=1000)] | None = None
    """A PNG, JPEG or SVG file, relative to the bench file."""


class Bench(Section):
    """A place where units are measured."""

    schema_: Literal[1] = Field(alias="schema")
    name: Annotated[str, Field(min_length=1, max_length=64)]
    limits: BenchLimits
    drive: BenchDrive
    instrument: BenchInstrument = BenchInstrument()
    report: BenchReport = BenchReport()
    judge: Annotated[str, Field(min_length=1, max_length=1000)] | None = None
    """Limits that the screen judges by: a file, relative to the bench file, or a unit's name."""

    def bounds(self) -> Limits:
        """What this bench allows."""
        return Limits(set_by=f"bench {self.name}", **self.limits.model_dump())


def load_bench(name_or_path: str = "default") -> Bench:
    """Read a bench by the name of one that comes with lashbench, or by path.

    Raises
    ------
    ConfigurationError
        If the file is not there, or anything in it is wrong.
    """
    return load_toml(Bench, config_path("benches", name_or_path))


def tightest(limits: Sequence[Limits]) -> Limits:
    """What all of them together allow, for showing."""
    return Limits(
        set_by=", ".join(limit.set_by for limit in limits),
        source_vpk=min((limit.source_vpk for limit in limits), default=math.inf),
        source_offset_v=min((limit.source_offset_v for limit in limits), default=math.inf),
        source_peak_v=min((limit.source_peak_v for limit in limits), default=math.inf),
        start_hz=max((limit.start_hz for limit in limits), default=0.0),
        stop_hz=min((limit.stop_hz for limit in limits), default=math.inf),
        duration_s=min((limit.duration_s for limit in limits), default=math.inf),
    )


def check_plan(plan: SweepPlan, limits: Sequence[Limits], duration_s: float | None = None) -> None:
    """Refuse a plan that any limit forbids; sends nothing.

    Parameters
    ----------
    plan
        What is to be driven.
    limits
        Of bench, unit, recipe, in any order.
    duration_s
        How long it will take, s, where that is more than the plan's own cycles.

    Raises
    ------
    LimitError
        Names every limit that is passed, who sets it, and the value asked for.
    """
    time_s = plan.duration_s if duration_s is None else max(duration_s, plan.duration_s)
    faults = [fault for limit in limits for fault in _faults(plan, limit, time_s)]
    if faults:
        raise LimitError(f"{'; '.join(faults)}; nothing was sent, change the plan")


def _faults(plan: SweepPlan, limit: Limits, time_s: float) -> list[str]:
    level_vpk = max(plan.levels_vpk)
    offset_v = abs(plan.dc_offset_v)
    lowest_hz, highest_hz = min(plan.frequencies_hz), max(plan.frequencies_hz)
    passed = [
        (level_vpk, limit.source_vpk, "source level", "V peak"),
        (offset_v, limit.source_offset_v, "source offset", "V"),
        (level_vpk + offset_v, limit.source_peak_v, "level plus offset", "V"),
        (highest_hz, limit.stop_hz, "frequency", "Hz"),
        (time_s, limit.duration_s, "duration", "s"),
    ]
    faults = [
        f"{what} {value:g} {unit} is above the {bound:g} {unit} of {limit.set_by}"
        for value, bound, what, unit in passed
        if not value <= bound
    ]
    if not lowest_hz >= limit.start_hz:
        faults.append(
            f"frequency {lowest_hz:g} Hz is below the {limit.start_hz:g} Hz of {limit.set_by}"
        )
    return faults
