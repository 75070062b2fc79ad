"""Measurements that follow another: which ones a diagnosis takes together."""

from dataclasses import replace

import pytest
from instruments.measuring import measuring

from daq.analyser import SourceState
from daq.errors import InputError
from daq.store import Store
from tui.measurements.follow_up import following, responses_together


@pytest.fixture
def measured(run, db):
    """A measurement in a history; further ones of the same points follow whatever is said."""
    run(*measuring("--serial", "S"))
    with Store(db) as store:
        first = store.measurement(1)
        points = [one.point for one in store.points(1)]

        def add(follows, points=points, **changes):
            header = replace(first.header, **changes)
            number = store.begin(header if follows is None else following(header, follows))
            for point in points:
                store.add_point(number, header.plan.levels_vpk[0], point.frequency_hz, point)
            store.finish(number, "complete", SourceState.CONFIRMED_OFF)
            return number

        yield store, add


def together(store, measurement):
    return [one.provenance["measurement_id"] for one in responses_together(store, measurement)]


def test_measurement_includes_its_predecessors_latest_first(measured):
    store, add = measured
    second = add(1)
    third, alone = add(second), add(None)
    assert together(store, third) == [third, second, 1]
    assert together(store, second) == [second, 1]
    assert together(store, alone) == [alone]


def test_invalid_predecessor_is_omitted(measured):
    store, add = measured
    assert together(store, itself := add(2)) == [itself]
    other = add(None, serial="T")
    empty = add(None, points=[])
    for number in (other, empty, 99, "nonsense"):
        assert together(store, one := add(number)) == [one]
    with pytest.raises(InputError, match="99"):
        together(store, 99)


def test_circular_predecessors_are_included_once(measured):
    store, add = measured
    last = store.measurements()[-1].id
    one, other = add(last + 2), add(last + 1)
    assert together(store, one) == [one, other]
