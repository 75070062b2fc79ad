"""`lashbench convert`, and the options that say what a file does not say."""

import json
import os
import pty
import shlex
import subprocess
import sys
from contextlib import suppress
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from foreign_files import DB, DEG, GAIN, HERTZ, rows
from worlds.responses import measured, same

from daq.configs import sample_path
from daq.formats import read_response, write_response
from daq.frf import FrequencyResponse
from tui.cli import main

SUFFIXES = (".csv", ".h5", ".uff", ".mat")


@pytest.mark.parametrize(
    ("one", "other"),
    [
        pytest.param(*pair, marks=[pytest.mark.long] * (".csv" not in pair))
        for pair in permutations(SUFFIXES, 2)
    ],
)
def test_response_converts_between_all_formats(tmp_path, one, other):
    response = measured(flags=None)
    given, made = tmp_path / f"x{one}", tmp_path / f"y{other}"
    write_response(response, given)
    assert main(["convert", str(given), str(made)]) == 0
    back = read_response(made)
    if ".csv" in (one, other):
        np.testing.assert_allclose(back.gain, response.gain, rtol=1e-12)
        assert dict(back.provenance) == dict(response.provenance)
    else:
        same(back, response)


def test_missing_value_is_requested_as_option(tmp_path, capsys):
    given, made = tmp_path / "x.h5", tmp_path / "y.csv"
    bare = FrequencyResponse.from_arrays([100.0, 120.0, 140.0], np.nan, 0.5j, unit="unknown")
    write_response(bare, given)
    assert main(["convert", str(given), str(made)]) == 2
    assert "give --level V" in capsys.readouterr().err
    words = ["--level", "1Vrms", "--unit-name", "ADSS", "--sweep", "down"]
    words += ["--settle-cycles", "20", "--integrate-cycles", "30"]
    assert main(["convert", str(given), str(tmp_path / "z.mat"), *words]) == 0
    back = read_response(tmp_path / "z.mat")
    np.testing.assert_allclose(back.source_vpk, np.sqrt(2.0))
    assert (back.unit, back.direction) == ("ADSS", "down")
    assert (back.settle_cycles, back.integrate_cycles) == (20, 30)
    assert main(["extract", str(given), "--level", "3Vpp", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["levels"][0]["source_vpk"] == 1.5


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (["--level", "2"], "states a source level of"),
        (["--sweep", "down"], "states direction up"),
        (["--settle-cycles", "7"], "states settle_cycles 20"),
        (["--level", "0"], "is no source level"),
        (["--level", "1V"], "is no source level"),
        (["--level", "1e9"], "can be believed"),
        (["--averages", "0"], "--averages 0"),
        (["--column", "gain_db"], "is not QUANTITY=COLUMN"),
        (["--function", "1"], "--function says nothing of"),
        (["--function", ""], "--function is empty"),
        (["--profile="], "--profile is empty"),
    ],
)
def test_contradicting_or_meaningless_option_is_refused(tmp_path, capsys, words, fault):
    out = tmp_path / "y.h5"
    assert main(["convert", str(sample_path("adss-sweep")), str(out), *words]) == 2
    assert fault in capsys.readouterr().err
    assert not out.exists()


def test_column_options_are_refused_for_own_format(tmp_path, capsys):
    given, out = str(sample_path("adss-sweep")), tmp_path / "y.h5"
    for words in (["--column", "gain_db=3"], ["--as-guessed"], ["--profile", "bode100"]):
        assert main(["convert", given, str(out), *words]) == 2
        assert "is a CSV of lashbench's own form" in capsys.readouterr().err


def test_own_table_from_spreadsheet_is_table(tmp_path, capsys):
    given, out = tmp_path / "x.csv", tmp_path / "y.csv"
    text = Path(sample_path("adss-sweep")).read_text()
    given.write_text(text.replace(".", "·").replace(",", ";").replace("·", ","))
    assert main(["convert", str(given), str(out)]) == 2
    assert "--as-guessed" in capsys.readouterr().err
    words = ["--as-guessed", "--unit-name", "ADSS", "--sweep", "up"]
    assert main(["convert", str(given), str(out), *words]) == 0
    back, true = read_response(out), read_response(sample_path("adss-sweep"))
    np.testing.assert_allclose(back.gain, true.gain, rtol=1e-12)
    np.testing.assert_array_equal(back.source_vpk, true.source_vpk)
    np.testing.assert_array_equal(back.gain_std_db, true.gain_std_db)


def test_a_file_is_not_written_over_itself(tmp_path, capsys):
    path = tmp_path / "x.csv"
    write_response(measured(flags=None), path)
    before = path.read_bytes()
    assert main(["convert", str(path), f"{tmp_path}/./x.csv"]) == 2
    assert "is the file that is read" in capsys.readouterr().err
    assert path.read_bytes() == before


def test_zero_frequency_rows_are_omitted_with_note(tmp_path, capsys):
    text = Path(sample_path("adss-sweep")).read_text()
    first = next(line for line in text.splitlines() if line[:1].isdigit())
    level = first.split(",")[1]
    path = tmp_path / "x.csv"
    path.write_text(text.replace(first, f"0,{level},-3,10,\n{first}", 1))
    assert main(["extract", str(path), "--json"]) == 0
    told = capsys.readouterr()
    assert "the row at 0 Hz of x.csv left out" in told.err
    assert main(["extract", str(sample_path("adss-sweep")), "--json"]) == 0
    assert capsys.readouterr().out == told.out


@pytest.fixture
def guessed(tmp_path):
    """A table whose header names no units."""
    path = tmp_path / "x.txt"
    path.write_text("freq Gain Phase\n" + rows(HERTZ, DB, DEG, mark=" "))
    return path


def test_missing_output_shows_the_reading_only(guessed, tmp_path, capsys):
    before = sorted(tmp_path.iterdir())
    assert main(["convert", str(guessed)]) == 0
    told = capsys.readouterr()
    assert "gain_db (guessed)" in told.out
    assert "source level not known: give --level" in told.out
    assert max(len(line) for line in told.out.replace(str(guessed), "x").splitlines()) <= 80
    pasted = told.err.split("if that is right: ")[1].splitlines()[0]
    out = tmp_path / "y.h5"
    assert main(shlex.split(pasted.replace("OUT", str(out)))[1:]) == 0
    np.testing.assert_allclose(read_response(out).gain, GAIN, rtol=1e-6)
    out.unlink()
    assert sorted(tmp_path.iterdir()) == before


def test_guess_is_written_only_after_confirmation(guessed, tmp_path, capsys):
    out = tmp_path / "y.h5"
    assert main(["convert", str(guessed), str(out)]) == 2
    assert "--as-guessed" in capsys.readouterr().err
    assert not out.exists()
    for answer, code in ((b"n\n", 2), (b"\n", 2), (b"y\n", 0)):
        assert typed(["convert", str(guessed), str(out)], answer) == code
        assert out.exists() == (code == 0)


def typed(words, answer: bytes) -> int:
    """The exit code of a command on a terminal, whose question is answered."""
    here, there = pty.openpty()
    command = [sys.executable, "-m", "tui.cli", *words]
    with subprocess.Popen(command, stdin=there, stdout=there, stderr=there) as child:
        os.close(there)
        said = b""
        while b"[y/N]" not in said:
            said += os.read(here, 4096)
        os.write(here, answer)
        with suppress(OSError):
            while os.read(here, 4096):
                pass
    os.close(here)
    return child.returncode


def test_layout_is_stored_as_own_profile(guessed, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    columns = ["--column", "frequency_hz=freq", "--column", "gain_db=2", "--column", "phase_deg=3"]
    words = ["convert", str(guessed), str(tmp_path / "y.h5"), *columns]
    assert main([*words, "--save-profile", "Not Good"]) == 2
    assert main([*words, "--save-profile", "mine"]) == 0
    assert main(["convert", str(guessed), str(tmp_path / "z.h5"), "--profile", "mine"]) == 0
    np.testing.assert_array_equal(
        read_response(tmp_path / "z.h5").gain, read_response(tmp_path / "y.h5").gain
    )
    assert main(["extract", str(guessed), "--profile", "mine", "--level", "2", "--json"]) == 0
    assert main(["convert", str(tmp_path / "y.h5"), "--save-profile", "mine"]) == 2
    capsys.readouterr()


def test_remark_on_original_is_given_once(guessed, tmp_path, capsys):
    out = tmp_path / "y.csv"
    words = ["--as-guessed", "--level", "1", "--unit-name", "ADSS"]
    assert main(["convert", str(guessed), str(out), *words]) == 0
    assert "read: column 1 'freq' as frequency_hz" in capsys.readouterr().err
    assert main(["extract", str(out)]) == 0
    assert "column 1" not in capsys.readouterr().err
