"""A cache folder that others may write: said once, and nothing is prepared there."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tui import cli

LASHBENCH = str(Path(sys.executable).with_name("lashbench"))
SWEEP = ["--unit", "adss", "--level", "2", "--start", "130", "--stop", "150", "--points", "2",
         "--settle-cycles", "1", "--integrate-cycles", "2"]  # fmt: skip


@pytest.fixture
def shared(tmp_path):
    folder = tmp_path / "lashbench"
    folder.mkdir()
    folder.chmod(0o777)
    return folder


def test_shared_cache_is_reported_once(tmp_path, shared):
    done = subprocess.run(
        [LASHBENCH, "simulate", *SWEEP, "--ratio", "0.3", "--out", str(tmp_path / "x.csv")],
        env=os.environ | {"XDG_CACHE_HOME": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0
    assert done.stderr.count(f"note: {shared} can be written by others; what is kept there") == 1
    assert [path for path in shared.rglob("*") if path.is_file()] == []


def test_shared_cache_refuses_preparation(tmp_path, shared, monkeypatch, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cli.main(["prepare", *SWEEP]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert line.startswith(f"error: {shared} can be written by others, so that nothing kept in")
    assert line.endswith("set XDG_CACHE_HOME to a folder of yours alone")


def test_the_doctor_finds_a_shared_cache(tmp_path, shared, monkeypatch):
    from tui.checkup.surroundings import check_folders

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    (finding,) = [one for one in check_folders() if one.name == "cache"]
    assert finding.state == "note"
    assert "can be written by others: a diagnosis simulates everything anew" in finding.found
