"""Servos that a signal drives: against the linear response, and an independent plant."""

import json
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2]))
from oracle import drive_plant

from daq.configs import config_path
from daq.excitation.plan import ExcitedPlan
from daq.excitation.signal import chirp, excitation_of, multisine, noise
from daq.formats import read_response
from daq.plan import SweepPlan
from daq.time_records.record import TimeRecord
from sim.effects import drivetrain_with
from sim.engine.linear import smooth_response
from sim.response import simulate
from sim.unit import load_unit
from tui.cli import main

GRID = np.arange(60.0, 160.0, 5.0)
SIGNALS = {
    "multisine": (multisine(GRID, 0.4, "schroeder"), 8, 3),
    "chirp": (chirp(60.0, 160.0, 0.4), 8, 3),
    "noise": (noise(40.0, 200.0, 0.8), 1, 30),
}


@pytest.mark.parametrize("name", SIGNALS)
def test_linear_servo_shows_its_linear_response(name):
    signal, settle, averages = SIGNALS[name]
    unit = load_unit("adss").with_parameters(b_t_deg=1e-9, T_f_m=1e-12, T_f_L=1e-12, R_m=6.0)
    plan = ExcitedPlan(
        tuple(GRID), (2.0,), settle_cycles=settle, integrate_cycles=averages, excitation=signal
    )
    exact = smooth_response(drivetrain_with(unit, 0.3, ()).system(), 2j * np.pi * GRID)
    off = np.abs(simulate(unit, 0.3, plan).gain / exact - 1.0)
    # Leakage of the segments of noise stays.
    assert np.median(off) < (0.01 if name == "noise" else 2e-3)


def record_of(levels, periods=8, period_s=0.4, seed=0):
    """Records of a random-phase multisine, as the independent plant and a bench show it."""
    document = tomllib.loads(config_path("units", "adss").read_text(encoding="utf-8"))
    signal = multisine(GRID, period_s, "random", seed)
    rng, steps = np.random.default_rng(seed), round(period_s / 4e-6)
    turns = np.outer(np.arange(2 * steps) / (2 * steps) * period_s, signal.frequencies_hz)
    one = np.imag(np.exp(2j * np.pi * turns) @ signal.phasors())
    for level in levels:
        volts = level * np.append(np.tile(one, periods), one[0])
        output = drive_plant.by_signal(document, 0.3, volts, 4e-6, 25)
        yield TimeRecord(10_000.0, volts[50::50], output + 2e-4 * rng.normal(size=output.size))


def test_estimate_finds_independent_plants_ratio(tmp_path, capsys):
    files, off = [], {"signal": [], "sine": []}
    unit = load_unit("adss")
    for number, record in enumerate(record_of((1.5, 3.0))):
        files.append(tmp_path / f"{number}.csv")
        np.savetxt(
            tmp_path / "r.txt", np.column_stack([record.input_v, record.output_v]),
            delimiter=",", header="in,out", comments="",
        )  # fmt: skip
        asked = ["frf", str(tmp_path / "r.txt"), "--input", "in", "--output", "out"]
        asked += ["--rate", "10000", "--out", str(files[-1]), "--unit-name", "ADSS"]
        assert main(asked) == 0
        response = read_response(files[-1])
        assert len(response) == len(GRID)
        given = tuple(response.frequency_hz), tuple(response.levels_vpk)
        signal = excitation_of(response.provenance)
        plans = {
            "signal": ExcitedPlan(*given, settle_cycles=2, integrate_cycles=8, excitation=signal),
            "sine": SweepPlan(*given),
        }
        for name, plan in plans.items():
            off[name].append(np.abs(response.gain / simulate(unit, 0.3, plan).gain - 1.0))
    # A servo with play answers a sine of the same rms otherwise.
    assert 2.0 * np.median(off["signal"]) < np.median(off["sine"])
    capsys.readouterr()
    assert main(["estimate", *map(str, files), "--unit", "adss", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert not found["refuted"]
    ratio = found["contribution_ratio"]
    assert ratio["std"] < 0.12
    assert ratio["interval95"][0] < 0.3 < ratio["interval95"][1]
