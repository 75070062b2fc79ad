"""Binary files are read where a crash, a bomb or a loop costs nothing."""

import hashlib
import json
import os
import subprocess
import sys
import zlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from worlds.responses import measured

from daq.errors import FileFormatError
from daq.formats import read_response, write_response
from daq.formats.apart import read_apart
from daq.untrusted.child import child_command, child_environment

CRASH = Path(__file__).parents[2] / "data" / "crash.mat"
LASHBENCH = str(Path(sys.executable).with_name("lashbench"))
PEAK = """
import json, resource, sys
from daq.errors import FileFormatError
from daq.formats import read_response
try:
    told = read_response(sys.argv[1])
except FileFormatError as error:
    told = str(error)
# Of this process not ru_maxrss: that counts what its parent held when it started it.
(own,) = [line for line in open("/proc/self/status") if line.startswith("VmHWM")]
most = [int(own.split()[1]), resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss]
print(json.dumps([told, max(most) >> 10]))
"""


def with_a_head(rest: bytes) -> bytes:
    text = f"MATLAB 5.0 MAT-file, lashbench, sha256 {hashlib.sha256(rest).hexdigest()}"
    return text.ljust(116).encode("ascii") + rest


def element(kind: int, content: bytes) -> bytes:
    head = kind.to_bytes(4, "little") + len(content).to_bytes(4, "little")
    return head + content + bytes(-len(content) % 8)


def bomb(count: int) -> bytes:
    """A MATLAB file of some MB whose one array has so many numbers, all zero."""
    name = b"frequency_hz"
    parts = (
        element(6, (6).to_bytes(4, "little") + bytes(4))
        + element(5, count.to_bytes(4, "little") + (1).to_bytes(4, "little"))
        + element(1, name)
        + (9).to_bytes(4, "little")
        + (8 * count).to_bytes(4, "little")
    )
    head = (14).to_bytes(4, "little") + (len(parts) + 8 * count).to_bytes(4, "little") + parts
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    begun = packer.compress(head) + packer.flush(zlib.Z_FULL_FLUSH)
    zeros = bytes(1 << 20)
    again = zlib.compressobj(9, zlib.DEFLATED, -15)
    piece = again.compress(zeros) + again.flush(zlib.Z_FULL_FLUSH)
    end = zlib.compressobj(9, zlib.DEFLATED, -15).flush()
    # The sum over all: zeros leave the one half as it is, and add it to the other once each.
    sums = zlib.adler32(head)
    low, high = sums & 0xFFFF, sums >> 16
    high = (high + low * 8 * count) % 65521
    packed = b"\x78\xda" + begun + piece * (8 * count >> 20) + end
    packed += (high << 16 | low).to_bytes(4, "big")
    return with_a_head(bytes(8) + b"\x00\x01IM" + element(15, packed)[: 8 + len(packed)])


def crashers(folder: Path) -> list[Path]:
    """Files that end scipy's reader by SIGSEGV, each in most processes though not in every one."""
    rest, paths = CRASH.read_bytes()[116:], []
    for kind in (193, 40, 60, 1000, 20000):
        other = rest.replace(b"\xc1\x00\x02\x00", kind.to_bytes(2, "little") + b"\x02\x00")
        paths.append(folder / f"crash-{kind}.mat")
        paths[-1].write_bytes(with_a_head(other))
    assert paths[0].read_bytes() == CRASH.read_bytes()
    return paths


def test_crash_of_reader_is_one_line():
    done = subprocess.run([LASHBENCH, "extract", str(CRASH)], capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith(f"error: {CRASH}: cannot be read")
    assert done.stderr.count("\n") == 1


def test_reader_crash_is_isolated_between_threads(tmp_path):
    def told(path):
        with pytest.raises(FileFormatError) as error:
            read_response(path)
        return str(error.value)

    with ThreadPoolExecutor(3) as pool:
        assert any("crashed" in line for line in pool.map(told, crashers(tmp_path)))


def test_a_bomb_is_refused_in_bounded_memory(tmp_path):
    path = tmp_path / "bomb.mat"
    path.write_bytes(bomb((3 << 30) // 8))
    assert path.stat().st_size < 4_000_000
    done = subprocess.run(
        [sys.executable, "-c", PEAK, str(path)], capture_output=True, text=True, check=True
    )
    told, peak_mib = json.loads(done.stdout)
    assert str(path) in told
    assert "memory" in told.lower() or "allocate" in told
    assert peak_mib < 1024


def test_small_file_of_same_form_passes_limit(tmp_path):
    path = tmp_path / "small.mat"
    path.write_bytes(bomb((1 << 20) // 8))
    with pytest.raises(FileFormatError, match="its document is missing"):
        read_response(path)


def test_endless_reader_is_stopped(tmp_path):
    path = tmp_path / "x.mat"
    write_response(measured(), path)
    with pytest.raises(FileFormatError, match="it took too long"):
        read_apart("daq.formats.mat", path, clock_s=0.01)


@pytest.mark.parametrize("suffix", ["mat", "h5"])
def test_child_process_reads_what_was_written(tmp_path, suffix):
    path, whole = tmp_path / f"x.{suffix}", measured()
    write_response(whole, path)
    again = read_response(path)
    for name in ("frequency_hz", "gain", "gain_std_db", "flags", "phase_known"):
        assert np.array_equal(getattr(again, name), getattr(whole, name), equal_nan=True)


def test_working_directory_code_is_not_run(tmp_path):
    write_response(measured(), tmp_path / "x.h5")
    for name in ("daq", "h5py", "numpy"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("open('was-run', 'w')\nraise SystemExit(3)")
    (tmp_path / "json.py").write_text("open('was-run', 'w')\nraise SystemExit(3)")
    done = subprocess.run(
        child_command("daq.formats.apart", "daq.formats.hdf5", "x.h5"),
        cwd=tmp_path,
        env=child_environment() | {"PYTHONPATH": ".", "PYTHONSTARTUP": "json.py"},
        capture_output=True,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout.partition(b"\n")[0])["rows"] == len(measured())
    assert not (tmp_path / "was-run").exists()


def test_a_child_runs_our_modules_only():
    done = subprocess.run(
        child_command("json.tool", "x"), capture_output=True, text=True, env=os.environ
    )
    assert done.returncode == 1
    assert "is not the one of lashbench" in done.stderr
