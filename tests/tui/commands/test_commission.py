"""``lashbench commission`` and ``plan``, from files to files."""

import json

import pytest

from daq.configs import config_path
from daq.formats import read_response, write_response
from sim.unit import load_unit
from tui import cli


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    """A drive that is 9 % off its datasheet in one value, swept at two levels."""
    path = tmp_path_factory.mktemp("sweep") / "good.csv"
    words = ["--unit", "adss", "--ratio", "0.3", "--level", "2", "--level", "4", "--start", "100"]
    words += ["--stop", "180", "--points", "17", "--settle-cycles", "6", "--integrate-cycles", "10"]
    words += ["--set", "J_L=0.0030", "--out", str(path)]
    assert cli.main(["simulate", *words]) == 0
    return path


def unit_file(folder):
    """An ADSS of which three values are not exact."""
    text = (load_unit_text()).split("[tolerance]")[0]
    path = folder / "mine.toml"
    path.write_text(text + "[tolerance]\ndefault = 0.0\nJ_L = 0.08\nT_f_m = 0.1\nk_a = 0.01\n")
    return path


def load_unit_text():
    from daq.configs import config_path

    return config_path("units", "adss").read_text()


def test_unit_file_from_commission_is_judged(tmp_path, sweep, capsys):
    own = tmp_path / "a7.toml"
    words = ["commission", str(sweep), "--unit", str(unit_file(tmp_path)), "--out", str(own)]
    assert cli.main([*words, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["parameters"]
    load = told["J_L"]
    assert abs(load["value"] / 0.0030 - 1.0) < 4.0 * load["std_share"]
    assert load["std_share"] < 0.03
    assert load["determined"]
    assert abs(told["contribution_ratio"]["value"] - 0.3) < 4.0 * told["contribution_ratio"]["std"]
    unit = load_unit(str(own))
    assert unit.parameters["J_L"] == pytest.approx(load["value"], rel=1e-4)
    assert unit.name == "A7"
    # It is not written twice.
    assert cli.main(words) == 2
    assert "is there already" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("tolerance", "points", "said"),
    [("0", 17, "all of its values are exact"), ("5%", 9, "needs 15 or more")],
)
def test_unidentifiable_drive_is_refused(tmp_path, sweep, capsys, tolerance, points, said):
    whole = read_response(sweep)
    kept = [hz in sorted(set(whole.frequency_hz))[:points] for hz in whole.frequency_hz]
    write_response(whole.take(kept), tmp_path / "few.csv")
    out = tmp_path / "x.toml"
    words = ["commission", str(tmp_path / "few.csv"), "--unit", "adss", "--as-is"]
    assert cli.main([*words, "--tolerance", tolerance, "--out", str(out)]) == 2
    assert said in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--minutes", "0"], "more than 0"),
        (["--minutes", "0.01"], "the shortest useful sweep"),
    ],
)
def test_unusable_time_is_refused(words, said, tmp_path, capsys):
    out = tmp_path / "r.toml"
    assert cli.main(["plan", "--unit", "adss", *words, "--out", str(out)]) == 2
    assert said in capsys.readouterr().err
    assert not out.exists()


def test_plan_stays_within_bench(tmp_path, capsys):
    bench = tmp_path / "bench.toml"
    text = config_path("benches", "default").read_text(encoding="utf-8")
    bench.write_text(text.replace("stop_hz = 2000.0", "stop_hz = 50.0"), encoding="utf-8")
    assert cli.main(["plan", "--unit", "adss", "--bench", str(bench)]) == 2
    error = capsys.readouterr().err
    assert "bench" in error
    assert "50 Hz" in error
