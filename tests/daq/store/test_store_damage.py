"""A history that is old, new, foreign, damaged or out of reach."""

import os
import sqlite3
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from daq.analyser import SourceState
from daq.errors import FileFormatError, InputError, LashbenchError
from daq.frf import PointFlag
from daq.store import Store
from daq.store.schema import APPLICATION_ID, SCHEMA_VERSION

V1 = (Path(__file__).parents[2] / "data" / "history-v1.sql").read_text()


def run_sql(path: Path, script: str) -> None:
    raw = sqlite3.connect(path)
    raw.executescript(script)
    raw.close()


def layout(path: Path) -> dict[str, str]:
    raw = sqlite3.connect(path)
    rows = raw.execute("SELECT name, sql FROM sqlite_master WHERE sql IS NOT NULL").fetchall()
    version = raw.execute("PRAGMA user_version").fetchone()[0]
    raw.close()
    return dict(rows) | {"version": version}


@pytest.fixture
def old(tmp_path):
    path = tmp_path / "old.db"
    run_sql(path, V1)
    return path


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("history") / "whole.db"
    run_sql(path, V1)
    Store(path).close()
    return path.read_bytes()


def read_all(path: Path) -> None:
    with Store(path, read_only=True) as store:
        for measurement in store.measurements():
            store.points(measurement.id, superseded=True)
            store.events(measurement.id)
            if measurement.points:
                store.response(measurement.id)
        store.latest_estimates()


def complaint(path: Path) -> str | None:
    try:
        read_all(path)
    except LashbenchError as error:
        return str(error)
    return None


def test_older_file_is_migrated_completely(old, tmp_path):
    fresh = tmp_path / "fresh.db"
    Store(fresh, create=True).close()
    with Store(old) as store:
        first, second = store.measurements()
        assert first.header.serial == "SN-7"
        assert first.header.configurations == {"unit": "name = 'ADSS'\n"}
        assert first.state == "complete"
        assert first.source_state is SourceState.CONFIRMED_OFF
        assert first.points == 6
        assert second.state == "interrupted"
        assert second.ended is None
        points = store.points(1, superseded=True)
        assert len(points) == 7
        assert points[1].superseded_by == points[6].id
        assert points[6].point.flags == PointFlag.OVERLOAD | PointFlag.RETAKEN
        assert [event.kind for event in store.events(1)] == ["stop"]
        store.add_estimate(1, "t", {})
    assert layout(old) == layout(fresh)


def test_read_only_older_file_is_read_unmigrated(old):
    before = old.read_bytes()
    with Store(old, read_only=True) as store:
        first, second = store.lines()
        assert (first.points, first.planned, first.flagged) == (6, 6, 1)
        assert first.levels_vpk == store.measurement(1).header.plan.levels_vpk
        assert (second.state, second.estimate, second.diagnosis) == ("interrupted", None, None)
        assert store.measurement(1).points == 6
        assert len(store.response(1)) == 6
        assert store.latest_estimates() == {}
    assert old.read_bytes() == before


def test_failed_migration_changes_nothing(old):
    # The last step of the upgrade makes a table of this name.
    run_sql(old, "CREATE TABLE corrections (id INTEGER)")
    before = layout(old)
    with pytest.raises(LashbenchError):
        Store(old)
    assert layout(old) == before


def test_newer_file_is_refused_and_unchanged(tmp_path):
    path = tmp_path / "new.db"
    Store(path, create=True).close()
    run_sql(path, f"PRAGMA user_version = {SCHEMA_VERSION + 5}")
    before = path.read_bytes()
    for read_only in (False, True):
        with pytest.raises(FileFormatError, match=rf"newer lashbench.*{SCHEMA_VERSION + 5}"):
            Store(path, read_only=read_only)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    "script",
    [
        "CREATE TABLE mine (id INTEGER)",
        "PRAGMA user_version = 3",
        "PRAGMA application_id = 77",
        f"PRAGMA application_id = {APPLICATION_ID}",
    ],
)
def test_file_of_another_program_is_unchanged(tmp_path, script):
    path = tmp_path / "other.db"
    run_sql(path, script)
    before = path.read_bytes()
    with pytest.raises(FileFormatError):
        Store(path, create=True)
    assert path.read_bytes() == before


def test_empty_file_becomes_history_only_on_creation(tmp_path):
    path = tmp_path / "empty.db"
    path.touch()
    with pytest.raises(InputError, match="no history"):
        Store(path)
    with Store(path, create=True) as store:
        assert store.measurements() == []


def test_directory_and_device_are_no_history(tmp_path):
    with pytest.raises(InputError, match="is a directory"):
        Store(tmp_path, create=True)
    with pytest.raises(InputError, match="not a regular file"):
        Store("/dev/null", create=True)


def test_read_only_history_can_be_read(whole, tmp_path):
    place = tmp_path / "locked"
    place.mkdir()
    path = place / "bench.db"
    path.write_bytes(whole)
    path.chmod(0o444)
    place.chmod(0o555)
    try:
        read_all(path)
        assert [p.name for p in place.iterdir()] == ["bench.db"]
        if os.geteuid() != 0:
            with pytest.raises(InputError, match="may not be used"):
                Store(path)
    finally:
        place.chmod(0o755)


def test_contents_only_in_log_are_read(whole, tmp_path):
    path = tmp_path / "bench.db"
    path.write_bytes(whole)
    with Store(path) as writer:
        writer.note(1, "late", "only in the log")
        with Store(path, read_only=True) as reader:
            assert reader.events(1)[-1].text == "only in the log"


def test_writer_may_close_while_another_opens(whole, tmp_path, monkeypatch):
    path = tmp_path / "bench.db"
    path.write_bytes(whole)
    writer = Store(path)
    writer.note(1, "late", "the log goes with its writer")
    gone, look = [], os.stat

    def look_and_leave(place, **how):
        found = look(place, **how)
        if str(place).endswith("-wal"):
            writer.close()
            gone.append(not os.path.lexists(place))
        return found

    monkeypatch.setattr(os, "stat", look_and_leave)
    with Store(path, read_only=True) as reader:
        assert reader.events(1)[-1].text == "the log goes with its writer"
    assert gone[:1] == [True]


@settings(
    max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_damaged_file_is_refused_or_read_whole(whole, tmp_path, data):
    damage = data.draw(st.sampled_from(["cut", "flip", "zero", "garbage"]))
    content = bytearray(whole)
    if damage == "cut":
        content = content[: data.draw(st.integers(0, len(content) - 1))]
    elif damage == "flip":
        for place in data.draw(st.lists(st.integers(0, len(content) - 1), min_size=1, max_size=9)):
            content[place] ^= data.draw(st.integers(1, 255))
    elif damage == "zero":
        start = data.draw(st.integers(0, len(content) - 1))
        content[start : start + 2048] = bytes(len(content[start : start + 2048]))
    else:
        content = bytearray(data.draw(st.binary(max_size=300)))
    path = tmp_path / "damaged.db"
    path.write_bytes(content)
    told = complaint(path)
    assert told is None or ("history" in told or str(path) in told)
    assert told is None or "\n" not in told
    assert path.read_bytes() == bytes(content)


@pytest.mark.parametrize("part", [0.3, 0.6, 0.9])
def test_a_cut_file_is_refused(whole, tmp_path, part):
    path = tmp_path / "cut.db"
    path.write_bytes(whole[: int(part * len(whole))])
    for read_only in (True, False):
        with pytest.raises(FileFormatError, match="damaged"):
            Store(path, read_only=read_only)


@pytest.mark.parametrize(
    ("script", "reads"),
    [
        ("UPDATE points SET detail = '{'", "points"),
        ("UPDATE plans SET document = '[]'", "measurement"),
        ("UPDATE plans SET document = '{\"levels_vpk\": [-1]}'", "measurement"),
        (
            'UPDATE plans SET document = \'{"frequencies_hz": [1], "levels_vpk": [1], '
            '"a\\nb": 1}\'',
            "measurement",
        ),
        ("UPDATE measurements SET source_state = 'humming'", "measurement"),
        ("UPDATE points SET flags = 'x'", "points"),
        ("UPDATE units SET name = CAST(x'ff00ff' AS TEXT)", "measurement"),
    ],
)
def test_unreadable_record_is_reported(whole, tmp_path, script, reads):
    path = tmp_path / "odd.db"
    path.write_bytes(whole)
    run_sql(path, script)
    with Store(path) as store, pytest.raises(FileFormatError) as caught:
        getattr(store, reads)(1)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "script",
    [
        "CREATE TRIGGER t AFTER INSERT ON events BEGIN DELETE FROM points; END",
        "DROP TABLE estimates; CREATE VIEW estimates AS WITH RECURSIVE n(id) AS "
        "(SELECT 1 UNION ALL SELECT id + 1 FROM n) SELECT id FROM n",
    ],
)
def test_history_containing_a_program_is_refused(whole, tmp_path, script):
    path = tmp_path / "trap.db"
    path.write_bytes(whole)
    run_sql(path, script)
    for read_only in (True, False):
        with pytest.raises(FileFormatError, match="views or triggers"):
            Store(path, read_only=read_only)


def test_too_deeply_nested_record_is_reported(whole, tmp_path):
    path = tmp_path / "deep.db"
    path.write_bytes(whole)
    run_sql(path, f"UPDATE points SET detail = '{'[' * 100_000}'")
    with Store(path) as store, pytest.raises(FileFormatError, match="nested too deeply"):
        store.points(1)
