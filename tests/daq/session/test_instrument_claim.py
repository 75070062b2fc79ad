"""One session at a time on one instrument, by whatever name it is called."""

import os
import subprocess
import sys

import pytest

from daq.errors import InputError, MeasurementError
from daq.session.bench_lock import BenchLock
from daq.session.instrument_claim import wire_name

URL = "TCPIP::127.0.0.1::{}::SOCKET"
HOLDER = """
import subprocess, sys
from pathlib import Path
from daq.session.bench_lock import BenchLock
lock = BenchLock(Path(sys.argv[1]), instrument=sys.argv[2])
# A watchdog's part: it holds the lock as well, and outlives the session.
child = subprocess.Popen(["sleep", "60"], pass_fds=[lock.descriptor])
print(child.pid, flush=True)
sys.stdin.read(1)
"""


@pytest.mark.parametrize(
    "same",
    [
        ("TCPIP::127.0.0.1::5025::SOCKET", "tcpip0::LOCALHOST::5025::socket",
         "prologix-tcp:127.0.0.1:5025?addr=11", "prologix-tcp:localhost:5025?addr=12"),
        ("GPIB0::11::INSTR", "gpib::11", "GPIB0::11", " GPIB::11::INSTR"),
        ("TCPIP::Bench.local::INSTR", "TCPIP0::bench.local::inst0::INSTR"),
        ("prologix:/dev/null?addr=11", "prologix:/dev/../dev/null", "sr785:prologix:/dev/null",
         "sr785:serial:/dev/null?baud=300"),
        ("sr785:GPIB0::10::INSTR", "gpib::10"),
        ("sim:", "sim:?ratio=0.3", "replay:x.jsonl", "sr785:sim:"),
    ],
)  # fmt: skip
def test_address_spellings_claim_one_instrument(same):
    assert len({wire_name(url) for url in same}) == 1


def test_different_addresses_are_different_instruments():
    urls = [
        "TCPIP::127.0.0.1::5025::SOCKET", "TCPIP::127.0.0.1::5026::SOCKET", "GPIB0::11::INSTR",
        "GPIB1::11::INSTR", "GPIB0::12::INSTR", "GPIB0::11::96::INSTR", "TCPIP::h::INSTR",
        "USB0::0x03EB::0x2065::A::INSTR", "USB0::0x03EB::0x2065::B::INSTR",
        "TCPIP::h::gpib0,11::INSTR", "prologix:/dev/ttyUSB7", "prologix:/dev/ttyUSB8",
    ]  # fmt: skip
    assert len({wire_name(url) for url in urls}) == len(urls)


def test_other_history_on_same_instrument_is_refused(tmp_path):
    url = URL.format(1)
    with BenchLock(tmp_path / "one.db", instrument=url):
        with pytest.raises(MeasurementError, match=rf"process {os.getpid()}.*one\.db.*measuring"):
            BenchLock(tmp_path / "two.db", instrument=url)
        assert not (tmp_path / "two.db-lock").exists()
        BenchLock(tmp_path / "two.db", instrument=URL.format(2)).release()
    BenchLock(tmp_path / "two.db", instrument=url).release()


def test_simulated_instruments_are_never_claimed(tmp_path):
    with (
        BenchLock(tmp_path / "one.db", instrument="sim:"),
        BenchLock(tmp_path / "two.db", instrument="sim:"),
        BenchLock(tmp_path / "three.db", instrument="replay:x"),
    ):
        pass


def test_watchdog_of_killed_session_holds_instrument(tmp_path):
    url = URL.format(3)
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(tmp_path / "one.db"), url],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    ) as session:  # fmt: skip
        child = int(session.stdout.readline())
        try:
            session.kill()
            session.wait()
            with pytest.raises(MeasurementError, match=r"watchdog of a session .*one\.db"):
                BenchLock(tmp_path / "two.db", patience_s=0.3, instrument=url)
        finally:
            os.kill(child, 9)
    BenchLock(tmp_path / "two.db", patience_s=5.0, instrument=url).release()


def test_claim_files_lie_in_private_folder(tmp_path):
    BenchLock(tmp_path / "one.db", instrument=URL.format(4)).release()
    folder = os.stat(f"/tmp/lashbench-{os.getuid()}")
    assert folder.st_uid == os.getuid()
    assert folder.st_mode & 0o077 == 0


def test_wrong_address_is_refused_without_lock(tmp_path):
    with pytest.raises(InputError, match="has the unknown scheme"):
        BenchLock(tmp_path / "one.db", instrument="gopher:x")
    assert list(tmp_path.iterdir()) == []
