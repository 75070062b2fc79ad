"""One session at a time on one bench, by whatever name its history is called."""

import os

import pytest

from daq.errors import InputError, MeasurementError
from daq.session.bench_lock import BenchLock


def test_links_to_one_history_share_lock(tmp_path):
    history = tmp_path / "bench.db"
    history.touch()
    (tmp_path / "elsewhere").mkdir()
    link = tmp_path / "elsewhere" / "link.db"
    link.symlink_to(history)
    for first, second in ((history, link), (link, history)):
        with (
            BenchLock(first),
            pytest.raises(MeasurementError, match=rf"process {os.getpid()}\) is measuring"),
        ):
            BenchLock(second)
    with BenchLock(link):
        assert (tmp_path / "bench.db-lock").exists()
    assert sorted(path.name for path in tmp_path.rglob("*-lock")) == []


def test_link_to_future_history_locks_same_bench(tmp_path):
    history = tmp_path / "bench.db"
    link = tmp_path / "link.db"
    link.symlink_to(history)
    with BenchLock(link), pytest.raises(MeasurementError, match="another session"):
        BenchLock(history)


def test_two_histories_are_two_benches(tmp_path):
    with BenchLock(tmp_path / "one.db"), BenchLock(tmp_path / "two.db"):
        pass


def test_lock_that_cannot_be_made_is_reported(tmp_path):
    with pytest.raises(InputError, match="lock cannot be made"):
        BenchLock(tmp_path / "nowhere" / "bench.db")


def kept_of(place):
    """What is known of a file, but for when it was last read."""
    found = place.lstat()
    return found.st_ino, found.st_mode, found.st_nlink, found.st_size, found.st_mtime_ns


@pytest.mark.parametrize("kind", ["link", "hard link", "text", "folder", "pipe"])
def test_foreign_lock_file_is_unchanged(tmp_path, kind):
    theirs, place = tmp_path / "colleague.txt", tmp_path / "bench.db-lock"
    theirs.write_text("the colleague's results")
    if kind == "link":
        place.symlink_to(theirs)
    elif kind == "hard link":
        place.hardlink_to(theirs)
    elif kind == "text":
        place.write_text("28617 is what I measured")
    elif kind == "folder":
        place.mkdir()
    else:
        os.mkfifo(place)
    before = kept_of(place)
    with pytest.raises(InputError, match=r"is no lock of lashbench.*move it away") as told:
        BenchLock(tmp_path / "bench.db", patience_s=0.2)
    assert str(place) in str(told.value)
    assert theirs.read_text() == "the colleague's results"
    assert kept_of(place) == before


def test_dangling_link_creates_no_file(tmp_path):
    (tmp_path / "bench.db-lock").symlink_to(tmp_path / "new")
    with pytest.raises(InputError, match="is a link"):
        BenchLock(tmp_path / "bench.db")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("left", ["", "999999999\n"])
def test_abandoned_lock_is_taken_over(tmp_path, left):
    (tmp_path / "bench.db-lock").write_text(left)
    with BenchLock(tmp_path / "bench.db", patience_s=0.2):
        assert (tmp_path / "bench.db-lock").read_text() == f"{os.getpid()}\n"


def test_full_disk_is_reported_without_lock(tmp_path, small_disk):
    (small_disk / "filler").write_bytes(bytes(64 << 10))
    with pytest.raises(MeasurementError, match=r"bench\.db-lock: .*No space left.*make room"):
        BenchLock(small_disk / "bench.db")
    assert [path.name for path in small_disk.iterdir()] == ["filler"]


def test_too_long_name_is_reported(tmp_path):
    with pytest.raises(InputError, match=r"lock cannot be made \(File name too long\)"):
        BenchLock(tmp_path / ("x" * 250 + ".db"))
