"""The verb prepare: what is simulated ahead is what a measurement of that sweep is held against."""

import json
from contextlib import suppress

import pytest
from instruments.measuring import QUICK, SHORT, measuring

from analysis.estimate import estimate_response
from analysis.inference.checkpoint import posterior_name, read_checkpoint
from analysis.inference.nominal import nominal_of
from analysis.observation.observation import observe, unread
from analysis.observation.reading_noise import USUAL_NOISE_V
from analysis.precompute import prepare_sweep
from daq.configs import config_path
from daq.formats import read_response
from daq.plan import SweepPlan
from sim.engine.effort import counting
from sim.unit import load_unit
from tui.cli import main

ADSS = load_unit("adss")
TINY = unread(SweepPlan((130.0, 140.0), (2.5,), settle_cycles=1, integrate_cycles=2), USUAL_NOISE_V)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "lashbench"


def test_prepared_sweep_is_estimated_without_simulation(run, cache, tmp_path):
    words = ["--unit", "adss", *SHORT, *QUICK, "--offset", "0.5", "--json"]
    code, out, _ = run("prepare", *words, history=False)
    assert code == 0
    said = json.loads(out)
    assert (said["unit"], said["points"], said["kept_in"]) == ("ADSS", 5, str(cache))
    assert said["simulated_s"] > 0.0
    run(*measuring("--offset", "0.5"))
    file = tmp_path / "swept.csv"
    assert run("export", 1, "--out", file)[0] == 0
    kept = sorted(cache.iterdir())
    response = read_response(file)
    assert estimate_response(response, ADSS, cache=cache).simulated_s == 0.0
    nominal_of(ADSS, observe(response), cache)
    assert sorted(cache.iterdir()) == kept
    # A response says which sweep is meant, too, and nothing is left to be made of this one.
    code, out, _ = run("prepare", file, "--unit", "adss", history=False)
    assert (code, out) == (0, "ADSS: all of it was there already\n")


class Enough(Exception):
    """Nothing more is to be prepared."""


def prepared(folder, until=None):
    """Runs for the estimate alone: seconds simulated, and what was told; until so many are kept."""
    told = []

    def tell(share, text):
        told.append(share)
        if text == "for the diagnosis" or until and len(list(folder.iterdir())) >= until:
            raise Enough

    with counting() as effort, suppress(Enough):
        prepare_sweep(ADSS, TINY, folder, progress=tell)
    return effort.simulated_s, told


def test_interrupted_preparation_is_resumed(tmp_path):
    prepared(tmp_path, until=16)
    made = len(list(tmp_path.iterdir()))
    left, told = prepared(tmp_path)
    count = len(list(tmp_path.iterdir()))
    assert 16 <= made < count
    fresh, _ = prepared(tmp_path / "other")
    assert len(list((tmp_path / "other").iterdir())) == count
    assert left == pytest.approx(fresh * (count - made) / count, rel=0.2)
    assert told == sorted(told)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--unit", "adss", "--level", "2"], "--start, --stop, --points is missing"),
        (["--unit", "adss", *SHORT, "--machines", "10"], "--machines"),
        (["--unit", "adss", "--machines", "0"], "0 is too few"),
        (["--unit", "adss", *SHORT[:-2]], "--points is missing"),
        (["x.csv", "--unit", "adss", "--start", "2"], "not both"),
        (["x.csv", "--unit", "adss", "--level", "2", "--level", "3"], "give --level once"),
        (["--unit", "adss", *SHORT, "--function", "2"], "no file that an option could complete"),
        (["x.csv", "--unit", "adss"], "x.csv"),
        (["--unit", "nosuch", *SHORT], "nosuch"),
        (["--unit", "adss", "--recipe", "nosuch"], "nosuch"),
    ],
)
def test_invalid_sweep_is_refused_in_one_line(words, said, capsys, cache, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["prepare", *words]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert said in line
    assert not cache.exists()


def test_unwritable_cache_is_refused_before_simulation(capsys, cache):
    cache.parent.write_text("no folder")
    with counting() as effort:
        assert main(["prepare", "--unit", "adss", *SHORT]) == 2
    assert effort.simulated_s == 0.0
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert line.startswith(f"error: {cache}: cannot be written (")
    assert line.endswith("set XDG_CACHE_HOME to a folder that can")


ONE_STAGE = ["prepare", "--unit", str(config_path("templates", "one-stage")), "--level", "2",
             "--start", "130", "--stop", "150", "--points", "2", "--settle-cycles", "1",
             "--integrate-cycles", "2", "--json"]  # fmt: skip


def test_runs_lost_to_full_disk_are_reported(small_disk, monkeypatch, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(small_disk))
    assert main(ONE_STAGE) == 0
    out, err = capsys.readouterr()
    files = json.loads(out)["files"]
    kept = len(list((small_disk / "lashbench").glob("runs-*.npz")))
    assert 0 < kept == files["kept"] < files["needed"]
    lost = files["needed"] - kept
    folder = small_disk / "lashbench"
    assert f"warning: {lost} of {files['needed']} files could not be kept in {folder}" in err
    # No room for another: nothing is gained by a second run, which says so.
    assert main(ONE_STAGE) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"error: {folder}: nothing ")
    assert err.count("\n") == 1


def test_full_disk_is_refused_before_simulation(small_disk, monkeypatch, capsys):
    monkeypatch.setenv("XDG_CACHE_HOME", str(small_disk))
    (small_disk / "filler").write_bytes(bytes(60 << 10))
    assert main(ONE_STAGE) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert "nothing could be kept there (No space left on device), and nothing was" in err
    assert err.count("\n") == 1


def test_posterior_is_trained_for_every_sweep(run, cache):
    """Of one with fewer stages and effects; a second call finds it and trains no further."""
    pytest.importorskip("jax", reason="training needs the extra `train`")
    unit = config_path("templates", "one-stage")
    words = ["prepare", "--unit", str(unit), "--machines", "90", "--json"]
    code, out, err = run(*words, history=False)
    assert code == 0
    said = json.loads(out)
    made = read_checkpoint(cache / posterior_name(load_unit(str(unit))))
    assert said["machines"] == made.machines
    assert said["steps"] == made.steps > 0
    assert "machines simulated" in err
    code, again, _ = run(*words, history=False)
    assert code == 0
    assert json.loads(again)["steps"] == made.steps
