"""``lashbench plan``: the sweep that tells most of a unit in a given time.

Owns the options of the verb and that no file is overwritten. The choice is the analysis's.
"""

from __future__ import annotations

from pathlib import Path

from tui.executors import executor_at
from tui.options import Cluster, Json, Real, Tolerance, UnitName
from tui.text.output import Injected
from tui.text.shell_quote import pasted
from tui.unit_under_test import USUAL_MIN, checked_minutes, read_unit, within_bench

__all__ = ["plan"]


def plan(
    *,
    unit: UnitName,
    minutes: Real = USUAL_MIN,
    out: Path | None = None,
    bench: str = "default",
    tolerance: Tolerance = None,
    cluster: Cluster = None,
    json: Json = False,
    console: Injected,
) -> None:
    """Choose band, levels and points for a unit that was not measured yet.

    Says where ARF and RF will be, how well the sweep will tell the contribution ratio, and which
    levels are too low to move the drive.

    Parameters
    ----------
    minutes
        Time at the bench.
    out
        Recipe file (TOML) to write for ``measure --recipe``; one that exists is left alone.
    bench
        Bench file, by name or path: it limits levels and band as well as the unit.
    """
    from daq.formats.atomic import new_target, write_text

    checked_minutes(minutes, "--minutes")
    if out is not None:
        new_target(out)
    from analysis.planning import plan_sweep
    from daq.limits import load_bench

    place = load_bench(bench).bounds()
    subject = read_unit(unit, console, tolerance)
    own = subject.limits
    if place.source_vpk < own.source_vpk:
        console.note(f"{place.set_by} allows {place.source_vpk:g} V of the unit's "
                     f"{own.source_vpk:g} V; see --bench")  # fmt: skip
    subject = within_bench(subject, place)
    with executor_at(cluster, console.compute) as executor:
        found = plan_sweep(subject, minutes, executor=executor, progress=console.progress)
    if out is not None:
        write_text(out, found.recipe())
    if json:
        console.document(found.to_json())
    else:
        console.data("\n".join(found.summary()))
    if out is not None:
        words = pasted(["lashbench", "measure", "--recipe", str(out), "--unit", unit])
        console.note(f"wrote {out}; measure by it: {words} ...")
