"""Measurements that were taken to tell what an earlier one left open.

Owns the mark by which one says which other it follows, beside the files it was
made with, and the way back along such marks. It measures and analyses nothing.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from daq.frf import FrequencyResponse
    from daq.store import Store
    from daq.store_records import MeasurementHeader

__all__ = ["following", "responses_together"]

_MARK = "follows"


def following(header: MeasurementHeader, measurement: int) -> MeasurementHeader:
    """A header that says which measurement its own one follows."""
    return replace(header, configurations={**header.configurations, _MARK: str(measurement)})


def responses_together(store: Store, measurement: int) -> list[FrequencyResponse]:
    """The response of a measurement, and of those of the same unit that it follows, latest first.

    Raises
    ------
    InputError
        If there is no such measurement, or it has no point.
    StorageError
        If the history cannot be read.
    """
    header = store.measurement(measurement).header
    responses = [store.response(measurement)]
    known = {one.id: one for one in store.measurements() if one.id != measurement}
    while (before := header.configurations.get(_MARK, "")).isdecimal():
        # A copied or cut history may lack it, or hold another of that number: no reason to stop.
        one = known.pop(int(before), None)
        if one is None or one.points == 0:
            break
        if (one.header.unit, one.header.serial) != (header.unit, header.serial):
            break
        responses.append(store.response(one.id))
        header = one.header
    return responses
