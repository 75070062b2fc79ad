"""The lines of a history that have an answer: chosen by the file, not one by one."""

from daq.analyser import SourceState
from daq.plan import SweepPlan
from daq.store import Store
from daq.store_records import MeasurementHeader


def test_only_estimated_or_diagnosed_lines_are_read(tmp_path):
    plan = SweepPlan((100.0, 110.0), (2.5,))
    with Store(tmp_path / "lab.db", create=True) as store:
        for serial in ("A", "A", "B", "A"):
            number = store.begin(MeasurementHeader("ADSS", serial, plan, "sim:", "test"))
            store.finish(number, "complete", SourceState.CONFIRMED_OFF)
        store.add_estimate(2, "test", {"failed": "no reading"})
        store.add_estimate(3, "test", {"failed": "no reading"})
        store.add_diagnosis(4, "test", {"verdict": "consistent"}, {4: 0})
        every = [line.id for line in store.each_line("ADSS", "A", exact=True)]
        answered = [line.id for line in store.each_line("ADSS", "A", exact=True, answered=True)]
    assert (every, answered) == ([1, 2, 4], [2, 4])
