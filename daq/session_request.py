"""What a session is asked to do, checked to make sense before anything is opened.

Owns the record and nothing else.
"""

from __future__ import annotations

from dataclasses import dataclass

from daq.adaptive import Judge, Refinement
from daq.errors import InputError
from daq.limits import Limits
from daq.preflight import Plausibility
from daq.store_records import MeasurementHeader

__all__ = ["SessionRequest"]


@dataclass(frozen=True, slots=True)
class SessionRequest:
    """What a session is to do.

    Parameters
    ----------
    header
        The new measurement; None where an old one is resumed.
    limits
        Of bench, unit and recipe.
    resume
        Identifier of the measurement to go on with.
    remeasure_hz
        Band (lowest, highest) whose stored points are measured again; with `resume` only.
    slew_vpk_per_s, input_range_vpk
        See `daq.analyser.PointSettings`.
    plausible
        What the trial point must look like.
    run_in_points
        Stored points driven again, unrecorded, before a level goes on in the
        middle; None for all of that level so far. A servo with play has
        branches that only an unbroken sweep stays on, so all is the preset.
    refinement, judge
        Go on around the features after the plan, see `daq.adaptive`.

    Raises
    ------
    InputError
        If these do not go together.
    """

    header: MeasurementHeader | None
    limits: tuple[Limits, ...]
    resume: int | None = None
    remeasure_hz: tuple[float, float] | None = None
    slew_vpk_per_s: float = 10.0
    input_range_vpk: tuple[float | None, float | None] = (None, None)
    plausible: Plausibility = Plausibility()
    run_in_points: int | None = None
    refinement: Refinement | None = None
    judge: Judge | None = None

    def __post_init__(self) -> None:
        if (self.header is None) == (self.resume is None):
            raise InputError("a session needs either a new measurement or one to resume")
        if self.remeasure_hz is not None:
            low_hz, high_hz = self.remeasure_hz
            if self.resume is None or not 0 < low_hz <= high_hz:
                raise InputError(
                    f"band {low_hz:g} to {high_hz:g} Hz to measure again: give a measurement to "
                    "resume, and the lower frequency first"
                )
        if self.run_in_points is not None and self.run_in_points < 0:
            raise InputError(f"a run-in of {self.run_in_points} points is none; give 0 or more")
        if (self.refinement is None) != (self.judge is None):
            raise InputError("refinement needs a target and someone to judge it")
