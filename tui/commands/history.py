"""``lashbench history``: the measurements of a bench, and how a unit's backlash changes.

Owns the options of the verb and the tables. Estimates that the history lacks
are made by the analysis and kept, so that the next look is quick.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from daq.errors import AnalysisError, ConfigurationError, InputError, LashbenchError
from tui.executors import executor_at
from tui.history_rows import estimated_groups, measurement_row, trend_lines, trend_rows
from tui.options import Cluster, Json
from tui.output import Console, Injected
from tui.places import cache_folder, history_path
from tui.reports import estimates_in_force, keep_estimate, unit_as_measured

if TYPE_CHECKING:
    from analysis.executor import Executor
    from daq.store import Store
    from daq.store_records import Measurement

__all__ = ["history"]

_BUDGET_S = 45.0
"""Time after which `--estimate some` begins no further estimate."""
_BAR = 41


def history(
    *,
    db: Path | None = None,
    unit: Annotated[str | None, Parameter(name="--unit")] = None,
    estimate: Literal["none", "some", "all"] = "some",
    cluster: Cluster = None,
    json: Json = False,
    console: Injected,
) -> None:
    """List the measurements of a bench, oldest first, with the trend of r, b1 and b2.

    Complete measurements that were not estimated since their last point are
    estimated now, which takes a while, and the result is kept in the history.

    Parameters
    ----------
    db
        File of the bench's history; yours, if left out.
    unit
        Only measurements of this unit: adss, edss, the path of a unit file, or a name.
    estimate
        Which missing estimates to make: none, all, those that failed once more
        among them, or some, that is to begin no more of them after 45 s.
    """
    from daq.store import Store

    db = history_path(db)
    with Store(db, read_only=True) as store:
        measurements = store.measurements(_unit_name(unit, store))
        known = estimates_in_force(store, measurements)
    done = {key for key, document in known.items() if estimate != "all" or "failed" not in document}
    lacking = [m for m in measurements if m.state == "complete" and m.id not in done]
    if estimate != "none" and lacking:
        with executor_at(cluster) as executor:
            known |= _estimates(db, lacking, estimate == "all", executor, console)
    rows = [
        measurement_row(measurement, known.get(measurement.id, {})) for measurement in measurements
    ]
    trends = trend_rows(rows)
    if json:
        console.document({"measurements": rows, "trends": trends})
    elif not rows:
        console.data("no measurements; lashbench measure --help says how to make one")
    else:
        console.data("\n".join([_table(rows), *_pictures(rows), *trend_lines(trends)]))


def _unit_name(unit: str | None, store: Store) -> str | None:
    """The name that units of the history bear."""
    from sim.unit import load_unit

    if unit is None:
        return None
    stored = {m.header.unit.lower() for m in store.measurements()}
    if unit.lower() in stored:
        return unit
    try:
        return load_unit(unit).name
    except ConfigurationError as error:
        names = ", ".join(sorted(stored)) or "none"
        raise InputError(f"{error}; units in this history: {names}") from error


def _estimates(
    db: Path,
    lacking: Sequence[Measurement],
    every: bool,
    executor: Executor | None,
    console: Console,
) -> dict[int, Mapping[str, Any]]:
    """Make estimates and keep them where the history may be written."""
    began_s = time.monotonic()
    made: dict[int, Mapping[str, Any]] = {}
    for count, measurement in enumerate(lacking):
        if not every and made and time.monotonic() - began_s > _BUDGET_S:
            console.note(
                f"{len(lacking) - count} complete measurements are not estimated yet; run this "
                "again, or with --estimate all"
            )
            break
        console.note(f"estimating measurement {measurement.id}")
        made[measurement.id] = _estimate(db, measurement, executor, console)
        try:
            keep_estimate(db, measurement, made[measurement.id])
        except LashbenchError as error:
            console.note(f"the estimate is shown but not kept: {error}")
    return made


def _estimate(
    db: Path, measurement: Measurement, executor: Executor | None, console: Console
) -> dict[str, Any]:
    from analysis.estimate import estimate_response
    from daq.store import Store

    try:
        with Store(db, read_only=True) as store:
            response = store.response(measurement.id)
        unit = unit_as_measured(measurement)
        result = estimate_response(
            response, unit, progress=console.progress, cache=cache_folder(), executor=executor
        )
        content: dict[str, Any] = result.to_json()
    except (AnalysisError, InputError, ValueError) as error:
        # A lost cluster is not among them: it says nothing of the data, and ends the verb.
        console.note(f"measurement {measurement.id} gives no estimate: {error}")
        return {"failed": str(error)}
    return content


def _table(rows: Sequence[dict[str, Any]]) -> str:
    def shown(row: dict[str, Any], name: str, digits: int) -> str:
        number = row[name]
        return "-" if not number else f"{number['value']:.{digits}f} +- {number['std']:.{digits}f}"

    return _aligned(
        ("id", "started (UTC)", "unit", "serial", "state", "points", "r", "b1 / deg", "b2 / deg"),
        [
            (
                str(row["id"]),
                row["started"][:16].replace("T", " "),
                row["unit"] + (" (SIMULATED)" if row["simulated"] else ""),
                row["serial"] or "-",
                row["state"],
                f"{row['points']}/{row['planned']}",
                shown(row, "contribution_ratio", 3),
                shown(row, "b1_deg", 4),
                shown(row, "b2_deg", 4),
            )
            for row in rows
        ],
    )


def _aligned(headers: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    widths = [max(len(row[column]) for row in (headers, *rows)) for column in range(len(headers))]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in (headers, ["-" * width for width in widths], *rows)
    )


def _pictures(rows: Sequence[dict[str, Any]]) -> list[str]:
    """The contribution ratio of each unit as dots with error bars from 0 to 1."""
    lines = []
    for (unit, serial), group in estimated_groups(rows).items():
        name = f"{unit} {serial}".strip()
        lines += [
            "",
            f"contribution ratio of {name}, one standard error",
            f"{'':6}0{'':{_BAR - 2}}1",
        ]
        for row in group:
            ratio = row["contribution_ratio"]
            bar = _bar(ratio["value"], ratio["std"])
            lines.append(f"{row['id']:>5} {bar}  {ratio['value']:.3f} +- {ratio['std']:.3f}")
    return lines


def _bar(value: float, std: float) -> str:
    def place(ratio: float) -> int:
        return round(min(max(ratio, 0.0), 1.0) * (_BAR - 1))

    cells = ["."] * _BAR
    for cell in range(place(value - std), place(value + std) + 1):
        cells[cell] = "-"
    cells[place(value)] = "o"
    return "".join(cells)
