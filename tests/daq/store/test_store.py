import math
import os
import signal
import sqlite3
import subprocess
import sys
import threading
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from worlds.full_disk import files_end_at, largest

from daq.analyser import Identity, SourceState, SweepPoint
from daq.errors import InputError, MeasurementError
from daq.frf import PointFlag
from daq.plan import SweepPlan
from daq.store import Store
from daq.store_records import MeasurementHeader, plan_from_text, plan_text

PLAN = SweepPlan((100.1, 110.5, 125.0), (1.5, 2.5), direction="down", settle_cycles=5)
IDENTITY = Identity("HEWLETT-PACKARD", "35670A", "MY1", "A.01.11", ("1D2", "AY6"), simulated=True)


def header(**changes) -> MeasurementHeader:
    known = {
        "unit": "ADSS",
        "serial": "SN-7",
        "plan": PLAN,
        "address": "sim:",
        "software": "lashbench 0.1.0",
        "operator": "O",
        "notes": "n\nn",
        "configurations": {"unit": 'name = "ADSS"\n'},
    }
    return MeasurementHeader(**(known | changes))


def point(frequency_hz: float, gain: complex = 0.1 - 0.2j, **changes) -> SweepPoint:
    return SweepPoint(frequency_hz, gain, **changes)


def test_values_are_read_back_exactly(store):
    measurement = store.begin(header())
    store.set_instrument(measurement, IDENTITY)
    store.set_readback(measurement, {"SWE:STIM": "5 CYCLE"})
    full = SweepPoint(
        100.09375,
        complex(1 / 3, -1e-17),
        0.1 + 0.2,
        1e-300,
        PointFlag.OVERLOAD | PointFlag.RETAKEN,
        (1e-9, 2 / 7),
        {"range_1_vpk": 0.1},
    )
    stored = store.add_point(measurement, 1.5, 100.1, full)
    bare = store.add_point(measurement, 1.5, 110.5, point(110.5))
    assert store.points(measurement) == [stored, bare]
    assert stored.point == full
    found = store.measurement(measurement)
    assert found.header == header()
    assert found.instrument == IDENTITY
    assert found.readback == {"SWE:STIM": "5 CYCLE"}
    assert (found.points, found.flagged) == (2, 1)


def test_not_a_number_stays_unknown(store):
    measurement = store.begin(header())
    spoilt = point(100.1, complex(math.nan, math.inf), gain_std_db=math.nan, flags=PointFlag.SPOILT)
    store.add_point(measurement, 1.5, 100.1, spoilt)
    read = store.points(measurement)[0].point
    assert math.isnan(read.gain.real)
    assert math.isnan(read.gain.imag)
    assert read.gain_std_db is None
    response = store.response(measurement)
    assert not response.phase_known[0]
    assert response.flags[0] == PointFlag.SPOILT


def test_unfinished_measurement_is_interrupted(store):
    measurement = store.begin(header())
    found = store.measurement(measurement)
    assert (found.state, found.source_state, found.ended) == (
        "interrupted",
        SourceState.UNKNOWN,
        None,
    )
    store.finish(measurement, "complete", SourceState.CONFIRMED_OFF)
    found = store.measurement(measurement)
    assert (found.state, found.source_state) == ("complete", SourceState.CONFIRMED_OFF)
    assert found.ended is not None


def test_a_state_outside_the_three_is_refused(store):
    measurement = store.begin(header())
    with pytest.raises(Exception, match="state"):
        store.finish(measurement, "done", SourceState.CONFIRMED_OFF)
    assert store.measurement(measurement).state == "interrupted"


def test_remeasured_point_supersedes_and_keeps_old_one(store):
    measurement = store.begin(header())
    first = store.add_point(measurement, 1.5, 100.1, point(100.1, 1j))
    other = store.add_point(measurement, 2.5, 100.1, point(100.1, 3j))
    second = store.add_point(measurement, 1.5, 100.1, point(100.1, 2j))
    third = store.add_point(measurement, 1.5, 100.1, point(100.1, 4j))
    assert [p.id for p in store.points(measurement)] == [other.id, third.id]
    history = {p.id: p.superseded_by for p in store.points(measurement, superseded=True)}
    assert history == {first.id: second.id, other.id: None, second.id: third.id, third.id: None}
    assert store.measurement(measurement).points == 2


def test_response_of_a_measurement(store):
    measurement = store.begin(header(notes="two levels"))
    store.set_instrument(measurement, IDENTITY)
    for level in PLAN.levels_vpk:
        for frequency in PLAN.visited_hz:
            gain = complex(level, -frequency)
            store.add_point(measurement, level, frequency, point(frequency, gain, gain_std_db=0.5))
    response = store.response(measurement)
    np.testing.assert_array_equal(response.frequency_hz, [100.1, 110.5, 125.0] * 2)
    np.testing.assert_array_equal(response.source_vpk, [1.5] * 3 + [2.5] * 3)
    np.testing.assert_array_equal(response.gain, response.source_vpk - 1j * response.frequency_hz)
    assert (response.unit, response.direction, response.settle_cycles) == ("ADSS", "down", 5)
    assert response.provenance["kind"] == "simulated"
    assert response.provenance["notes"] == "two levels"
    assert len(response.provenance["points"]["taken"]) == 6


def test_response_without_points_is_refused(store):
    measurement = store.begin(header())
    with pytest.raises(InputError, match="no point yet"):
        store.response(measurement)


@pytest.mark.parametrize("verb", ["measurement", "response"])
def test_an_unknown_measurement_is_named(store, verb):
    with pytest.raises(InputError, match="measurement 12 is not in"):
        getattr(store, verb)(12)


def test_a_point_of_no_measurement_is_refused(store):
    with pytest.raises(Exception, match=r"(?i)foreign key"):
        store.add_point(99, 1.5, 100.0, point(100.0))


def test_measurements_are_listed_by_unit_oldest_first(store):
    ids = [store.begin(header(unit=unit)) for unit in ("ADSS", "EDSS", "ADSS")]
    assert [m.id for m in store.measurements()] == ids
    assert [m.id for m in store.measurements("adss")] == [ids[0], ids[2]]
    assert store.measurements("other") == []


@pytest.mark.parametrize("asked", ["GÄR", "gär", "GäR"])
def test_unit_is_found_in_any_letter_case(store, asked):
    ids = [store.begin(header(unit=unit)) for unit in ("GÄR", "GAR", "gär")]
    assert [m.id for m in store.measurements(asked)] == [ids[0], ids[2]]


def test_link_shows_contents_of_the_log(file_store, tmp_path):
    (tmp_path / "elsewhere").mkdir()
    link = tmp_path / "elsewhere" / "link.db"
    link.symlink_to(file_store.path)
    measurement = file_store.begin(header())
    with Store(link, read_only=True) as reader:
        assert [m.id for m in reader.measurements()] == [measurement]


def test_every_commit_through_link_is_flushed(file_store, tmp_path, monkeypatch):
    link = tmp_path / "link.db"
    link.symlink_to(file_store.path)
    flushed = []
    monkeypatch.setattr(os, "fsync", lambda handle: flushed.append(os.fstat(handle).st_ino))
    with Store(link) as linked:
        linked.finish(linked.begin(header()), "complete", SourceState.CONFIRMED_OFF)
    assert os.stat(f"{file_store.path}-wal").st_ino in flushed


def test_journal_keeps_order_and_data(store):
    measurement = store.begin(header())
    first = store.note(measurement, "check", "identity", {"model": "35670A"})
    second = store.note(measurement, "stop", "operator asked")
    assert store.events(measurement) == [first, second]


def test_the_last_estimate_is_the_one_shown(store):
    one, two = store.begin(header()), store.begin(header())
    store.add_estimate(one, "lashbench 1", {"contribution_ratio": {"value": 0.3}})
    last = store.add_estimate(one, "lashbench 2", {"contribution_ratio": {"value": 0.4}})
    assert store.latest_estimates() == {one: last}
    assert two not in store.latest_estimates()


def test_identifiers_are_never_used_twice(tmp_path):
    path = tmp_path / "bench.db"
    with Store(path, create=True) as store:
        first = store.begin(header())
    with sqlite3.connect(path) as raw:
        raw.execute("DELETE FROM measurements")
    raw.close()
    with Store(path) as store:
        assert store.begin(header()) > first


def test_a_plan_survives_as_text():
    assert plan_from_text(plan_text(PLAN)) == PLAN


def test_history_uses_write_ahead_log(file_store):
    """Commits survive a killed program, and a power cut leaves a whole file."""
    with closing(sqlite3.connect(file_store.path)) as raw:
        assert raw.execute("PRAGMA journal_mode").fetchone() == ("wal",)


def test_every_commit_is_flushed_without_waiting(file_store, monkeypatch):
    measurement = file_store.begin(header())
    flushed, go = [], threading.Event()

    def slow(handle):
        flushed.append(os.fstat(handle).st_ino)
        go.wait(5.0)

    monkeypatch.setattr(os, "fsync", slow)
    log = os.stat(f"{file_store.path}-wal").st_ino
    began = time.monotonic()
    file_store.add_point(measurement, 1.5, 100.1, point(100.1))
    assert time.monotonic() - began < 1.0
    deadline = time.monotonic() + 5.0
    while not flushed and time.monotonic() < deadline:
        time.sleep(0.001)
    assert flushed == [log]
    # What comes while the disk is busy is asked for once more afterwards.
    file_store.add_point(measurement, 1.5, 110.5, point(110.5))
    go.set()
    file_store.close()
    assert flushed == [log, log]


def test_end_of_measurement_waits_for_flush(file_store, monkeypatch):
    measurement = file_store.begin(header())
    done = []
    monkeypatch.setattr(os, "fsync", lambda handle: (time.sleep(0.05), done.append(1)))
    file_store.finish(measurement, "complete", SourceState.CONFIRMED_OFF)
    assert done


def test_refused_flush_is_reported_at_next_record(file_store, monkeypatch):
    measurement = file_store.begin(header())

    def refuse(_handle):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(MeasurementError, match="Input/output error"):
        file_store.finish(measurement, "complete", SourceState.CONFIRMED_OFF)
    with pytest.raises(MeasurementError, match="the disk refused the data"):
        file_store.add_point(measurement, 1.5, 100.1, point(100.1))


def test_failed_write_leaves_no_partial_record(store):
    measurement = store.begin(header())
    old = store.add_point(measurement, 1.5, 100.1, point(100.1))
    bad = point(100.1, detail={"x": object()})
    with pytest.raises(TypeError):
        store.add_point(measurement, 1.5, 100.1, bad)
    assert store.points(measurement, superseded=True) == [old]


def test_full_disk_loses_no_committed_point(tmp_path):
    path = tmp_path / "bench.db"
    with Store(path, create=True) as store:
        measurement = store.begin(header())
        told = []

        def fill():
            for step in range(10_000):
                told.append(store.add_point(measurement, 1.5, 100.0 + step, point(100.0)))

        with (
            files_end_at(largest(tmp_path) + 400_000),
            pytest.raises(MeasurementError, match=r"disk refused the data.*make room"),
        ):
            fill()
        assert len(told) > 10
    with Store(path) as store:
        assert store.points(measurement) == told


def test_locked_file_is_reported_within_bound(tmp_path):
    path = tmp_path / "bench.db"
    with Store(path, create=True) as store:
        measurement = store.begin(header())
        with closing(sqlite3.connect(path, isolation_level=None)) as other:
            other.execute("BEGIN IMMEDIATE")
            began = time.monotonic()
            with pytest.raises(MeasurementError, match="held by another program for more than 5 s"):
                store.note(measurement, "x", "y")
            assert 4.9 < time.monotonic() - began < 30.0
        store.note(measurement, "x", "y")


def test_readers_watch_while_a_thread_writes(tmp_path):
    path = tmp_path / "bench.db"
    with Store(path, create=True) as store:
        measurement = store.begin(header())
        done = threading.Event()
        faults = []

        def write():
            try:
                for step in range(100):
                    store.add_point(measurement, 1.5, 100.0 + step, point(100.0))
            except Exception as error:  # noqa: BLE001
                faults.append(error)
            finally:
                done.set()

        writer = threading.Thread(target=write)
        writer.start()
        seen = [0]
        with Store(path, read_only=True) as reader:
            while not done.is_set():
                seen.append(len(reader.points(measurement)))
        writer.join()
        assert not faults
        assert seen == sorted(seen)
        assert len(store.points(measurement)) == 100


WRITER = """
import sys
from daq.analyser import SweepPoint
from daq.plan import SweepPlan
from daq.store import Store
from daq.store_records import MeasurementHeader
store = Store(sys.argv[1])
measurement = store.begin(MeasurementHeader("U", "", SweepPlan((1.0,), (1.0,)), "sim:", "t"))
for step in range(100_000):
    stored = store.add_point(measurement, 1.0, 1.0 + step, SweepPoint(1.0 + step, 1j * step))
    print(stored.id, step, flush=True)
"""


@pytest.mark.parametrize("lines", [1, 7, 60])
def test_kill_9_loses_no_reported_point(tmp_path, lines):
    path = tmp_path / "bench.db"
    Store(path, create=True).close()
    with subprocess.Popen(
        [sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, text=True
    ) as process:
        told = [process.stdout.readline().split() for _ in range(lines)]
        os.kill(process.pid, signal.SIGKILL)
        told += [line.split() for line in process.stdout if line.endswith("\n")]
    with Store(path) as store:
        kept = {p.id: p for p in store.points(1)}
        for identifier, step in told:
            assert kept[int(identifier)].point.gain == 1j * int(step)
        assert len(kept) - len(told) in (0, 1)


def test_place_of_new_history_is_checked(tmp_path):
    with pytest.raises(InputError, match="no directory"):
        Store(tmp_path / "nowhere" / "bench.db", create=True)
    with pytest.raises(InputError, match="there is no history"):
        Store(tmp_path / "bench.db")
    assert list(Path(tmp_path).iterdir()) == []
