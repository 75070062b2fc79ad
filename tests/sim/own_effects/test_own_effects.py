"""Effects in a Python file beside a unit: trusted or refused, checked, and part of the identity."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.configs import posterior_folder
from daq.errors import ConfigurationError
from daq.formats import read_response
from sim.catalogue import BUILT_IN
from sim.own_effects.definitions import defined_effects
from sim.own_effects.sources import EffectSource
from sim.unit import load_unit

EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "own-effect"
MARK = "executed.txt"
SWEEP = ["--ratio", "0.3", "--level", "2.5", "--start", "110", "--stop", "150", "--points", "3",
         "--settle-cycles", "5", "--integrate-cycles", "5"]  # fmt: skip


@pytest.fixture
def unit(tmp_path):
    """A unit with the effect of the example, which says when it is executed."""
    text = (EXAMPLE / "tight_bearing.py").read_text(encoding="utf-8")
    mark = tmp_path / MARK
    (tmp_path / "tight_bearing.py").write_text(f"{text}\nopen({str(mark)!r}, 'a').close()\n")
    file = tmp_path / "unit.toml"
    file.write_text((EXAMPLE / "unit.toml").read_text(encoding="utf-8"))
    return file


def lashbench(*words, **environment):
    clean = {k: v for k, v in os.environ.items() if k != "LASHBENCH_TRUST_EFFECTS"}
    return subprocess.run(
        [sys.executable, "-m", "tui.cli", *map(str, words)],
        capture_output=True, text=True, env=clean | environment,
    )  # fmt: skip


def refused(*words, **environment):
    """The line of an error with exit code 2."""
    done = lashbench(*words, **environment)
    assert (done.returncode, done.stdout) == (2, ""), done.stderr
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("error: ")
    return line


@pytest.mark.parametrize(
    "words", [["simulate", *SWEEP, "--out", "x.csv"], ["prepare"]], ids=lambda w: w[0]
)
def test_untrusted_file_is_never_executed(unit, words):
    line = refused(*words, "--unit", unit)
    assert "tight_bearing.py would be executed as Python code" in line
    assert "--trust-effects" in line
    assert not (unit.parent / MARK).exists()


def test_trusted_effect_file_is_simulated(unit, tmp_path):
    plain, tight = tmp_path / "plain.csv", tmp_path / "tight.csv"
    words = ["simulate", "--unit", unit, *SWEEP, "--out"]
    assert lashbench(*words, plain, LASHBENCH_TRUST_EFFECTS="1").returncode == 0
    own = ["--effect", "gear1-coulomb-friction:T_f_g1=0.1", "--trust-effects"]
    assert lashbench(*words, tight, *own).returncode == 0
    difference = read_response(tight).gain_db - read_response(plain).gain_db
    assert abs(difference).max() > 1.0
    assert (unit.parent / MARK).exists()
    # It is an effect of that unit alone.
    line = refused("simulate", "--unit", "adss", *SWEEP, *own, "--out", tmp_path / "no.csv")
    assert "'gear1-coulomb-friction' is not in the catalogue" in line


def test_only_a_plain_yes_is_trust(unit, monkeypatch):
    monkeypatch.setenv("LASHBENCH_TRUST_EFFECTS", "yes")
    with pytest.raises(ConfigurationError, match="set LASHBENCH_TRUST_EFFECTS=1"):
        load_unit(str(unit))
    assert not (unit.parent / MARK).exists()


def test_file_others_can_write_is_not_executed(unit):
    (unit.parent / "tight_bearing.py").chmod(0o666)
    line = refused("new-unit", "--check", unit, "--trust-effects")
    assert "can be written by others" in line
    assert not (unit.parent / MARK).exists()


IDENTITY = """
import json, sys
from analysis.inference.checkpoint import posterior_name
from analysis.inference.prior import Prior
from sim.unit import load_unit
units = [load_unit(name) for name in sys.argv[1:]]
print(json.dumps([[posterior_name(u), list(Prior(u).effects)] for u in units]))
"""


def test_posterior_name_depends_on_effect_file_text(unit, tmp_path):
    """On their text, not on their name or place; other units keep theirs."""

    def of(*names):
        done = subprocess.run(
            [sys.executable, "-c", IDENTITY, *map(str, names)], text=True, check=True,
            capture_output=True, env=os.environ | {"LASHBENCH_TRUST_EFFECTS": "1"},
        )  # fmt: skip
        return json.loads(done.stdout)

    (own, effects), (adss, of_adss) = of(unit, "adss")
    assert effects == [*BUILT_IN, "gear1-coulomb-friction"]
    assert of_adss == list(BUILT_IN)
    assert (posterior_folder() / adss).exists()
    assert own != adss
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    text = (unit.parent / "tight_bearing.py").read_text()
    (moved / "other_name.py").write_text(text)
    (moved / "unit.toml").write_text(unit.read_text().replace("tight_bearing.py", "other_name.py"))
    assert of(moved / "unit.toml")[0][0] == own
    (unit.parent / "tight_bearing.py").write_text(text.replace("0.005", "0.004"))
    ((changed, _),) = of(unit)
    assert changed != own
    (unit.parent / "tight_bearing.py").write_text(text)


@pytest.mark.parametrize(
    "name", ["../tight_bearing.py", "/tight_bearing.py", "a/../../b.py", "effect.txt", "gone.py"]
)
def test_name_of_another_folder_is_refused(unit, name, monkeypatch):
    monkeypatch.setenv("LASHBENCH_TRUST_EFFECTS", "1")
    unit.write_text(unit.read_text().replace("tight_bearing.py", name))
    with pytest.raises(ConfigurationError, match=r"own_effects\.files") as refusal:
        load_unit(str(unit))
    assert "\n" not in str(refusal.value)


HEAD = """\
from sim.catalogue import Effect, EffectParameter
from sim.elements import Spring
def effect(identifier="own", size=lambda unit: (1.0, 2.0), site="plant", meaning="It does.",
           **change):
    size = EffectParameter("a", "1", size)
    return Effect(identifier, (size,), site, meaning, "a cause", "a check", **change)
cable = lambda drivetrain, unit, v: drivetrain.adding(cable=Spring({"th_L": 1.0}, v["a"]))
"""
WRONG = {
    "1 / 0": "line 9: ZeroDivisionError",
    "def": "line 9: is not Python",
    "raise SystemExit(0)": "line 9: SystemExit",
    "own = 3": "defines no effect",
    "own = effect('An effect', on_drivetrain=cable)": "lower-case letters",
    "own = effect(site='air', on_drivetrain=cable)": "'plant' or 'chain'",
    "own = effect(meaning='two\\nlines', on_drivetrain=cable)": "one line of text",
    "own = effect()": "exactly one function",
    "own = effect(on_drivetrain=cable, on_unit=lambda unit, v: unit)": "exactly one function",
    "own, other = effect(on_unit=cable), effect(on_unit=cable)": "defined twice",
}


@pytest.mark.parametrize("line", WRONG)
def test_incomplete_effect_is_refused_with_its_line(line):
    with pytest.raises(ConfigurationError, match=r"^/own/effect\.py") as refusal:
        defined_effects(EffectSource("/own/effect.py", f"{HEAD}\n{line}\n"))
    assert WRONG[line] in str(refusal.value)
    assert "\n" not in str(refusal.value)


@given(st.text(max_size=200))
@settings(max_examples=20)
def test_any_text_is_effect_or_one_line(text):
    with pytest.raises(ConfigurationError) as refusal:
        # Behind a name that does not exist, so that no text does anything.
        defined_effects(EffectSource("effect.py", f"no_such_name\n{text}"))
    assert "\n" not in str(refusal.value)


ON_TRIAL = {
    "own = effect(size=lambda unit: (2.0, 1.0), on_drivetrain=cable)": "range of a is 2 to 1",
    "own = effect(size=lambda unit: 3.0, on_drivetrain=cable)": "range of a is nan to nan",
    "own = effect('load-inertia', on_drivetrain=cable)": "one of the catalogue",
    "own = effect(on_unit=lambda unit, v: unit)": "changes nothing of the drive",
    "own = effect(on_unit=lambda unit, v: None)": "must return a Unit",
    "own = effect(on_drivetrain=lambda drivetrain, unit, v: v['b'])": "line 9: effect 'own-5'",
    "own = effect(on_drivetrain=lambda drivetrain, unit, v: drivetrain.adding("
    "cable=Spring({'th_q': 1.0}, 1.0)))": "makes no drive that can be simulated",
}


TRIAL = """
import sys
from daq.errors import LashbenchError
from sim.own_effects.trial import try_own_effects
from sim.unit import load_unit
for name in sys.argv[1:]:
    try:
        try_own_effects(load_unit(name))
        print("nothing wrong")
    except LashbenchError as error:
        print(error)
"""


def test_unsimulatable_effect_is_refused_before_simulation(tmp_path):
    units = []
    for number, line in enumerate(ON_TRIAL):
        folder = tmp_path / str(number)
        folder.mkdir()
        named = line.replace("effect(o", f"effect('own-{number}', o")
        named = named.replace("effect(s", f"effect('own-{number}', s")
        (folder / "tight_bearing.py").write_text(f"{HEAD}\n{named}\n")
        units.append(folder / "unit.toml")
        units[-1].write_text((EXAMPLE / "unit.toml").read_text(encoding="utf-8"))
    # What clashes with the catalogue spoils it for all that follow.
    units.sort(key=lambda file: "load-inertia" in (file.parent / "tight_bearing.py").read_text())
    done = subprocess.run(
        [sys.executable, "-c", TRIAL, *map(str, units)], text=True, capture_output=True, check=True,
        env=os.environ | {"LASHBENCH_TRUST_EFFECTS": "1"},
    )  # fmt: skip
    said = dict(zip(units, done.stdout.splitlines(), strict=True))
    for number, wanted in enumerate(ON_TRIAL.values()):
        assert wanted in said[tmp_path / str(number) / "unit.toml"]


def test_stored_unit_states_that_effects_are_missing(unit):
    from analysis.inference.prior import Prior
    from daq.untrusted.bounded_text import parse_toml
    from sim.unit import unit_from_mapping

    stored = unit_from_mapping(parse_toml(unit.read_text()), "unit of measurement 1")
    with pytest.raises(ConfigurationError, match="not kept with a measurement"):
        Prior(stored).effects  # noqa: B018
