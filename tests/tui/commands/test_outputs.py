"""What a verb writes: never over what it reads, and no folder that stays empty."""

import os
import signal
import subprocess
import sys
import time

import pytest
from worlds.responses import measured

from daq.configs import config_path
from daq.formats import write_response
from tui.cli import main

SWEEP = ["--level", "1.5", "--start", "130", "--stop", "150", "--points", "3"]


def a_record(path):
    from numpy import arange, column_stack, pi, savetxt, sin

    t = arange(4000) / 1000.0
    x = sin(2 * pi * 40.0 * t)
    savetxt(path, column_stack([x, 0.5 * x]), delimiter=",", header="a,b", comments="")
    return ["frf", str(path), "--input", "a", "--output", "b", "--rate", "1000", "--out"]


def a_response(path):
    write_response(measured(flags=None), path)
    return path


def a_history(path):
    words = ["measure", "--unit", "adss", "--instrument", "sim:", *SWEEP, "--settle-cycles", "2"]
    assert main([*words, "--integrate-cycles", "3", "--db", str(path)]) == 0
    return path


def a_unit(path):
    path.write_text(config_path("units", "adss").read_text())
    return path


def a_line(db):
    return ["line", "--recipe", "adss", "--instrument", "sim:", "--db", str(db)]


def empty(path):
    path.touch()
    return path


# Name of the file that is read, and the words that would write over it.
VERBS = {
    "index": ("bench.html", lambda path: ["index", "--db", str(a_history(path)), "--out",
                                          str(path)]),
    "line into its history": ("bench.db", lambda path: [*a_line(a_history(path)), "--out",
                                                        str(path)]),
    "a line's table into its history": (
        "bench.db", lambda path: [*a_line(a_history(path)), "--csv", str(path)],
    ),
    "a line's table into its results": (
        "results.jsonl",
        lambda path: [*a_line(path.with_name("bench.db")), "--out", str(empty(path)), "--csv",
                      str(path)],
    ),
    "a line's table into its unit": (
        "unit.toml",
        lambda path: [*a_line(path.with_name("bench.db")), "--unit", str(a_unit(path)), "--csv",
                      str(path)],
    ),
    "frf": ("record.csv", lambda path: [*a_record(path), str(path)]),
    "convert": ("r.csv", lambda path: ["convert", str(a_response(path)), str(path)]),
    "simulate": (
        "unit.csv",
        lambda path: ["simulate", "--unit", str(a_unit(path)), "--ratio", "0.3", *SWEEP, "--out",
                      str(path)],
    ),
    "export": ("bench.h5", lambda path: ["export", "1", "--db", str(a_history(path)), "--out",
                                         str(path)]),
    "report": (
        "bench.html",
        lambda path: ["report", "1", "--unit", "adss", "--db", str(a_history(path)), "--out",
                      str(path)],
    ),
}  # fmt: skip


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("way", ["itself", "a link", "a hard link"])
def test_no_verb_overwrites_its_input(verb, way, tmp_path, capsys):
    name, prepare = VERBS[verb]
    path = tmp_path / name
    words = prepare(path)
    before = path.read_bytes()
    if way != "itself":
        other = tmp_path / f"other{path.suffix}"
        (os.symlink if way == "a link" else os.link)(path, other)
        words[-1] = str(other)
    assert main(words) == 2
    assert "is the file that is read" in capsys.readouterr().err
    assert path.read_bytes() == before


def test_interrupted_diagnosis_leaves_no_empty_folder(tmp_path):
    response = a_response(tmp_path / "r.csv")
    plots = tmp_path / "some" / "plots"
    words = ["diagnose", str(response), "--unit", "adss", "--as-is", "--plots", str(plots)]
    with subprocess.Popen(
        [sys.executable, "-m", "tui.cli", *words], stderr=subprocess.PIPE, stdout=subprocess.PIPE
    ) as program:
        until_s = time.monotonic() + 60.0
        while not plots.exists() and time.monotonic() < until_s:
            time.sleep(0.01)
        assert plots.exists()
        program.send_signal(signal.SIGINT)
        program.communicate(timeout=60.0)
    assert program.returncode == 130
    assert not (tmp_path / "some").exists()


def test_foreign_folder_is_kept(tmp_path):
    plots = tmp_path / "mine"
    plots.mkdir()
    response = a_response(tmp_path / "r.csv")
    words = ["diagnose", str(response), "--unit", str(config_path("templates", "one-stage"))]
    # Five frequencies are too few to diagnose by.
    assert main([*words, "--as-is", "--plots", str(plots)]) == 1
    assert main([*words, "--as-is", "--plots", str(plots / "new")]) == 1
    assert {one.name for one in tmp_path.rglob("*")} == {"mine", "r.csv"}


def test_response_without_features_is_reported(tmp_path, capsys):
    path = tmp_path / "one.csv"
    path.write_text(
        '# unit = "X"\nfrequency_hz,source_vpk,gain_db,phase_deg,gain_std_db\n100,2.5,-10,,0.1\n'
    )
    assert main(["extract", str(path)]) == 0
    assert "neither ARF nor RF was found" in capsys.readouterr().err
