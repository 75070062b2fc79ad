"""A history of layout 2, made by lashbench before points had versions; the clock was ahead once.

Measurement 1 was estimated twice, 2 was estimated and then measured again, 3 gave no estimate,
4 was not estimated.
"""

import sqlite3
from pathlib import Path

import pytest

from daq.errors import FileFormatError
from daq.store import Store
from daq.store.schema import SCHEMA_VERSION

V2 = (Path(__file__).parents[2] / "data" / "history-v2.sql").read_text()


@pytest.fixture
def old(tmp_path):
    path = tmp_path / "old.db"
    raw = sqlite3.connect(path)
    raw.executescript(V2)
    raw.close()
    return path


def told(store):
    return [
        (
            line.id, line.unit, line.serial, line.points, line.planned, line.flagged,
            line.levels_vpk, line.simulated,
            None if line.estimate is None else line.estimate.summary,
        )
        for line in store.lines()
    ]  # fmt: skip


def test_older_file_reads_alike_after_migration(old):
    before = old.read_bytes()
    with Store(old, read_only=True) as store:
        as_it_is = told(store)
        points = [store.points(number, superseded=True) for number in (1, 2, 3, 4)]
    assert old.read_bytes() == before
    Store(old).close()
    with Store(old, read_only=True) as store:
        assert told(store) == as_it_is
        assert [store.points(number, superseded=True) for number in (1, 2, 3, 4)] == points
        assert [len(some) for some in points] == [5, 7, 5, 5]
        assert [len(store.points(number)) for number in (1, 2, 3, 4)] == [5, 5, 5, 5]
    assert [row[:4] for row in as_it_is] == [
        (1, "ADSS", "SN-7", 5), (2, "ADSS", "SN-7", 5), (3, "ADSS", "SN-8", 5), (4, "EDSS", "", 5)
    ]  # fmt: skip
    assert as_it_is[0][4:8] == (5, 0, (2.5,), True)


def test_possibly_outdated_estimate_is_not_in_force(old):
    with Store(old) as store:
        first, second, third, fourth = store.lines()
        assert first.estimate.summary["contribution_ratio"]["value"] == 0.31
        assert first.estimate.summary["warnings"] == []
        # Made while the clock was years ahead, of points that were measured again since.
        assert second.estimate is None
        assert store.estimate_in_force(2) is None
        assert third.estimate.summary["failed"] == "no resonance in the band"
        assert fourth.estimate is None
        # Nothing is lost: what was said then is still there.
        assert store.latest_estimates()[2].document["contribution_ratio"]["value"] == 0.45


def test_older_software_refuses_migrated_file(old):
    Store(old).close()
    raw = sqlite3.connect(old)
    (version,) = raw.execute("PRAGMA user_version").fetchone()
    raw.close()
    # This is what every lashbench asks before anything else; one of layout 2 knows no more.
    assert version == SCHEMA_VERSION > 2


def test_invalid_document_does_not_stop_migration(old):
    raw = sqlite3.connect(old)
    raw.execute("UPDATE estimates SET document = '{\"contribution_ratio\": NaN' WHERE id = 2")
    raw.execute("UPDATE estimates SET document = x'00' WHERE id = 3")
    raw.commit()
    raw.close()
    with Store(old, read_only=True) as store:
        assert store.lines()[1].estimate is None
    with Store(old) as store:
        assert [line.estimate is None for line in store.lines()] == [False, True, False, True]
        # The one before it is of the same points.
        assert store.lines()[0].estimate.summary["contribution_ratio"]["value"] == 0.7
        with pytest.raises(FileFormatError):
            store.latest_estimates()
