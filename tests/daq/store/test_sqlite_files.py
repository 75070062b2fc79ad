"""What has the name of a file of SQLite's beside a history, and is none, is left as it is."""

import os
import subprocess
import sys

import pytest

from daq.errors import InputError
from daq.store import Store

KILLED = """
import os, sys
from pathlib import Path
from daq.store import Store
store = Store(Path(sys.argv[1]), create=True)
os._exit(0)
"""


@pytest.fixture
def history(tmp_path):
    path = tmp_path / "bench.db"
    Store(path, create=True).close()
    return path


@pytest.mark.parametrize("ending", ["-wal", "-shm", "-journal"])
@pytest.mark.parametrize("kind", ["link", "hard link", "text", "folder", "pipe"])
@pytest.mark.parametrize("read_only", [False, True])
def test_foreign_file_is_left_unchanged(history, tmp_path, ending, kind, read_only):
    theirs, place = tmp_path / "colleague.txt", tmp_path / f"bench.db{ending}"
    theirs.write_text("the colleague's results")
    if kind == "link":
        place.symlink_to(theirs)
    elif kind == "hard link":
        place.hardlink_to(theirs)
    elif kind == "text":
        place.write_text("the colleague's results")
    elif kind == "folder":
        place.mkdir()
    else:
        os.mkfifo(place)
    before = place.lstat()
    with pytest.raises(InputError, match=r"is not SQLite's; .*move it away") as told:
        Store(history, read_only=read_only)
    assert str(place) in str(told.value)
    assert theirs.read_text() == "the colleague's results"
    assert (place.lstat().st_ino, place.lstat().st_mtime_ns) == (before.st_ino, before.st_mtime_ns)
    place.rmdir() if kind == "folder" else place.unlink()
    Store(history, read_only=read_only).close()


def test_files_left_by_killed_program_are_used(tmp_path):
    path = tmp_path / "bench.db"
    subprocess.run([sys.executable, "-c", KILLED, str(path)], check=True)
    assert (tmp_path / "bench.db-wal").stat().st_size > 0
    with Store(path) as store:
        assert store.measurements() == []


def test_history_opened_by_another_opens_too(history):
    with Store(history), Store(history), Store(history, read_only=True):
        pass
