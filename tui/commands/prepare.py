"""``lashbench prepare``: train the posterior of a unit, or simulate ahead what a sweep needs.

Owns the options of the verb. What is worth making ahead is the analysis's.
"""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Literal, cast

from daq.errors import InputError, LashbenchError
from tui.executors import executor_at
from tui.measure_options import PlanOptions, swept_plan
from tui.options import Cluster, Json, Real, Tolerance, UnitName, Whole
from tui.places import cache_folder
from tui.reading_options import NO_LAYOUT, LayoutOptions, ReadingOptions, read_file
from tui.text.output import Console, Injected
from tui.unit_under_test import read_unit

if TYPE_CHECKING:
    from analysis.observation.observation import Observation
    from daq.plan import Direction
    from sim.unit import Unit

__all__ = ["prepare"]

_MACHINES = 30_000
"""Machines of a posterior: some ten minutes of two cores, and as much for training."""


def prepare(
    file: Path | None = None,
    /,
    *,
    unit: UnitName,
    machines: Whole | None = None,
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
    """Train what the diagnosis of a unit needs, or simulate ahead what a sweep needs.

    Without a sweep: the posterior of the unit is trained on simulated machines, for every sweep of
    it. It can be interrupted, and goes on where it was. With the options of `measure`, or with a
    response: the runs that the estimate and the diagnosis of such a sweep are compared with.

    Parameters
    ----------
    file
        A response of the sweep, in place of the options below, which then complete it.
    machines
        Machines to simulate for the posterior; 30000 if left out. More make it sharper.
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
    options = PlanOptions(
        tuple(level or ()), start, stop, points, spacing, direction,
        settle_cycles, integrate_cycles, offset,
    )  # fmt: skip
    subject = read_unit(unit, console, tolerance)
    if file is None and not options.given and recipe is None:
        _train(subject, _MACHINES if machines is None else machines, cluster, json, console)
        return
    if machines is not None:
        raise InputError(
            "--machines: the posterior serves every sweep; leave out the options of a sweep"
        )
    observation = _observation(file, options, recipe, layout, console)
    from analysis.precompute import prepare_sweep

    began, folder = time.perf_counter(), cache_folder()
    with executor_at(cluster, console.compute) as executor:
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


def _train(subject: Unit, machines: int, cluster: str | None, json: bool, console: Console) -> None:
    if machines < 1:
        raise InputError(f"--machines: {machines} is too few; give 1 or more")
    from analysis.precompute import prepare_unit

    began, folder = time.perf_counter(), cache_folder()
    with executor_at(cluster, console.compute) as executor:
        made = prepare_unit(subject, machines, folder, executor=executor, told=console.note)
    elapsed_s = time.perf_counter() - began
    if json:
        console.document(
            {
                "unit": subject.name,
                "machines": made.machines,
                "steps": made.steps,
                "figures": made.figures,
                "kept_in": str(folder),
                "elapsed_s": elapsed_s,
            }
        )
    else:
        console.data(
            f"{subject.name}: posterior trained on {made.machines} machines in {elapsed_s:.0f} s, "
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
        from analysis.observation.observation import unread
        from analysis.observation.reading_noise import USUAL_NOISE_V
        from daq.recipe import load_recipe

        if layout != NO_LAYOUT:
            raise InputError("there is no file that an option could complete; leave it out")
        way = None if recipe is None else load_recipe(recipe)
        return unread(swept_plan(options, way), USUAL_NOISE_V)
    told, sweep = _said_of(file, options, layout)
    if sweep or recipe is not None:
        raise InputError(f"{file}: give either a response or the options of a sweep, not both")
    from analysis.observation.observation import observe
    from analysis.observation.rounding import settled
    from analysis.observation.thinning import thin_responses

    (response,), _ = thin_responses([settled(read_file(file, told, console))])
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
