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
from tui.history_rows import (
    QUANTITIES,
    estimated_groups,
    measurement_row,
    trend_lines,
    trend_rows,
)
from tui.layout import WIDTH, table_lines, wrapped
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
_BAR, _LEAST_BAR = 41, 11
"""Columns from a ratio of 0 to one of 1, and how few of them there may be beside long numbers."""


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
        told = [part for line in trend_lines(trends) for part in wrapped(line, indent="  ")]
        console.data("\n".join([*_measured(rows), *_estimated(rows), *told]))


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


def _measured(rows: Sequence[dict[str, Any]]) -> list[str]:
    """What was measured when, and how far; names of units and specimens may be long."""
    return table_lines(
        ("id", "started (UTC)", "unit", "serial", "state", "points"),
        [
            (
                str(row["id"]),
                row["started"][:16].replace("T", " "),
                row["unit"] + (" (SIMULATED)" if row["simulated"] else ""),
                row["serial"] or "-",
                row["state"],
                f"{row['points']}/{row['planned']}",
            )
            for row in rows
        ],
        may_wrap=(2, 3),
    )


def _estimated(rows: Sequence[dict[str, Any]]) -> list[str]:
    """The estimates of each unit, the contribution ratio as a dot with its bar from 0 to 1, too."""
    lines = []
    for (unit, serial), group in estimated_groups(rows).items():
        name = f"{unit} {serial}".strip()
        numbers = [
            tuple(
                _shown(row[name], digits)
                for name, digits in zip(QUANTITIES, (3, 4, 4), strict=True)
            )
            for row in group
        ]
        head = ("r", "b1 / deg", "b2 / deg")
        widths = [max(map(len, column)) for column in zip(head, *numbers, strict=True)]
        left = max(5, *(len(str(row["id"])) for row in group))
        bar = min(_BAR, max(_LEAST_BAR, WIDTH - left - 1 - sum(widths) - 2 * len(widths)))
        title = f"backlash of {name}; contribution ratio r from 0 to 1; one standard error"
        lines += ["", *wrapped(title)]
        for key, picture, texts in [
            ("", f"0{'':{bar - 2}}1", head),
            *(
                (str(row["id"]), _bar(row["contribution_ratio"], bar), texts)
                for row, texts in zip(group, numbers, strict=True)
            ),
        ]:
            cells = (f"{text:<{width}}" for text, width in zip(texts, widths, strict=True))
            lines.append("  ".join((f"{key:>{left}} {picture}", *cells)).rstrip())
    return lines


def _shown(number: Mapping[str, float] | None, digits: int) -> str:
    return "-" if not number else f"{number['value']:.{digits}f} +- {number['std']:.{digits}f}"


def _bar(ratio: Mapping[str, float], width: int) -> str:
    def place(value: float) -> int:
        return round(min(max(value, 0.0), 1.0) * (width - 1))

    cells = ["."] * width
    value, std = ratio["value"], ratio["std"]
    for cell in range(place(value - std), place(value + std) + 1):
        cells[cell] = "-"
    cells[place(value)] = "o"
    return "".join(cells)
