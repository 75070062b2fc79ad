"""``lashbench plan``: the sweep that tells most of a unit in a given time.

Owns the options of the verb and that no file is overwritten. The choice is the analysis's.
"""

from __future__ import annotations

from pathlib import Path

from daq.errors import InputError
from tui.executors import executor_at
from tui.options import Cluster, Json, Real, Tolerance, UnitName
from tui.text.output import Injected
from tui.text.shell_quote import pasted
from tui.unit_under_test import read_unit

__all__ = ["plan"]

_LONGEST_MIN = 24.0 * 60.0


def plan(
    *,
    unit: UnitName,
    minutes: Real = 5.0,
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

    if not 0.0 < minutes <= _LONGEST_MIN:
        raise InputError(f"--minutes {minutes:g}: give more than 0 and at most {_LONGEST_MIN:g}")
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
    allowed = {
        "source_vpk": min(own.source_vpk, place.source_vpk),
        "start_hz": max(own.start_hz, place.start_hz),
        "stop_hz": min(own.stop_hz, place.stop_hz),
    }
    subject = subject.model_copy(update={"limits": own.model_copy(update=allowed)})
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
