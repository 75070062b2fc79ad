"""Measurements that were taken to tell what an earlier one left open.

Owns the mark by which one says which other it follows, beside the files it was
made with, and the way back along such marks. It measures and analyses nothing.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from daq.errors import FileFormatError, InputError

if TYPE_CHECKING:
    from daq.frf import FrequencyResponse
    from daq.store import Store
    from daq.store_records import MeasurementHeader

__all__ = ["following", "responses_together"]

_MARK = "follows"
_DIGITS = 18
"""What an identifier in a history can have."""


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
    seen = {measurement}
    while (before := header.configurations.get(_MARK, "")).isdecimal() and len(before) <= _DIGITS:
        if int(before) in seen:
            break
        seen.add(int(before))
        try:
            one = store.measurement(int(before))
        except FileFormatError:
            raise
        except InputError:
            # A copied or cut history may lack it: no reason to stop.
            break
        if one.points == 0:
            break
        # Or it holds another of that number.
        if (one.header.unit, one.header.serial) != (header.unit, header.serial):
            break
        responses.append(store.response(one.id))
        header = one.header
    return responses
