"""Reports on stored measurements, for the command line and the screens alike.

Owns with which unit a measurement was made, and which estimate is taken: the
one that the history holds, as long as it is of the points and of the unit in
force. It prints nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daq.errors import ConfigurationError

if TYPE_CHECKING:
    from analysis.report import Diagnosed
    from daq.store import Store
    from daq.store_records import Measurement
    from sim.unit import Unit

__all__ = [
    "estimates_in_force",
    "keep_estimate",
    "kept_estimate",
    "report_measurement",
    "unit_as_measured",
]


def unit_as_measured(measurement: Measurement) -> Unit:
    """The unit of a stored measurement as its file was then, whatever bears its name now.

    Where the history holds no file, it is the one of that name that comes with lashbench.

    Raises
    ------
    ConfigurationError
        If the history holds no unit file, or a damaged one.
    """
    from daq.bounded_text import parse_toml
    from daq.configs import config_names
    from sim.unit import load_unit, unit_from_mapping

    header, source = measurement.header, f"unit of measurement {measurement.id}"
    text = header.configurations.get("unit")
    if text is not None:
        try:
            return unit_from_mapping(parse_toml(text), source)
        except ValueError as error:
            raise ConfigurationError(f"{source}: is not valid TOML ({error})") from error
    if header.unit.lower() in config_names("units"):
        return load_unit(header.unit)
    raise ConfigurationError(f"{source}: {header.unit!r} has no file in the history")


def estimates_in_force(
    store: Store, measurements: Iterable[Measurement]
) -> dict[int, Mapping[str, Any]]:
    """Documents of the estimates that are of the points in force, by measurement.

    One that was made before its measurement ended may not be: points were taken
    since. What failed is among them, as ``{"failed": reason}``.
    """
    known = store.latest_estimates()
    return {
        one.id: known[one.id].document
        for one in measurements
        if one.id in known and one.ended is not None and known[one.id].made > one.ended
    }


def keep_estimate(db: Path, measured: Measurement, document: Mapping[str, Any]) -> None:
    """Keep what was estimated of a measurement, unless it was taken up again meanwhile.

    Parameters
    ----------
    measured
        The measurement as it was read before its points were.

    Raises
    ------
    LashbenchError
        As `daq.store.Store`.
    """
    from importlib.metadata import version

    from daq.store import Store

    with Store(db) as store:
        # An estimate takes a while; kept now, it would pass for one of points taken since.
        if store.measurement(measured.id).ended == measured.ended:
            store.add_estimate(measured.id, f"lashbench {version('lashbench')}", document)


def kept_estimate(store: Store, measurement: int, unit: Unit) -> Mapping[str, Any] | None:
    """The estimate that a history holds of a measurement, if it still holds.

    None where there is none or it failed, where points were taken since, and
    where the measurement was made with other numbers of the unit.
    """
    found = store.measurement(measurement)
    document = estimates_in_force(store, [found]).get(measurement)
    if document is None or "contribution_ratio" not in document:
        return None
    try:
        same = unit_as_measured(found) == unit
    except ConfigurationError:
        same = False
    return document if same else None


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
