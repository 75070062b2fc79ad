"""``--tolerance`` and ``[tolerance]``: what is believed of a datasheet is asked, used and told."""

import json

import pytest

from daq.configs import config_path
from tui.cli import main

FEATURES = ["estimate", "--arf-hz", "128", "--rf-hz", "137", "--unit"]


@pytest.fixture
def silent(tmp_path):
    """The file of a unit that says nothing of its tolerance."""
    path = tmp_path / "mine.toml"
    path.write_text(config_path("units", "adss").read_text().partition("[tolerance]")[0])
    return str(path)


def answer(words, capsys):
    assert main([*words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_every_answer_says_what_was_believed(silent, capsys):
    shipped = answer([*FEATURES, "adss"], capsys)
    assert shipped["tolerance"]["R_m"] == 0.005
    assert shipped["tolerance"]["J_m"] == 0.0
    assert shipped["tolerance_from"]["R_m"] == "unit file"
    usual = answer([*FEATURES, silent], capsys)
    assert usual["tolerance"]["R_m"] == usual["tolerance"]["J_m"] == 0.05
    assert usual["tolerance"]["N_1"] == 0.0
    assert set(usual["tolerance_from"].values()) == {"default"}
    told = answer([*FEATURES, "adss", "--tolerance", "5%", "--tolerance", "R_m=0.08"], capsys)
    assert told["tolerance"] == usual["tolerance"] | {"R_m": 0.08}
    assert told["tolerance_from"]["k_t"] == "option"
    # It is used: two frequencies of a unit that is hardly known tell less.
    stds = [one["contribution_ratio"]["std"] for one in (shipped, usual)]
    assert stds[0] < stds[1]
    assert main([*FEATURES, silent]) == 0
    assert "datasheet believed to 5 %: all values (by default" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--tolerance", "60%"], "outside 0 to 0.5"),
        (["--tolerance=-0.1"], "outside 0 to 0.5"),
        (["--tolerance", "k_s2=1%"], "use one of: default, L_a, R_m"),
        (["--tolerance", "b_t_deg=1%"], "total-backlash"),
        (["--tolerance", "R_m"], "'R_m' is not SHARE or NAME=SHARE"),
        (["--tolerance", "R_m=nan"], "is not SHARE or NAME=SHARE"),
        (["--tolerance", "R_m=1%", "--tolerance", "R_m=2%"], "twice for R_m"),
    ],
)
@pytest.mark.parametrize(
    "verb",
    [
        FEATURES[:-1],
        ["diagnose", "--paper"],
        ["report", "no.csv", "--out", "no.html"],
        ["prepare", "--level", "1", "--start", "100", "--stop", "120", "--points", "3"],
    ],
)
def test_what_is_no_tolerance_is_refused_by_every_verb_before_any_work(verb, words, said, capsys):
    assert main([*verb, "--unit", "adss", *words]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
