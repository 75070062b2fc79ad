"""``lashbench prepare``: simulate ahead what a sweep will be held against.

Owns the options of the verb. What is worth simulating ahead is the analysis's.
"""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Literal, cast

from daq.errors import InputError, LashbenchError
from tui.executors import executor_at
from tui.measure_options import PlanOptions, swept_plan
from tui.options import Cluster, Json, Real, Tolerance, UnitName, Whole, tolerance_shares
from tui.output import Console, Injected
from tui.places import cache_folder
from tui.reading_options import NO_LAYOUT, LayoutOptions, ReadingOptions, read_file

if TYPE_CHECKING:
    from analysis.observation import Observation
    from daq.plan import Direction

__all__ = ["prepare"]


def prepare(
    file: Path | None = None,
    /,
    *,
    unit: UnitName,
    level: list[Real] | None = None,
    start: Real | None = None,
    stop: Real | None = None,
    points: Whole | None = None,
    spacing: Literal["lin", "log"] | None = None,
    direction: Literal["up", "down"] | None = None,
    settle_cycles: Whole | None = None,
    integrate_cycles: Whole | None = None,
    offset: Real | None = None,
    recipe: str | None = None,
    tolerance: Tolerance = None,
    cluster: Cluster = None,
    layout: LayoutOptions = NO_LAYOUT,
    json: Json = False,
    console: Injected,
) -> None:
    """Simulate ahead what the estimate and the diagnosis of a sweep will need.

    It depends on the unit and the sweep alone, so that it can be made before a
    measurement, or while one runs; every measurement of that sweep is then
    estimated in seconds. Give the options of `measure`, or a response of such a sweep.

    Parameters
    ----------
    file
        A response of the sweep, in place of the options below, which then complete it.
    level
        Source level in V peak; repeat it for several.
    start
        Lowest frequency in Hz.
    stop
        Highest frequency in Hz.
    points
        Number of frequencies at each level.
    spacing
        Linear or logarithmic grid; linear if left out.
    direction
        Order in which the frequencies are visited; up if left out.
    settle_cycles
        Drive cycles waited at each point; 20 if left out.
    integrate_cycles
        Drive cycles averaged at each point; 30 if left out.
    offset
        Constant voltage added to the source, in V.
    recipe
        Sweep recipe, by name or path: values for what is left out above.
    """
    from sim.unit import load_unit

    options = PlanOptions(
        tuple(level or ()), start, stop, points, spacing, direction,
        settle_cycles, integrate_cycles, offset,
    )  # fmt: skip
    subject = load_unit(unit).with_tolerance(tolerance_shares(tolerance))
    observation = _observation(file, options, recipe, layout, console)
    from analysis.preparation import prepare_sweep

    began, folder = time.perf_counter(), cache_folder()
    with executor_at(cluster) as executor:
        done = prepare_sweep(
            subject, observation, folder, executor=executor, progress=console.progress
        )
    elapsed_s = time.perf_counter() - began
    lost = done.needed - done.kept
    if lost and done.kept <= done.before:
        raise LashbenchError(
            f"{folder}: nothing of what was simulated could be kept; make room, and prepare again"
        )
    if lost:
        console.note(
            f"warning: {lost} of {done.needed} files could not be kept in {folder}, and will be "
            "simulated again; make room, and prepare again"
        )
    if json:
        console.document(
            {
                "unit": subject.name,
                "points": len(observation),
                "kept_in": str(folder),
                "simulated_s": done.simulated_s,
                "files": {"needed": done.needed, "kept": done.kept},
                "elapsed_s": elapsed_s,
            }
        )
    elif done.simulated_s == 0.0:
        console.data(f"{subject.name}: all of it was there already")
    else:
        console.data(
            f"{subject.name}: {done.simulated_s:.0f} s of motion simulated in {elapsed_s:.0f} s, "
            f"kept in {folder}"
        )


def _observation(
    file: Path | None,
    options: PlanOptions,
    recipe: str | None,
    layout: LayoutOptions,
    console: Console,
) -> Observation:
    """The sweep that is meant: that of a response, or one that will be measured."""
    if file is None:
        from analysis.observation import USUAL_NOISE_V, unread
        from daq.recipe import load_recipe

        if layout != NO_LAYOUT:
            raise InputError("there is no file that an option could complete; leave it out")
        way = None if recipe is None else load_recipe(recipe)
        return unread(swept_plan(options, way), USUAL_NOISE_V)
    told, sweep = _said_of(file, options, layout)
    if sweep or recipe is not None:
        raise InputError(f"{file}: give either a response or the options of a sweep, not both")
    from analysis.observation import observe
    from analysis.settled import settled
    from analysis.thinning import thin_all

    (response,), _ = thin_all([settled(read_file(file, told, console))])
    return observe(response)


def _said_of(
    file: Path, options: PlanOptions, layout: LayoutOptions
) -> tuple[ReadingOptions, set[str]]:
    """What the options say of a file that does not say it, and which can mean a sweep only."""
    if len(options.levels_vpk) > 1:
        raise InputError(f"{file}: a file without a level has one; give --level once")
    of_a_file = {"levels_vpk", "direction", "settle_cycles", "integrate_cycles"}
    told = ReadingOptions(
        **asdict(layout),
        level=str(options.levels_vpk[0]) if options.levels_vpk else None,
        sweep=cast("Direction | None", options.direction),
        settle_cycles=options.settle_cycles,
        integrate_cycles=options.integrate_cycles,
    )
    return told, set(options.given) - of_a_file
