"""The page about the instrument: its plain PyVISA script runs as printed, its URLs are read."""

import re
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np

from daq.transports.address import FORMS, parse_address
from sim.analyser35670a import Analyser35670A, LinearPlant
from sim.serve import Server

PAGE = (Path(__file__).parents[2] / "docs" / "instrument.md").read_text(encoding="utf-8")


def gain(hz: float) -> complex:
    return 0.5 / (1 + 1j * hz / 100.0)


def test_documented_script_measures_with_source_off_afterwards(tmp_path):
    (script,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    path = tmp_path / "response.py"
    path.write_text(script)
    instrument = Analyser35670A(LinearPlant(gain))
    with Server(instrument, realtime=False, tcp=0) as server:
        thread = threading.Thread(target=server.run)
        thread.start()
        try:
            host, port = server.addresses["tcp"].split(":")
            run = subprocess.run(
                [sys.executable, str(path), f"TCPIP::{host}::{port}::SOCKET"],
                capture_output=True,
                text=True,
                timeout=60,
            )
        finally:
            server.stop()
            thread.join()
    assert run.returncode == 0, run.stderr
    assert run.stderr.strip() == 'errors: +0,"No error"'
    hertz, decibels, degrees = np.array([line.split() for line in run.stdout.splitlines()], float).T
    assert len(hertz) == 401
    # The display repeats the nearest measured point, and 21 were measured in 80 Hz.
    worst = [np.min(np.abs(decibels[k] - _db(np.linspace(f - 4, f + 4, 81)))) for k, f in
             enumerate(hertz)]  # fmt: skip
    assert max(worst) < 0.02
    assert np.ptp(degrees) > 5.0
    assert instrument.output_vpk == 0.0


def _db(hertz: np.ndarray) -> np.ndarray:
    return 20 * np.log10(np.abs(0.5 / (1 + 1j * hertz / 100.0)))


def test_every_url_of_the_page_is_one():
    table = PAGE[PAGE.index("| URL |") : PAGE.index("**Adapters.**")]
    shown = re.findall(r"^\| `([^`]+)`", table, re.MULTILINE)
    assert set(shown) == set(FORMS)
    for url in shown:
        parse_address(url.replace("PORT", "5025"))
