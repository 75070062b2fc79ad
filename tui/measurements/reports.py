"""Reports on stored measurements, for the command line and the screens alike.

Owns what goes into a report. Which stored estimate is taken is
`tui.measurements.stored_answers`'s part. It prints nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daq.servers.place import HistoryPlace

if TYPE_CHECKING:
    from analysis.report import Diagnosed
    from sim.unit import Unit

__all__ = ["report_measurement"]


def report_measurement(
    path: Path,
    db: HistoryPlace,
    measurement: int,
    unit: Unit,
    *,
    estimate: Mapping[str, Any] | None = None,
    diagnosis: Diagnosed | None = None,
    remarks: Mapping[str, str] | None = None,
) -> Path:
    """Write the report on a stored measurement.

    Parameters
    ----------
    path
        HTML file to write.
    estimate
        Document of ``estimate --json``; the one in the history, if left out.

    Raises
    ------
    LashbenchError
        As `analysis.report.write_report` and `daq.store.Store`.
    """
    from analysis.observation.input_check import check_inputs
    from analysis.report import stored_origin, write_report
    from daq.store import Store
    from tui.measurements.stored_answers import kept_estimate

    with Store(db, read_only=True) as store:
        response, origin = store.response(measurement), stored_origin(store, measurement)
        estimate = estimate or kept_estimate(store, measurement, unit)
    said = check_inputs([response], unit, as_is=True)
    remarks = {**(remarks or {}), **({"input": "; ".join(said)} if said else {})}
    return write_report(
        path, response, unit, origin, estimate=estimate, diagnosis=diagnosis, remarks=remarks
    )
