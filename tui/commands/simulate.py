"""``lashbench simulate``: a simulated response to a file.

Owns the options of the verb. What a sweep or an effect may be is decided by
the floors below.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from daq.errors import InputError
from tui.options import Real, UnitName, Whole, parameter_settings
from tui.text.output import Injected
from tui.unit_under_test import ratio_of_unit, read_unit

__all__ = ["simulate"]

_MOST_CYCLES = 10_000_000
"""Cycles that are kept until their mean is taken: 64 bytes each."""
_LONGEST_S = 1e5
"""Motion that takes hours to simulate: nobody means a longer one."""


def simulate(
    *,
    unit: UnitName,
    ratio: Real | None = None,
    level: list[Real],
    start: Real,
    stop: Real,
    points: Whole,
    spacing: Literal["lin", "log"] = "lin",
    direction: Literal["up", "down"] = "up",
    settle_cycles: Whole | None = None,
    integrate_cycles: Whole | None = None,
    offset: Real = 0.0,
    from_rest: bool = False,
    excitation: Literal["stepped", "multisine", "chirp", "noise"] = "stepped",
    resolution: Real | None = None,
    phases: Literal["schroeder", "random"] | None = None,
    effect: list[str] | None = None,
    set_: Annotated[list[str] | None, Parameter(name="--set")] = None,
    seed: Whole = 0,
    out: Path,
    console: Injected,
) -> None:
    """Simulate a measurement, a stepped-sine sweep if not told otherwise, and write the response.

    Parameters
    ----------
    ratio
        Contribution ratio of stage 1 to the total backlash, 0 to 1; not needed with one stage.
    level
        Source level in V peak, of other signals that of a sine of the same rms; repeat it for
        several.
    start
        Lowest frequency in Hz.
    stop
        Highest frequency in Hz.
    points
        Number of frequencies at each level.
    spacing
        Linear or logarithmic grid.
    direction
        Order in which the frequencies are visited.
    settle_cycles
        Drive cycles waited at each point, 20 if not given; periods or segments of other signals, 2.
    integrate_cycles
        Drive cycles averaged at each point, 30 if not given; periods of a multisine or chirp, 8;
        segments of noise, half overlapped, 40.
    offset
        Constant voltage added to the source, in V.
    from_rest
        Start every point from rest, as the paper does; without it the motion
        carries on from point to point as in a real sweep.
    excitation
        Signal that drives the servo: a multisine or chirp that is repeated and averaged, or noise
        (H1, Hann).
    resolution
        Step of frequencies of such a signal, Hz: 1 over its period or segment; the smallest step
        between the points if not given.
    phases
        Of the lines of a multisine: Schroeder's, for low peaks, or random ones by the seed.
    effect
        Extension of the model, ID:param=value[,param=value]; repeat it for several.
    set_
        Another value for one of the unit's parameters, PARAM=VALUE in SI
        units; repeat it for several.
    seed
        Start of the random numbers.
    out
        File to write: csv, h5, uff or mat by its suffix.
    """
    from daq.excitation.choices import plan_by_signal, signal_words, usual_cycles
    from daq.formats import check_writable, write_response
    from daq.plan import SweepPlan, spaced_frequencies
    from sim.effects import parse_effect
    from sim.response import simulate as simulated

    check_writable(out, unit)
    if seed < 0:
        raise InputError(f"--seed {seed} is negative; give 0 or more")
    cycles = usual_cycles(excitation, settle_cycles, integrate_cycles)
    if points * len(level) * cycles[1] > _MOST_CYCLES:
        raise InputError(
            f"{points} points of {cycles[1]} cycles at {len(level)} levels are more than "
            f"{_MOST_CYCLES} cycles; give fewer"
        )
    subject = read_unit(unit, console, settings=parameter_settings(set_ or []))
    contribution = ratio_of_unit(subject, ratio)
    plan = SweepPlan(
        frequencies_hz=spaced_frequencies(start, stop, points, spacing),
        levels_vpk=tuple(level),
        direction=direction,
        settle_cycles=cycles[0],
        integrate_cycles=cycles[1],
        from_rest=from_rest,
        dc_offset_v=offset,
    )
    if excitation != "stepped":
        excited = plan_by_signal(plan, excitation, resolution, phases, seed)
        console.note(signal_words(excited))
        plan = excited
    elif resolution is not None or phases is not None:
        raise InputError("--resolution and --phases are for other signals than a stepped sine; "
                         "give --excitation, or leave them out")  # fmt: skip
    if plan.duration_s > _LONGEST_S:
        raise InputError(
            f"the sweep lasts {plan.duration_s:.3g} s, more than {_LONGEST_S:.0f} s; "
            "give fewer points or cycles, or a higher start"
        )
    effects = tuple(parse_effect(text) for text in effect or [])
    console.note(
        f"simulating {subject.name}: {plan.points} points, {plan.duration_s:.0f} s of motion"
    )
    began = time.perf_counter()
    response = simulated(
        subject, contribution, plan, effects=effects, seed=seed, progress=console.progress
    )
    write_response(response, out)
    console.note(f"wrote {out} after {time.perf_counter() - began:.1f} s")
