"""A disk that has no room: one error, and nothing left of the file, whatever the format."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

# In a program of its own: a library that does not survive it must not end the tests. One file
# is written before, so that all is loaded, and no byte code is kept that the limit cuts short.
WRITER = """
import resource, sys
from pathlib import Path
from worlds.responses import measured
from daq.errors import LashbenchError
from daq.formats import write_response
path, limit = Path(sys.argv[1]), int(sys.argv[2])
whole = measured(points=300)
write_response(whole, path)
path.write_bytes(b"old")
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
try:
    write_response(whole, path)
except LashbenchError as error:
    print(error.exit_code, error)
"""


@pytest.mark.parametrize(
    ("suffix", "limit"),
    [
        (".csv", 0),
        (".h5", 8192),
        *(pytest.param(suffix, 0, marks=pytest.mark.long) for suffix in (".h5", ".mat", ".uff")),
        *(
            pytest.param(suffix, 8192, marks=pytest.mark.long)
            for suffix in (".csv", ".mat", ".uff")
        ),
    ],
)
def test_full_disk_keeps_old_file_with_message(tmp_path, suffix, limit):
    pytest.importorskip("resource")
    path = tmp_path / f"lim{suffix}"
    root = Path(__file__).parents[3]
    done = subprocess.run(
        [sys.executable, "-B", "-c", WRITER, str(path), str(limit)],
        env=os.environ | {"PYTHONPATH": f"{root}{os.pathsep}{root / 'tests'}"},
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"1 {path}: could not be written (File too large)\n"
    assert path.read_bytes() == b"old"
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]
