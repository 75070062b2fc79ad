"""A name that no file system takes is one line and exit code 2, wherever it is given."""

from pathlib import Path

import pytest

from tui import cli

LONG = "x" * 300
SWEEP = str(Path(__file__).parents[1] / "data" / "practice" / "practice-01.csv")
MEASURE = ["measure", "--unit", "adss", "--level", "1", "--start", "130", "--stop", "150",
           "--points", "3", "--yes"]  # fmt: skip
SIMULATE = ["simulate", "--unit", "adss", "--ratio", "0.3", "--level", "2", "--start", "130",
            "--stop", "150", "--points", "2"]  # fmt: skip
LINES = [
    *(["extract", f"{LONG}{suffix}"] for suffix in (".csv", ".h5", ".mat", ".uff", ".dat")),
    ["estimate", f"{LONG}.csv", "--unit", "adss"],
    ["estimate", SWEEP, "--unit", f"{LONG}.toml"],
    ["diagnose", f"{LONG}.csv", "--unit", "adss"],
    ["diagnose", SWEEP, "--unit", "adss", "--plots", LONG],
    [*SIMULATE, "--out", f"{LONG}.csv"],
    [*MEASURE, "--instrument", "sim:", "--db", f"{LONG}.db"],
    [*MEASURE, "--instrument", "sim:", "--db", f"{'y' * 252}.db"],
    [*MEASURE, "--instrument", "sim:", "--db", "m.db", "--transcript", f"{LONG}.jsonl"],
    [*MEASURE, "--instrument", "sim:", "--db", "m.db", "--recipe", f"{LONG}.toml"],
    [*MEASURE, "--instrument", "sim:", "--db", "m.db", "--bench", f"{LONG}.toml"],
    [*MEASURE, "--instrument", f"replay:{LONG}.jsonl", "--db", "m.db"],
    ["history", "--db", f"{LONG}.db"],
    ["export", "1", "--db", f"{LONG}.db", "--out", "x.csv"],
    ["report", f"{LONG}.csv", "--unit", "adss", "--out", "x.html"],
    ["report", SWEEP, "--unit", "adss", "--out", f"{LONG}.html"],
    ["report", "1", "--unit", "adss", "--db", f"{LONG}.db", "--out", "x.html"],
    ["prepare", f"{LONG}.csv", "--unit", "adss"],
    ["new-unit", f"{LONG}.toml"],
    ["replay", LONG],
    ["demo", "--out", LONG],
    ["reproduce", "--plots", LONG],
    ["serve", "--unit", f"{LONG}.toml", "--ratio", "0.3", "--tcp", "0"],
]


@pytest.mark.parametrize("words", LINES, ids=lambda words: " ".join(words)[:20])
def test_too_long_name_is_one_line(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(words) == 2
    out, err = capsys.readouterr()
    told = [line for line in err.splitlines() if line.startswith("error: ")]
    assert len(told) == 1
    assert "internal error" not in err
    assert "Traceback" not in err
    assert out == ""


@pytest.mark.parametrize("variable", ["XDG_DATA_HOME", "XDG_CACHE_HOME", "XDG_STATE_HOME"])
def test_too_long_folder_is_no_internal_error(variable, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv(variable, f"/tmp/{LONG}")
    monkeypatch.chdir(tmp_path)
    for words in (["history", "--log-level", "info"], ["prepare", *SIMULATE[1:3], *SIMULATE[5:]]):
        if variable == "XDG_CACHE_HOME" or words[0] == "history":
            cli.main(words)
    assert "internal error" not in capsys.readouterr().err
