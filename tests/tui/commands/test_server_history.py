"""Verbs on a history that several benches share on a PostgreSQL server."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from instruments.bench_server import serving
from worlds.postgres_server import SHOWN

from daq.store import Store
from tui import cli

LASHBENCH = [sys.executable, "-m", "tui.cli"]
SWEEP = ("--level", "2", "--start", "100", "--stop", "200", "--points", "5", "--settle-cycles", "2",
         "--integrate-cycles", "3")  # fmt: skip


@pytest.fixture
def verb(postgres_url, capsys):
    """Run a verb on the history of the server; exit code, stdout and stderr."""

    def call(name, *words, db=postgres_url):
        code = cli.main([name, *map(str, words), "--db", db])
        out, err = capsys.readouterr()
        for secret in (SHOWN, "not:a@secret"):
            assert secret not in out + err
        return code, out, err

    return call


def measured(verb, *more):
    code, out, err = verb("measure", "--unit", "adss", "--instrument", "sim:", *SWEEP, *more,
                          "--json")  # fmt: skip
    assert code == 0, err
    return json.loads(out)["id"]


def test_one_bench_measures_while_others_work(verb, postgres, tmp_path):
    """Others read, correct and export the history meanwhile."""
    number = measured(verb, "--serial", "7")
    code, out, _ = verb("history", "--unit", "ADSS", "--estimate", "none", "--json")
    (row,) = json.loads(out)["measurements"]
    assert (code, row["id"], row["state"], row["points"]) == (0, number, "complete", 5)
    assert verb("correct", number, "--serial", "8", "--by", "me")[0] == 0
    assert verb("history", "--serial", "8", "--estimate", "none")[0] == 0
    file, page = tmp_path / "x.csv", tmp_path / "index.html"
    assert verb("export", number, "--out", file)[0] == 0
    assert len([line for line in file.read_text().splitlines() if line[0].isdigit()]) == 5
    assert verb("index", "--out", page)[0] == 0
    assert "127.0.0.1" in page.read_text()
    assert SHOWN not in file.read_text() + page.read_text()


def test_server_faults_give_one_line_and_code(verb, postgres):
    for db, code, said in (
        (postgres.url("bench"), 2, "no history in that database"),
        (postgres.url("bench", password="guess4"), 2, "password authentication failed"),
        (f"postgresql://u:{SHOWN}@127.0.0.1:1/bench", 3, "does not answer"),
        (f"postgresql://u:{SHOWN}@127.0.0.1/", 2, "names no database"),
        (f"oracle://u:{SHOWN}@127.0.0.1/x", 2, "is no history"),
    ):
        found, out, err = verb("history", db=db)
        assert (found, out) == (code, "")
        assert said in err
        assert len(err.strip().splitlines()) == 1
        assert "guess4" not in err


def test_lost_server_ends_session_with_source_off(verb, postgres):
    with serving("--unit", "adss", "--ratio", "0.3", "--tcp", "0", "--speed", "fast") as places:
        words = [*LASHBENCH, "measure", "--unit", "adss", "--instrument", places["tcp"], "--yes",
                 "--level", "2", "--start", "100", "--stop", "200", "--points", "400",
                 "--settle-cycles", "2", "--integrate-cycles", "3",
                 "--db", postgres.url("bench")]  # fmt: skip
        with subprocess.Popen(
            words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        ) as session:
            points(postgres, 3)
            postgres.stop()
            try:
                said = session.communicate(timeout=90)[1]
            finally:
                postgres.start()
        assert session.returncode == 1, said
        assert "does not answer" in said.splitlines()[-1]
        assert "source confirmed off" in said
        assert SHOWN not in said
        found = points(postgres, 3)
        assert verb("measure", "--unit", "adss", "--instrument", places["tcp"], "--resume", 1,
                    "--yes", "--dry-run")[0] == 0  # fmt: skip
        assert found >= 3


def test_watchdog_of_killed_session_writes_to_server(postgres, postgres_url):
    with serving("--unit", "adss", "--ratio", "0.3", "--tcp", "0", "--speed", "fast") as places:
        words = [*LASHBENCH, "measure", "--unit", "adss", "--instrument", places["tcp"], "--yes",
                 "--level", "2", "--start", "100", "--stop", "200", "--points", "400",
                 "--settle-cycles", "2", "--integrate-cycles", "3",
                 "--db", postgres_url]  # fmt: skip
        with subprocess.Popen(
            words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as session:
            points(postgres, 3)
            place = Path(f"/proc/{session.pid}/task/{session.pid}/children")
            for child in place.read_text(encoding="ascii").split():
                line = Path(f"/proc/{child}/cmdline").read_bytes()
                assert b"watchdog" not in line or b"postgresql://bench@" in line
                assert SHOWN.encode() not in line
                assert b"not:a@secret" not in line
            os.kill(session.pid, signal.SIGKILL)
        until = time.monotonic() + 60.0
        with Store(postgres_url, read_only=True) as store:
            while store.measurement(1).source_state != "confirmed-off":
                assert time.monotonic() < until
                time.sleep(0.1)
            assert any(event.kind == "watchdog" for event in store.events(1))


def points(postgres, wanted):
    """Wait for points of the first measurement."""
    until = time.monotonic() + 90.0
    while time.monotonic() < until:
        try:
            ((count,),) = postgres.sql("bench", "SELECT count(*) FROM lashbench.points")
        except Exception:  # the tables are not there yet
            count = 0
        if count >= wanted:
            return count
        time.sleep(0.05)
    raise AssertionError("no points came")
