"""``--tolerance`` and ``[tolerance]``: what is believed of a datasheet is asked, used and told."""

import json

import pytest

from daq.configs import config_path
from daq.formats import write_response
from daq.plan import SweepPlan, spaced_frequencies
from sim.response import simulate
from sim.unit import load_unit
from tui.cli import main

PLAN = SweepPlan(spaced_frequencies(115.0, 160.0, 13), (2.5,), settle_cycles=6, integrate_cycles=8)


@pytest.fixture(scope="module")
def estimate(tmp_path_factory):
    """An estimate of a short sweep, as far as the unit."""
    path = tmp_path_factory.mktemp("sweep") / "sweep.csv"
    write_response(simulate(load_unit("adss"), 0.4, PLAN, seed=3), path)
    return ["estimate", str(path), "--unit"]


@pytest.fixture
def silent(tmp_path):
    """The file of a unit that says nothing of its tolerance."""
    path = tmp_path / "mine.toml"
    path.write_text(config_path("units", "adss").read_text().partition("[tolerance]")[0])
    return str(path)


def answer(words, capsys):
    assert main([*words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_every_answer_states_tolerance_used(estimate, silent, capsys):
    shipped = answer([*estimate, "adss"], capsys)
    assert shipped["tolerance"]["R_m"] == 0.005
    assert shipped["tolerance"]["J_m"] == 0.0
    assert shipped["tolerance_from"]["R_m"] == "unit file"
    usual = answer([*estimate, silent], capsys)
    assert (usual["tolerance"]["R_m"], usual["tolerance"]["J_m"]) == (0.08, 0.10)
    assert usual["tolerance"]["N_1"] == 0.0
    assert set(usual["tolerance_from"].values()) == {"default"}
    told = answer([*estimate, "adss", "--tolerance", "5%", "--tolerance", "R_m=0.08"], capsys)
    shares = dict.fromkeys(usual["tolerance"], 0.05) | dict.fromkeys(("N_1", "N"), 0.0)
    assert told["tolerance"] == shares | {"R_m": 0.08, "filter_numerator": 0.0}
    assert told["tolerance_from"]["k_t"] == "option"
    # It is used: a sweep of a unit that is hardly known tells less.
    stds = [one["contribution_ratio"]["std"] for one in (shipped, usual)]
    assert stds[0] < stds[1]
    assert main([*estimate, silent]) == 0
    out = capsys.readouterr().out
    assert "datasheet believed to 8 %: R_m, k_b, k_t (by default" in out
    assert "to 30 %: B_m, T_f_m, T_f_L (by default" in out


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
        ["estimate", "--arf-hz", "128", "--rf-hz", "137"],
        ["diagnose", "--paper"],
        ["report", "no.csv", "--out", "no.html"],
        ["prepare", "--level", "1", "--start", "100", "--stop", "120", "--points", "3"],
    ],
)
def test_invalid_tolerance_is_refused_by_every_verb(verb, words, said, capsys):
    assert main([*verb, "--unit", "adss", *words]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
