"""What numba kept where others can write is not loaded: its index is a pickle, which runs code."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

SOURCE = """
from sim.engine.compiling import njit

@njit(cache=True)
def twice(x):
    return 2 * x

print(twice(21))
"""


class Evil:
    """As a pickle it makes a file."""

    def __init__(self, place):
        self.place = place

    def __reduce__(self):
        return Path.touch, (self.place,)


def run(folder, **where):
    kept = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    done = subprocess.run(
        [sys.executable, "law.py"], cwd=folder, env=kept | where, capture_output=True, text=True
    )
    assert (done.returncode, done.stdout) == (0, "42\n"), done.stderr
    return done.stderr


@pytest.mark.parametrize("place", ["beside the source", "NUMBA_CACHE_DIR"])
def test_an_index_of_others_is_not_loaded(tmp_path, place):
    work = tmp_path / "work"
    work.mkdir()
    (work / "law.py").write_text(SOURCE)
    where = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    shared = work / "__pycache__"
    shared.mkdir()
    if place == "NUMBA_CACHE_DIR":
        shared = tmp_path / "numba"
        shared.mkdir()
        where["NUMBA_CACHE_DIR"] = str(shared)
    run(work, **where)
    (index,) = shared.rglob("*.nbi")
    index.write_bytes(pickle.dumps(Evil(tmp_path / "was-run")))
    shared.chmod(0o777)
    told = run(work, **where)
    assert not (tmp_path / "was-run").exists()
    assert (f"{shared} can be written by others" in told) == (place == "NUMBA_CACHE_DIR")
    assert list((tmp_path / "cache").rglob("*.nbi"))
    if place == "NUMBA_CACHE_DIR":
        # What this user keeps for himself alone is loaded: so the index above would have been.
        shared.chmod(0o755)
        run(work, **where)
        assert (tmp_path / "was-run").exists()
