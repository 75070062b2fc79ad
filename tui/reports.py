"""Reports on stored measurements, for the command line and the screens alike.

Owns which estimate is taken: the one that the history holds, as long as it is
of the points and of the unit in force. It prints nothing.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daq.errors import ConfigurationError

if TYPE_CHECKING:
    from analysis.report import Diagnosed
    from daq.store import Store
    from sim.unit import Unit

__all__ = ["kept_estimate", "report_measurement"]


def kept_estimate(store: Store, measurement: int, unit: Unit) -> Mapping[str, Any] | None:
    """The estimate that a history holds of a measurement, if it still holds.

    None where there is none or it failed, where points were taken since, and
    where the measurement was made with other numbers of the unit.
    """
    from sim.unit import unit_from_mapping

    known, found = store.latest_estimates().get(measurement), store.measurement(measurement)
    if known is None or "contribution_ratio" not in known.document:
        return None
    if found.ended is None or known.made <= found.ended:
        return None
    try:
        text = found.header.configurations.get("unit", "")
        same = unit_from_mapping(tomllib.loads(text), source="unit as measured") == unit
    except (ConfigurationError, tomllib.TOMLDecodeError):
        same = False
    return known.document if same else None


def report_measurement(
    path: Path,
    db: Path,
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
    from analysis.report import stored_origin, write_report
    from daq.store import Store

    with Store(db, read_only=True) as store:
        response, origin = store.response(measurement), stored_origin(store, measurement)
        estimate = estimate or kept_estimate(store, measurement, unit)
    return write_report(
        path, response, unit, origin, estimate=estimate, diagnosis=diagnosis, remarks=remarks
    )
