"""A history that one process has open twice, and another opens and closes: nothing is lost."""

import subprocess
import sys

import pytest

from daq.errors import LashbenchError
from daq.store import Store

SESSION = """
import os, sys
from pathlib import Path
from daq.analyser import SweepPoint
from daq.plan import SweepPlan
from daq.store import Store
from daq.store_records import MeasurementHeader
path = Path(sys.argv[1])
store = Store(path, create=True)
measurement = store.begin(MeasurementHeader("U", "", SweepPlan((1.0, 2.0, 3.0), (1.0,)), "x:", "t"))
store.add_point(measurement, 1.0, 1.0, SweepPoint(1.0, 1j))
for read_only in (True, False):
    with Store(path, read_only=read_only) as again:
        assert len(again.points(measurement)) == 1
print("looked", flush=True)
sys.stdin.readline()
store.add_point(measurement, 1.0, 2.0, SweepPoint(2.0, 2j))
with Store(path, read_only=True) as again:
    assert len(again.points(measurement)) == 2
store.add_point(measurement, 1.0, 3.0, SweepPoint(3.0, 3j))
print("told", flush=True)
sys.stdin.readline()
os._exit(9)
"""
OTHER = "import sys; from daq.store import Store; Store(sys.argv[1]).close()"


def test_reading_history_meanwhile_loses_no_point(tmp_path):
    """As a screen does beside its session, and `history` in another terminal."""
    db = tmp_path / "bench.db"
    process = subprocess.Popen(
        [sys.executable, "-c", SESSION, str(db)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    with process:
        assert process.stdout.readline() == "looked\n"
        subprocess.run([sys.executable, "-c", OTHER, str(db)], check=True)
        process.stdin.write("\n")
        process.stdin.flush()
        assert process.stdout.readline() == "told\n"
        with Store(db, read_only=True) as store:
            assert len(store.points(1)) == 3
        process.stdin.close()
        assert process.wait() == 9
    with Store(db) as store:
        assert [point.point.gain for point in store.points(1)] == [1j, 2j, 3j]


def test_file_replaced_beside_open_one_is_refused(tmp_path):
    db, other = tmp_path / "bench.db", tmp_path / "other.db"
    other.write_text("something else, and more of it")
    with Store(db, create=True), pytest.raises(LashbenchError, match="is not a history"):
        Store(other)
    db.unlink()
    db.write_text("something else, and more of it")
    with pytest.raises(LashbenchError, match="is not a history"):
        Store(db)
