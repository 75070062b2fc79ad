"""`lashbench convert`, and the options that say what a file does not say."""

import json
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from responses import measured, same

from daq.configs import sample_path
from daq.formats import read_response, write_response
from daq.frf import FrequencyResponse
from tui.cli import main

SUFFIXES = (".csv", ".h5", ".uff", ".mat")


@pytest.mark.parametrize(("one", "other"), list(permutations(SUFFIXES, 2)))
def test_a_response_goes_from_any_format_to_any_other(tmp_path, one, other):
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


def test_what_a_file_does_not_say_is_told(tmp_path, capsys):
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
    ],
)
def test_what_contradicts_a_file_or_means_nothing_is_refused(tmp_path, capsys, words, fault):
    out = tmp_path / "y.h5"
    assert main(["convert", str(sample_path("adss-sweep")), str(out), *words]) == 2
    assert fault in capsys.readouterr().err
    assert not out.exists()


def test_a_file_is_not_written_over_itself(tmp_path, capsys):
    path = tmp_path / "x.csv"
    write_response(measured(flags=None), path)
    before = path.read_bytes()
    assert main(["convert", str(path), f"{tmp_path}/./x.csv"]) == 2
    assert "is the file that is read" in capsys.readouterr().err
    assert path.read_bytes() == before


def test_rows_at_0_hz_of_any_format_are_left_out_and_said(tmp_path, capsys):
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
