"""Between the rows of the history's tables and the records of the program.

Owns the translation, both ways, and nothing else: no SQL is run here. A file may hold
anything in any column: what is not of the kind that was written there is a ValueError.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import datetime
from typing import Any, get_args

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
from daq.store_records import (
    LONGEST_NAME,
    LONGEST_TEXT,
    Correction,
    Measurement,
    MeasurementHeader,
    MeasurementState,
    SessionEvent,
    StoredPoint,
    plan_from_text,
)

__all__ = [
    "correction_of",
    "document_of",
    "event_of",
    "measurement_of",
    "moment",
    "point_of",
    "point_row",
    "real",
    "response_of",
    "state_of",
    "text",
    "texts_of",
    "whole",
]

_WHOLE = 1 << 53
"""Whole numbers up to here are the same as real ones."""


def text(value: object, longest: int = LONGEST_TEXT) -> str:
    """A text of a bounded length; ValueError if it is none."""
    if not isinstance(value, str):
        raise ValueError(f"{_shown(value)} stands where a text belongs")
    if len(value) > longest:
        raise ValueError(f"a text of {len(value)} characters stands where {longest} may")
    return value


def moment(value: object) -> str:
    """A moment as ISO 8601 with its offset from UTC; ValueError if it is none."""
    if datetime.fromisoformat(text(value)).tzinfo is None:
        raise ValueError(f"{_shown(value)} is a moment without a time zone")
    return text(value)


def real(value: object) -> float:
    """A finite number; ValueError if it is none."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{_shown(value)} stands where a number belongs")
    return float(value)


def whole(value: object) -> int:
    """A whole number from 0; ValueError if it is none."""
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= _WHOLE:
        raise ValueError(f"{_shown(value)} stands where a whole number belongs")
    return value


def document_of(value: object) -> dict[str, Any]:
    """An object of JSON; ValueError if it is none."""
    if not isinstance(value, dict):
        raise ValueError(f"{_shown(value)} stands where an object of JSON belongs")
    return value


def texts_of(value: object) -> dict[str, str]:
    """Texts by name; ValueError if it is anything else."""
    # Files as they were used: each is read within its own bounds.
    return {text(name): text(item, _WHOLE) for name, item in document_of(value).items()}


def _optional(value: object) -> float | None:
    return None if value is None else real(value)


def _shown(value: object) -> str:
    return repr(value if not isinstance(value, str | bytes) else value[:40])[:60]


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
    """The point in a row of `points`.

    Raises
    ------
    ValueError
        If the row holds what no point has.
    """
    variance_1, variance_2 = _optional(row.variance_1), _optional(row.variance_2)
    known = variance_1 is not None and variance_2 is not None
    return StoredPoint(
        id=whole(row.id),
        source_vpk=real(row.source_vpk),
        requested_hz=real(row.requested_hz),
        point=SweepPoint(
            frequency_hz=real(row.frequency_hz),
            gain=complex(_number(_optional(row.gain_re)), _number(_optional(row.gain_im))),
            gain_std_db=_optional(row.gain_std_db),
            phase_std_deg=_optional(row.phase_std_deg),
            flags=PointFlag(whole(row.flags)),
            variances=(variance_1, variance_2) if known else None,  # type: ignore[arg-type]
            detail={text(k): _detail(v) for k, v in document_of(row.detail).items()},
        ),
        taken=moment(row.taken),
        superseded_by=None if row.superseded_by is None else whole(row.superseded_by),
    )


def _detail(value: object) -> float:
    # What is not a number of what the instrument said beside the reading is kept as NaN.
    return math.nan if isinstance(value, float) and math.isnan(value) else real(value)


def event_of(row: sa.Row[Any]) -> SessionEvent:
    """The line of the journal in a row of `events`; ValueError as for `point_of`."""
    return SessionEvent(moment(row.time), text(row.kind), text(row.text), document_of(row.data))


def correction_of(row: sa.Row[Any]) -> Correction:
    """The line of the audit trail in a row of `corrections`; ValueError as for `point_of`."""
    return Correction(
        moment(row.time), text(row.person), text(row.field), text(row.old), text(row.new)
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
            maker=text(row.maker),
            model=text(row.model),
            serial=text(row.instrument_serial),
            revision=text(row.revision),
            options=tuple(text(option) for option in _listed(row.options)),
            simulated=bool(row.simulated),
        )
    return Measurement(
        id=whole(row.id),
        header=MeasurementHeader(
            unit=text(row.unit, LONGEST_NAME),
            serial=text(row.unit_serial, LONGEST_NAME),
            plan=plan_from_text(text(row.plan, _WHOLE)),
            address=text(row.address),
            software=text(row.software),
            operator=text(row.operator, LONGEST_NAME),
            notes=text(row.notes),
            configurations=texts_of(row.configurations),
        ),
        instrument=instrument,
        state=state_of(row.state),
        source_state=SourceState(row.source_state),
        started=moment(row.started),
        ended=None if row.ended is None else moment(row.ended),
        readback=texts_of(row.readback),
        points=whole(row.points),
        flagged=whole(row.flagged),
        points_version=whole(row.points_version),
    )


def state_of(value: object) -> MeasurementState:
    """How a measurement stands; ValueError if it is none of the three."""
    if value not in get_args(MeasurementState):
        raise ValueError(f"{_shown(value)} is no state of a measurement")
    return value  # type: ignore[return-value]


def _listed(value: object) -> list[Any]:
    if not isinstance(value, list):
        raise ValueError(f"{_shown(value)} stands where a list belongs")
    return value


def response_of(
    measurement: Measurement,
    points: Sequence[StoredPoint],
    corrections: Sequence[Correction] = (),
) -> FrequencyResponse:
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
        provenance=_provenance(measurement, rows, corrections),
    )


def _provenance(
    measurement: Measurement, rows: Sequence[StoredPoint], corrections: Sequence[Correction]
) -> dict[str, Any]:
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
        "points_version": measurement.points_version,
    }
    if corrections:
        provenance["corrections"] = {
            "time": [one.time for one in corrections],
            "person": [one.person for one in corrections],
            "field": [one.field for one in corrections],
            "old": [one.old for one in corrections],
            "new": [one.new for one in corrections],
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
