"""A session that dies, stands still or loses its watchdog: the source goes off, and it is said.

Real processes on a real socket; what the source does is read from the simulated analyser itself,
which lives here.
"""

import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest
from instruments.bench_server import linear_analyser, served, simulated, wires_of
from instruments.fake_analyser import known_gain
from instruments.single_gateway import one_at_a_time
from worlds.frozen_files import can_be_held, started

from daq.analyser import SourceState
from daq.drivers import DRIVERS
from daq.store import Store
from sim.instrument.plant import LinearPlant

LASHBENCH = str(Path(sys.executable).with_name("lashbench"))
SWEEP = ["--level", "2", "--start", "130", "--stop", "170", "--points", "2500"]
QUICK = ["--settle-cycles", "3", "--integrate-cycles", "4", "--yes"]
SILENT_S = 60.0
"""More than any session is silent before it is taken over, on a busy machine, too."""

EVERY_WIRE = [(driver.scheme, wire) for driver in DRIVERS for wire in wires_of(driver.scheme)]
ONCE = [
    pair for n, pair in enumerate(EVERY_WIRE)
    if pair[1] not in [wire for _, wire in EVERY_WIRE[:n]]
    or pair[0] not in [driver for driver, _ in EVERY_WIRE[:n]]
]  # fmt: skip
needs_holding = pytest.mark.skipif(not can_be_held(), reason="needs seccomp on Linux")


def words(url, db):
    return ["measure", "--unit", "adss", "--instrument", url, *SWEEP, *QUICK, "--db", str(db)]


def drives(instrument):
    return instrument.driven_v > 0.0


def wait_for(what, seconds=SILENT_S):
    """How long it took until something holds."""
    began = time.monotonic()
    while not what():
        assert time.monotonic() - began < seconds, "it did not come about"
        time.sleep(0.02)
    return time.monotonic() - began


@contextmanager
def measuring(url, db, **options):
    """The command line in a process of its own."""
    process = subprocess.Popen(
        [LASHBENCH, *words(url, db)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        **options,
    )  # fmt: skip
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def watchdogs_of(process):
    children = Path(f"/proc/{process}/task/{process}/children")
    return [int(word) for word in children.read_text(encoding="ascii").split()]


def notes(db, kind):
    with Store(db, read_only=True) as store:
        return [event.text for event in store.events(1) if event.kind == kind]


def source(db):
    with Store(db, read_only=True) as store:
        return store.measurement(1).source_state


def points(db):
    with Store(db, read_only=True) as store:
        return len(store.points(1))


@pytest.fixture
def db(tmp_path):
    return tmp_path / "bench.db"


def test_files_beside_work_replace_no_watchdog(tmp_path, db):
    """Modules in the working folder."""
    ran = tmp_path / "ran"
    for name in ("daq", "sim", "tui"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(f"open({str(ran)!r}, 'a').write({name!r})")
    for name in ("numpy", "sqlalchemy", "analysis", "json"):
        (tmp_path / f"{name}.py").write_text(f"open({str(ran)!r}, 'a').write({name!r})")
    instrument = linear_analyser(known_gain)
    with served(instrument) as url, measuring(url, db, cwd=tmp_path) as process:
        wait_for(lambda: drives(instrument))
        process.kill()
        assert wait_for(lambda: not drives(instrument)) < 20.0
        wait_for(lambda: notes(db, "watchdog"))
    assert not ran.exists(), ran.read_text()


def test_dead_watchdog_is_replaced_and_reported(db):
    instrument = linear_analyser(known_gain)
    with served(instrument) as url, measuring(url, db) as process:
        wait_for(lambda: drives(instrument))
        (first,) = watchdogs_of(process.pid)
        os.kill(first, signal.SIGKILL)
        wait_for(lambda: notes(db, "warning"))
        (second,) = watchdogs_of(process.pid)
        assert second != first
        assert drives(instrument)
        time.sleep(3.0)  # it loads what it needs
        process.kill()
        assert wait_for(lambda: not drives(instrument)) < 20.0
        assert (
            "warning: the watchdog ended (signal 9); another one was started"
            in (process.communicate()[1])
        )
    assert notes(db, "warning") == ["the watchdog ended (signal 9); another one was started"]


@pytest.mark.slow
def test_stopped_watchdog_is_replaced(db):
    instrument = linear_analyser(known_gain)
    with served(instrument, realtime=True) as url, measuring(url, db) as process:
        wait_for(lambda: drives(instrument))
        (first,) = watchdogs_of(process.pid)
        os.kill(first, signal.SIGSTOP)
        wait_for(lambda: notes(db, "warning"))
        assert first not in watchdogs_of(process.pid)
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=60)
    assert process.returncode == 130
    assert notes(db, "warning") == [
        "the watchdog ended (no sign of life within 10 s); another one was started"
    ]
    assert source(db) is SourceState.CONFIRMED_OFF


def test_silent_watchdog_allows_no_driving(db):
    instrument = linear_analyser(known_gain)
    with served(instrument) as url, measuring(url, db) as process:
        seen = set()
        while process.poll() is None:
            for child in watchdogs_of(process.pid) if process.poll() is None else ():
                os.kill(child, signal.SIGKILL)
                seen.add(child)
            assert not drives(instrument)
            time.sleep(0.002)
        told = process.stderr.read()
    assert process.returncode == 1
    (line,) = [line for line in told.splitlines() if line.startswith("error: the watchdog")]
    assert "(signal 9)" in line
    assert "nothing was driven" in line or "nothing is driven" in line
    assert 2 <= len(seen) <= 4


@pytest.mark.slow
@pytest.mark.parametrize(
    "driver",
    ["", *(pytest.param(one.scheme, marks=pytest.mark.long) for one in DRIVERS if one.scheme)],
)
def test_stopped_session_loses_bench_and_learns_it(db, driver):
    instrument = simulated(driver, LinearPlant(known_gain))
    with served(instrument, driver=driver) as url, measuring(url, db) as process:
        wait_for(lambda: drives(instrument))
        os.kill(process.pid, signal.SIGSTOP)
        assert wait_for(lambda: not drives(instrument)) < 40.0
        # Where it was halted within a commit nobody else can write before it goes on.
        time.sleep(3.0)
        kept = points(db)
        os.kill(process.pid, signal.SIGCONT)
        while process.poll() is None:
            assert not drives(instrument)
            time.sleep(0.002)
        told = process.stderr.read()
        wait_for(lambda: notes(db, "watchdog"))
    assert source(db) is SourceState.CONFIRMED_OFF
    assert process.returncode == 1
    assert "stood still while it drove, and its watchdog took over: source confirmed-off" in told
    assert "the watchdog took over; source confirmed-off" in notes(db, "watchdog")[0]
    assert kept <= points(db) <= kept + 1


@pytest.mark.slow
def test_stopped_session_on_only_wire_is_ended(db):
    instrument = linear_analyser(known_gain)
    with (
        served(instrument) as url,
        one_at_a_time(url) as only,
        measuring(only, db) as process,
    ):
        wait_for(lambda: drives(instrument))
        os.kill(process.pid, signal.SIGSTOP)
        assert wait_for(lambda: not drives(instrument)) < 60.0
        assert process.wait(30) == -signal.SIGKILL
        wait_for(lambda: notes(db, "watchdog"))
    assert "kept process" in notes(db, "watchdog")[0]
    assert source(db) is SourceState.CONFIRMED_OFF


@needs_holding
@pytest.mark.slow
@pytest.mark.parametrize("told", [signal.SIGTERM, None])
def test_blocked_history_delays_neither_source_nor_signal(tmp_path, told):
    folder = tmp_path / "share"
    folder.mkdir()
    db = folder / "bench.db"
    instrument = linear_analyser(known_gain)
    with (
        served(instrument) as url,
        started(
            [LASHBENCH, *words(url, db)], folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True,
        ) as (process, freezer),
    ):  # fmt: skip
        wait_for(lambda: drives(instrument))
        time.sleep(0.5)
        freezer.freeze()
        wait_for(lambda: freezer.holds)
        if told is not None:
            process.send_signal(told)
        assert wait_for(lambda: not drives(instrument)) < (15.0 if told else 30.0)
        _, said = process.communicate(timeout=60)
        assert process.returncode == (130 if told else 1)
        assert freezer.holds
        assert not drives(instrument)
        freezer.thaw()
        wait_for(lambda: notes(db, "watchdog"))
    assert "bench.db: does not answer within" in said
    assert source(db) is SourceState.CONFIRMED_OFF
    (note,) = notes(db, "watchdog")
    assert note.startswith("the session ended, which its history did not take then")
    assert ("interrupted by SIGTERM" if told else "does not answer") in note


@needs_holding
def test_history_blocked_at_start_can_be_interrupted(tmp_path):
    folder = tmp_path / "share"
    folder.mkdir()
    instrument = linear_analyser(known_gain)
    with (
        served(instrument) as url,
        started(
            [LASHBENCH, *words(url, folder / "bench.db")], folder, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True,
        ) as (process, freezer),
    ):  # fmt: skip
        freezer.freeze()
        wait_for(lambda: freezer.holds)
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=60)
        assert freezer.holds
    assert process.returncode == 130
    assert said.splitlines()[-1] == "error: interrupted by SIGTERM; nothing was driven"


@needs_holding
@pytest.mark.slow
def test_blocked_transcript_ends_and_measurement_continues(tmp_path):
    folder = tmp_path / "share"
    folder.mkdir()
    db = tmp_path / "bench.db"
    instrument = linear_analyser(known_gain)
    with (
        served(instrument) as url,
        started(
            [LASHBENCH, *words(url, db), "--transcript", str(folder / "dialogue.txt")], folder,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        ) as (process, freezer),
    ):  # fmt: skip
        wait_for(lambda: drives(instrument))
        freezer.freeze()
        wait_for(lambda: freezer.holds)
        kept = points(db)
        wait_for(lambda: points(db) > kept + 20)
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=60)
        assert freezer.holds
    assert process.returncode == 130
    assert "(it does not answer within 5 s); the measurement goes on without" in said
    assert source(db) is SourceState.CONFIRMED_OFF
    assert not drives(instrument)


@pytest.mark.long
@needs_holding
def test_unconfirmed_flush_ends_measurement(tmp_path):
    """Commits go on, into memory; a power cut would take them all."""
    folder = tmp_path / "share"
    folder.mkdir()
    db = folder / "bench.db"
    instrument = linear_analyser(known_gain)
    long = [word for level in ("1.5", "1", "0.5") for word in ("--level", level)]
    with (
        served(instrument) as url,
        started(
            [LASHBENCH, *words(url, db), *long], folder,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        ) as (process, freezer),
    ):  # fmt: skip
        wait_for(lambda: drives(instrument))
        freezer.freeze("fsync")
        _, said = process.communicate(timeout=120)
        assert not drives(instrument)
    assert process.returncode == 1
    assert "bench.db-wal: the disk has not confirmed data for 30 s" in said
    assert source(db) is SourceState.CONFIRMED_OFF


LOADED_LATER = """
import sys
from pathlib import Path
from daq.session import watchdog_child
url, db = sys.argv[1:]
watchdog_child.load(url)
before = set(sys.modules)
state, found = watchdog_child.make_safe(url)
watchdog_child.write_down(Path(db), 1, found, state)
print(sorted(set(sys.modules) - before), state)
"""


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A history with one measurement."""
    db = tmp_path_factory.mktemp("measured") / "bench.db"
    short = ["--level", "1", "--start", "130", "--stop", "170", "--points", "2", *QUICK]
    place = ["--unit", "adss", "--instrument", "sim:", "--db", str(db)]
    subprocess.run([LASHBENCH, "measure", *place, *short], check=True, capture_output=True)
    return db


@pytest.mark.parametrize(
    ("driver", "wire"),
    # Each driver and each wire once; `make long` takes all combinations.
    [pair if pair in ONCE else pytest.param(*pair, marks=pytest.mark.long) for pair in EVERY_WIRE],
)
def test_watchdog_loads_no_module_when_needed(measured, db, driver, wire):
    shutil.copy(measured, db)
    with served(simulated(driver, LinearPlant(known_gain)), wire, driver) as url:
        run = subprocess.run(
            [sys.executable, "-I", "-c", LOADED_LATER, url, str(db)],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
    assert run.stdout == "[] confirmed-off\n", run.stderr
    assert notes(db, "watchdog") == ["; source confirmed-off"]
