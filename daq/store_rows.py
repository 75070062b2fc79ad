"""Between the rows of the history's tables and the records of the program.

Owns the translation, both ways, and nothing else: no SQL is run here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import sqlalchemy as sa

from daq.analyser import Identity, SourceState, SweepPoint
from daq.frf import (
    GAIN_STD_COMPONENTS,
    GAIN_STD_IS,
    FrequencyResponse,
    PointFlag,
    error_words,
)
from daq.store_records import Measurement, MeasurementHeader, StoredPoint, plan_from_text

__all__ = ["measurement_of", "point_of", "point_row", "response_of"]


def point_row(point: SweepPoint) -> dict[str, Any]:
    """Columns of a point; what is not a number becomes NULL."""
    variance_1, variance_2 = point.variances or (None, None)
    return {
        "frequency_hz": point.frequency_hz,
        "gain_re": _finite(point.gain.real),
        "gain_im": _finite(point.gain.imag),
        "gain_std_db": _finite(point.gain_std_db),
        "phase_std_deg": _finite(point.phase_std_deg),
        "variance_1": _finite(variance_1),
        "variance_2": _finite(variance_2),
        "flags": int(point.flags),
        "detail": {name: float(value) for name, value in point.detail.items()},
    }


def point_of(row: sa.Row[Any]) -> StoredPoint:
    """The point in a row of `points`."""
    known = row.variance_1 is not None and row.variance_2 is not None
    return StoredPoint(
        id=row.id,
        source_vpk=row.source_vpk,
        requested_hz=row.requested_hz,
        point=SweepPoint(
            frequency_hz=row.frequency_hz,
            gain=complex(_number(row.gain_re), _number(row.gain_im)),
            gain_std_db=row.gain_std_db,
            phase_std_deg=row.phase_std_deg,
            flags=PointFlag(row.flags),
            variances=(row.variance_1, row.variance_2) if known else None,
            detail=row.detail,
        ),
        taken=row.taken,
        superseded_by=row.superseded_by,
    )


def measurement_of(row: sa.Row[Any]) -> Measurement:
    """The measurement in a row of the joined tables.

    Raises
    ------
    ValueError
        If the row holds words that this program does not know.
    """
    instrument = None
    if row.instrument_id is not None:
        instrument = Identity(
            maker=row.maker,
            model=row.model,
            serial=row.instrument_serial,
            revision=row.revision,
            options=tuple(row.options),
            simulated=bool(row.simulated),
        )
    return Measurement(
        id=row.id,
        header=MeasurementHeader(
            unit=row.unit,
            serial=row.unit_serial,
            plan=plan_from_text(row.plan),
            address=row.address,
            software=row.software,
            operator=row.operator,
            notes=row.notes,
            configurations=row.configurations,
        ),
        instrument=instrument,
        state=row.state,
        source_state=SourceState(row.source_state),
        started=row.started,
        ended=row.ended,
        readback=row.readback,
        points=row.points or 0,
        flagged=row.flagged or 0,
    )


def response_of(measurement: Measurement, points: Sequence[StoredPoint]) -> FrequencyResponse:
    """The frequency response that stored points make, levels as swept, frequency ascending.

    What a response has no column for (frequency asked for, time and normalised
    variance of each point) stands in its provenance as a table of its own.
    """
    plan = measurement.header.plan
    order = {level: place for place, level in enumerate(plan.levels_vpk)}
    rows = sorted(points, key=lambda p: (order.get(p.source_vpk, len(order)), p.requested_hz))
    gain = np.array([row.point.gain for row in rows], dtype=complex)
    return FrequencyResponse.from_arrays(
        [row.point.frequency_hz for row in rows],
        [row.source_vpk for row in rows],
        gain,
        unit=measurement.header.unit,
        phase_known=np.isfinite(gain),
        gain_std_db=[_number(row.point.gain_std_db) for row in rows],
        phase_std_deg=[_number(row.point.phase_std_deg) for row in rows],
        dc_v=[row.point.detail.get("dc_v", math.nan) for row in rows],
        flags=[int(row.point.flags) for row in rows],
        direction=plan.direction,
        settle_cycles=plan.settle_cycles,
        integrate_cycles=plan.integrate_cycles,
        from_rest=plan.from_rest,
        provenance=_provenance(measurement, rows),
    )


def _provenance(measurement: Measurement, rows: Sequence[StoredPoint]) -> dict[str, Any]:
    header, instrument = measurement.header, measurement.instrument
    simulated = instrument is not None and instrument.simulated
    provenance: dict[str, Any] = {
        GAIN_STD_COMPONENTS: 1,
        GAIN_STD_IS: error_words(header.plan.integrate_cycles),
        "kind": "simulated" if simulated else "measured",
        "measurement_id": measurement.id,
        "state": measurement.state,
        "started": measurement.started,
        "software": header.software,
        "serial": header.serial,
        "operator": header.operator,
        "notes": header.notes,
        "address": header.address,
        "dc_offset_v": header.plan.dc_offset_v,
        "configurations": dict(header.configurations),
        "readback": dict(measurement.readback),
    }
    if instrument is not None:
        provenance["instrument"] = {
            "maker": instrument.maker,
            "model": instrument.model,
            "serial": instrument.serial,
            "revision": instrument.revision,
            "options": list(instrument.options),
        }
    nothing = (math.nan, math.nan)
    provenance["points"] = {
        "source_vpk": [row.source_vpk for row in rows],
        "requested_hz": [row.requested_hz for row in rows],
        "taken": [row.taken for row in rows],
        "variance_1": [(row.point.variances or nothing)[0] for row in rows],
        "variance_2": [(row.point.variances or nothing)[1] for row in rows],
    }
    return provenance


def _finite(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


def _number(value: float | None) -> float:
    return math.nan if value is None else value
