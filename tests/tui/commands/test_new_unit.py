"""The verb new-unit: a file that loads, says what each number is, and works without code."""

import json
import re
import tomllib

import pytest

from daq.configs import config_path
from daq.formats import read_response
from sim.unit import load_unit
from tui import cli

SWEEP = ["--level", "3", "--start", "30", "--stop", "150", "--points", "7"]
SWEEP += ["--settle-cycles", "3", "--integrate-cycles", "4"]


@pytest.mark.parametrize("stages", [1, 2])
def test_written_unit_explains_every_number(stages, tmp_path, capsys):
    path = tmp_path / "my drive.toml"
    words = ["new-unit", "--out", str(path), "--stages", str(stages), "--name", 'A "1" \\ ü']
    assert cli.main(words) == 0
    assert "every number in it is an example" in capsys.readouterr().err
    unit = load_unit(str(path))
    assert (unit.name, unit.stages) == ('A "1" \\ ü', stages)
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if " = " in line]
    numbers = [line for line in lines if re.match(r"#? ?\w+ = [\d\[]", line)]
    assert len(numbers) > 20
    for line in numbers:
        assert line.startswith("schema") or re.search(r"# .*\w{4}", line), line


@pytest.mark.parametrize("stages", [1, 2])
def test_proposed_limits_are_allowed_as_written(stages):
    name = {1: "one-stage", 2: "two-stage"}[stages]
    text = config_path("templates", name).read_text(encoding="utf-8")
    limits = tomllib.loads(re.sub(r"(?m)^# (b[12]_deg)", r"\1", text))["limits"]
    assert {f"b{i}_deg" for i in range(1, stages + 1)} <= set(limits)


@pytest.mark.parametrize(("stages", "ratio"), [(1, "1"), (2, "0.4")])
def test_own_drive_needs_no_code(stages, ratio, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["new-unit", "--out", "mine.toml", "--stages", str(stages)]) == 0
    text = (tmp_path / "mine.toml").read_text(encoding="utf-8")
    (tmp_path / "mine.toml").write_text(re.sub(r"J_L = \S+", "J_L = 4.2e-3", text))
    words = ["simulate", "--unit", "mine.toml", "--ratio", ratio, *SWEEP, "--out", "try.csv"]
    assert cli.main(words) == 0
    assert read_response("try.csv").unit == "MINE"
    words = ["measure", "--unit", "mine.toml", "--instrument", "sim:", *SWEEP, "--db", "b.db"]
    capsys.readouterr()
    assert cli.main([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["points"] == 7


def test_the_commands_in_the_file_run(tmp_path, monkeypatch):
    import shlex

    monkeypatch.chdir(tmp_path)
    for stages in ("1", "2", "3"):
        out = tmp_path / f"my {stages}.toml"
        assert cli.main(["new-unit", "--out", str(out), "--stages", stages]) == 0
        lines = [line.lstrip("# ") for line in out.read_text().splitlines()]
        commands = [shlex.split(line) for line in lines if line.startswith("lashbench ")]
        assert [words[1] for words in commands] == ["simulate", "extract"]
        for words in commands:
            assert cli.main(words[1:]) == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--out", "there.toml"], "is there already"),
        (["--out", "no/x.toml"], "no directory"),
        (["--out", "x.toml", "--stages", "4"], "stages"),
        (["--out", "x.toml", "--name", "a\nb"], "on one line"),
        (["--out", "x.toml", "--name", " "], "1 to 64"),
        (["--out", "x.toml", "--name", "n" * 65], "1 to 64"),
    ],
)
def test_refused_unit_changes_no_file(words, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.toml").write_text("mine")
    assert cli.main(["new-unit", *words]) == 2
    assert said in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["there.toml"]
    assert (tmp_path / "there.toml").read_text() == "mine"
