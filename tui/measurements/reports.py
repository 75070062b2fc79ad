"""Reports on stored measurements, for the command line and the screens alike.

Owns with which unit a measurement was made. Which stored estimate and diagnosis
are taken is `tui.measurements.stored_answers`'s part. It prints nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daq.errors import ConfigurationError

if TYPE_CHECKING:
    from analysis.report import Diagnosed
    from daq.store_records import Measurement
    from sim.unit import Unit

__all__ = ["report_measurement", "unit_as_measured"]


def unit_as_measured(measurement: Measurement) -> Unit:
    """The unit of a stored measurement as its file was then, whatever bears its name now.

    Where the history holds no file, it is the one of that name that comes with lashbench.

    Raises
    ------
    ConfigurationError
        If the history holds no unit file, or a damaged one.
    """
    from daq.configs import config_names
    from daq.untrusted.bounded_text import parse_toml
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
