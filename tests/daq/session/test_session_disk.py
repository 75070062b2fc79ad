"""A disk or a store that refuses: the source is made safe, and what was stored stays."""

import sqlite3
from contextlib import ExitStack

import pytest
from instruments.fake_analyser import FakeAnalyser
from instruments.session_runs import OFF, request
from worlds.full_disk import files_end_at, largest

from daq.errors import LinkError, MeasurementError
from daq.plan import SweepPlan, spaced_frequencies
from daq.session import Session
from daq.session_events import PointStored
from daq.store import Store


def test_full_disk_stops_source_and_keeps_points(tmp_path):
    path = tmp_path / "bench.db"
    analyser = FakeAnalyser()
    store = Store(path, create=True)
    events = []

    full = ExitStack()

    def fill_the_disk():
        full.enter_context(files_end_at(largest(tmp_path)))

    plan = SweepPlan(spaced_frequencies(100.0, 180.0, 900), (0.5,))
    analyser.faults[("point", 20)] = fill_the_disk

    def run():
        for event in Session(analyser, store, request(plan)).run():
            events.append(event)

    with full, pytest.raises(MeasurementError, match="disk refused the data"):
        run()
    assert analyser.level_vpk == 0.0
    assert analyser.log[-1] == ("make_safe",)
    finished = events[-1]
    assert (finished.state, finished.source_state) == ("interrupted", OFF)
    kept = [e.stored for e in events if isinstance(e, PointStored)]
    assert 18 <= len(kept) < 900
    store.close()
    with Store(path) as again:
        assert again.points(1) == kept
        assert again.measurement(1).state == "interrupted"


def test_failing_store_does_not_hide_first_error(store, monkeypatch):
    def refuse(*_args):
        raise MeasurementError("disk gone")

    monkeypatch.setattr(store, "finish", refuse)
    analyser = FakeAnalyser({("point", 6): LinkError("cable pulled")})
    events = []

    def run():
        events.extend(Session(analyser, store, request()).run())

    with pytest.raises(LinkError, match="cable pulled"):
        run()
    assert analyser.log[-1] == ("make_safe",)


def test_store_failure_at_the_end_is_reported(store, monkeypatch):
    def refuse(*_args):
        raise MeasurementError("disk gone")

    monkeypatch.setattr(store, "finish", refuse)
    analyser = FakeAnalyser()
    with pytest.raises(MeasurementError, match="disk gone"):
        list(Session(analyser, store, request()).run())
    assert analyser.log[-1] == ("make_safe",)
    assert store.measurement(1).state == "interrupted"


def test_file_held_by_another_program_is_reported(store):
    blocker = sqlite3.connect(store.path, isolation_level=None)
    analyser = FakeAnalyser({("point", 6): lambda: blocker.execute("BEGIN IMMEDIATE")})
    with Store(store.path) as quick, pytest.raises(MeasurementError, match="held by another"):
        list(Session(analyser, quick, request()).run())
    assert analyser.level_vpk == 0.0
    assert analyser.log[-1] == ("make_safe",)
    blocker.execute("ROLLBACK")
    blocker.close()
    assert len(store.points(1)) == 4
