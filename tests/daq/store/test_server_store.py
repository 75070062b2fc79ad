"""A history on a PostgreSQL server: shared by benches, read only for readers, plain when away."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import sqlalchemy as sa
from hypothesis import given
from hypothesis import strategies as st
from worlds.postgres_server import PASSWORD, SHOWN

from daq.analyser import SourceState, SweepPoint
from daq.errors import FileFormatError, InputError, LinkError, MeasurementError
from daq.plan import SweepPlan
from daq.servers.place import HistoryServer, parse_place
from daq.session.bench_lock import BenchLock
from daq.store import Store
from daq.store.tables import units
from daq.store_records import MeasurementHeader

PLAN = SweepPlan((100.0, 110.0), (1.5,))


def begin(store, plan=PLAN, **remarks):
    return store.begin(MeasurementHeader("ADSS", "7", plan, "sim:", "t", **remarks))


def test_two_benches_write_and_third_reads(postgres_url):
    with (
        Store(postgres_url, create=True) as one,
        Store(postgres_url) as two,
        Store(postgres_url, read_only=True) as reader,
    ):
        first, second = begin(one), begin(two)
        for store, number in ((one, first), (two, second)):
            store.add_point(number, 1.5, 100.0, SweepPoint(100.0, complex(number)))
        assert [line.points for line in reader.lines()] == [1, 1]
        assert [reader.points(n)[0].point.gain for n in (first, second)] == [first, second]
        assert reader.measurement(first).header.plan == PLAN
        with pytest.raises(InputError, match="refused"):
            begin(reader)
        assert reader.count() == 2


def test_server_and_file_have_equal_columns(tmp_path, postgres_url):
    """Each has a layout of its own, and one description of the columns serves both."""
    with Store(tmp_path / "bench.db", create=True), Store(postgres_url, create=True):
        pass
    described = {name: set(table.columns.keys()) for name, table in units.metadata.tables.items()}
    assert len(described) == 10

    def columns(url, schema=None):
        """Whether each column may be empty, by table."""
        engine = sa.create_engine(url)
        found = sa.inspect(engine)
        held = {
            table: {c["name"]: c["nullable"] and c["name"] != "id" for c in columns}
            for (_, table), columns in found.get_multi_columns(schema).items()
        }
        engine.dispose()
        return held

    server = columns(sa.make_url(postgres_url).set(drivername="postgresql+psycopg"), "lashbench")
    del server["layout"]
    assert server == columns(f"sqlite:///{tmp_path / 'bench.db'}")
    assert {table: set(held) for table, held in server.items()} == described


def test_simultaneously_created_histories_are_one(postgres_url):
    faults, numbers = [], []

    def bench():
        try:
            with Store(postgres_url, create=True) as store:
                numbers.append(begin(store))
        except Exception as error:
            faults.append(error)

    threads = [threading.Thread(target=bench) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert faults == []
    assert sorted(numbers) == [1, 2, 3, 4]


def test_running_measurement_is_not_resumed_elsewhere(postgres_url):
    with Store(postgres_url, create=True) as one, Store(postgres_url) as two:
        number = begin(one)
        with pytest.raises(MeasurementError, match=f"another session is measuring {number}"):
            two.reopen(number)
        one.close()
        two.reopen(number)
        assert two.measurement(number).state == "interrupted"


KILLED = """
import os, signal, sys
from daq.analyser import SweepPoint
from daq.plan import SweepPlan
from daq.store import Store
from daq.store_records import MeasurementHeader
store = Store(sys.argv[1], create=True)
plan = SweepPlan(tuple(range(100, 200)), (1.5,))
number = store.begin(MeasurementHeader("ADSS", "7", plan, "sim:", "t"))
for hz in range(100, 200):
    store.add_point(number, 1.5, float(hz), SweepPoint(float(hz), 1j))
    print(hz, flush=True)
    if hz == 117:
        os.kill(os.getpid(), signal.SIGKILL)
"""


def test_kill_or_server_crash_loses_no_point(postgres, postgres_url):
    """No point that was reported as stored."""
    done = subprocess.run(
        [sys.executable, "-c", KILLED, postgres_url], capture_output=True, text=True
    )
    assert done.returncode == -signal.SIGKILL
    told = [float(line) for line in done.stdout.split()]
    postgres.stop()
    postgres.start()
    with Store(postgres_url) as store:
        assert [p.requested_hz for p in store.points(1)] == told
        store.reopen(1)  # whoever was killed holds it no more


def test_lost_server_is_reported_and_reconnected(postgres, postgres_url):
    with Store(postgres_url, create=True) as store:
        number = begin(store)
        store.add_point(number, 1.5, 100.0, SweepPoint(100.0, 1j))
        postgres.stop()
        try:
            began = time.monotonic()
            with pytest.raises(MeasurementError, match="the server does not answer"):
                store.add_point(number, 1.5, 110.0, SweepPoint(110.0, 1j))
            with pytest.raises(LinkError, match="the server does not answer"):
                Store(postgres_url)
            assert time.monotonic() - began < 10.0
        finally:
            postgres.start()
        store.add_point(number, 1.5, 110.0, SweepPoint(110.0, 2j))
        store.finish(number, "complete", SourceState.CONFIRMED_OFF)
        assert [p.point.gain for p in store.points(number)] == [1j, 2j]


def test_stopped_transaction_of_others_has_bounded_wait(postgres, postgres_url):
    with Store(postgres_url, create=True) as store:
        number = begin(store)
        import psycopg

        with psycopg.connect(postgres_url) as other:
            other.execute("LOCK TABLE lashbench.points")
            began = time.monotonic()
            with pytest.raises(MeasurementError, match="held by another program"):
                store.add_point(number, 1.5, 100.0, SweepPoint(100.0, 1j))
            assert 4.0 < time.monotonic() - began < 9.0


@pytest.mark.parametrize(
    ("statement", "fault", "said"),
    [
        ("UPDATE lashbench.layout SET version = 9", FileFormatError, "update lashbench"),
        ("UPDATE lashbench.layout SET version = 2", FileFormatError, "layout 2"),
        ("DROP TABLE lashbench.points CASCADE", FileFormatError, "does not hold"),
        ("ALTER TABLE lashbench.events RENAME text TO words", FileFormatError, "does not hold"),
        ("UPDATE lashbench.plans SET document = '{'", FileFormatError, "cannot be read"),
        ("UPDATE lashbench.measurements SET started = 'x'", FileFormatError, "cannot be read"),
    ],
)
def test_server_of_other_version_is_refused(postgres, postgres_url, statement, fault, said):
    with Store(postgres_url, create=True) as store:
        store.note(begin(store), "n", "t")
    postgres.sql("bench", statement)

    def read():
        with Store(postgres_url, read_only=True) as store:
            return store.measurement(1), store.points(1), store.events(1)

    with pytest.raises(fault, match=said) as told:
        read()
    assert "\n" not in str(told.value)


def test_refused_login_message_hides_the_password(postgres, postgres_url):
    for wrong, said in (
        (postgres.url("bench", password="guess4"), "password authentication"),
        (postgres.url("nothing"), "does not exist"),
        (postgres.url("bench", user="nobody"), "refused"),
        (postgres_url, "no history in that database"),
    ):
        with pytest.raises(InputError, match=said) as told:
            Store(wrong, read_only=True)
        assert "\n" not in str(told.value)
        for secret in (PASSWORD, SHOWN, "guess4"):
            assert secret not in f"{told.value!r} {told.value.__cause__!r}"


def test_a_reader_without_rights_to_write_reads(postgres, postgres_url):
    with Store(postgres_url, create=True) as store:
        begin(store)
    postgres.sql(
        "bench",
        "DROP ROLE IF EXISTS visitor",
        "CREATE ROLE visitor LOGIN PASSWORD 'v'",
        "GRANT USAGE ON SCHEMA lashbench TO visitor",
        "GRANT SELECT ON ALL TABLES IN SCHEMA lashbench TO visitor",
    )
    visitor = postgres.url("bench", "visitor", "v")
    with Store(visitor, read_only=True) as store:
        assert len(store.lines()) == 1
    with Store(visitor) as store, pytest.raises(InputError, match="check user"):
        begin(store)
    postgres.sql("bench", "DROP OWNED BY visitor", "DROP ROLE visitor")


def test_texts_server_cannot_keep_are_refused(postgres_url):
    with Store(postgres_url, create=True) as store:
        for notes in ("a\0b", "\udcff"):
            with pytest.raises(InputError, match="cannot be kept"):
                begin(store, notes=notes)
        number = begin(store, notes="ü \u202e ' \" ; DROP TABLE points --")
        assert store.measurement(number).header.notes == "ü \u202e ' \" ; DROP TABLE points --"


def test_a_plan_of_many_points_is_shared(postgres_url):
    plan = SweepPlan(tuple(100.0 + k / 7 for k in range(20_000)), (1.5,))
    with Store(postgres_url, create=True) as store:
        numbers = [begin(store, plan) for _ in range(2)]
        assert [store.measurement(n).header.plan for n in numbers] == [plan, plan]


def test_server_allows_one_session_per_machine():
    place = parse_place(f"postgresql://u:{SHOWN}@bench-host/d{os.getpid()}")
    with BenchLock(place), pytest.raises(MeasurementError, match="another session") as told:
        BenchLock(place, patience_s=0.2)
    assert PASSWORD not in str(told.value)


@given(st.text(max_size=30), st.sampled_from(["postgresql://", "postgres://", "", "mysql://"]))
def test_place_is_file_server_or_refused(text, scheme):
    words = f"{scheme}u:s3cr%65t!@{text}" if scheme else text
    said = ""
    try:
        place = parse_place(words)
    except InputError as error:
        said = str(error)
    assert "s3cr" not in said
    if said:
        return
    assert isinstance(place, HistoryServer if scheme else Path)
    assert "s3cr" not in f"{place} {place!r}"
    if scheme:
        assert place.password in ("s3cret!", None) or "@" in text
