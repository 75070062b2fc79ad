"""Every verb with ``--unit`` tells once what is unusual in it, and refuses what cannot be."""

import inspect
import re
from importlib import import_module

import pytest

from daq.configs import config_path
from tui import cli
from tui.cli import VERBS

UNUSUAL = "b_t_deg 7.2 deg"
SWEEP = ["--level", "1", "--start", "600", "--stop", "700", "--points", "3"]
# Each ends early: with a file that is not there, a limit, or an address that is none.
WORDS = {
    "simulate": [*SWEEP, "--ratio", "2", "--out", "x.csv"],
    "estimate": ["none.csv"],
    "diagnose": ["none.csv"],
    "report": ["none.csv", "--out", "x.html"],
    "commission": ["none.csv", "--out", "x.toml"],
    "plan": ["--cluster", "nowhere"],
    "prepare": ["none.csv"],
    "measure": [*SWEEP, "--instrument", "sim:", "--db", "x.db"],
    "serve": ["--ratio", "2", "--tcp", "0"],
    "first-day": ["--instrument", "TCPIP::127.0.0.1::1::SOCKET", "--out", "day"],
}
ELSEWHERE = {"history", "line", "plot"}
"""The name alone, a dialogue that does not end early, and a picture."""


@pytest.fixture
def unit_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = config_path("templates", "two-stage").read_text(encoding="utf-8")

    def write(symbol, value):
        changed, found = re.subn(rf"(?m)^{symbol} = \S+", f"{symbol} = {value}", text)
        assert found == 1
        (tmp_path / "mine.toml").write_text(changed, encoding="utf-8")

    return write


def test_every_verb_with_unit_is_covered():
    taking = set()
    for verb, (target, _) in VERBS.items():
        module, name = target.split(":")
        if "unit" in inspect.signature(getattr(import_module(module), name)).parameters:
            taking.add(verb)
    assert taking == set(WORDS) | ELSEWHERE


@pytest.mark.parametrize("verb", WORDS)
def test_unusual_value_is_reported_once(verb, unit_file, capsys):
    unit_file("b_t_deg", 7.2)
    assert cli.main([verb, *WORDS[verb], "--unit", "mine.toml"]) != 0
    out, err = capsys.readouterr()
    assert err.count(UNUSUAL) == 1
    assert "warning: unit NAME: backlash.b_t_deg" in err
    assert out == ""


@pytest.mark.parametrize("verb", ["simulate", "measure"])
def test_impossible_value_is_refused(verb, unit_file, tmp_path, capsys):
    unit_file("k_t", 46.0)
    assert cli.main([verb, *WORDS[verb], "--unit", "mine.toml"]) == 2
    assert "mine.toml: values that cannot be: motor.k_b 0.046 V.s/rad" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]


def test_value_set_by_option_is_checked_too(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = ["simulate", "--unit", "adss", "--set", "J_m=86", *WORDS["simulate"]]
    assert cli.main(words) == 2
    assert "if J_m is in g.cm^2, give 8.6e-06" in capsys.readouterr().err
