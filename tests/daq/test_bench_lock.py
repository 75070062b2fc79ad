"""One session at a time on one bench, by whatever name its history is called."""

import os

import pytest

from daq.bench_lock import BenchLock
from daq.errors import InputError, MeasurementError


def test_links_to_one_history_are_one_bench(tmp_path):
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


def test_a_link_to_a_history_that_is_still_to_be_made_is_that_bench(tmp_path):
    history = tmp_path / "bench.db"
    link = tmp_path / "link.db"
    link.symlink_to(history)
    with BenchLock(link), pytest.raises(MeasurementError, match="another session"):
        BenchLock(history)


def test_two_histories_are_two_benches(tmp_path):
    with BenchLock(tmp_path / "one.db"), BenchLock(tmp_path / "two.db"):
        pass


def test_a_lock_that_cannot_be_made_is_told(tmp_path):
    with pytest.raises(InputError, match="lock cannot be made"):
        BenchLock(tmp_path / "nowhere" / "bench.db")
