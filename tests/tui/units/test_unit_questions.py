"""new-unit --ask and --check: answers in catalogue units become a file; a file becomes words."""

import os
import pty
import select
import subprocess
import sys
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.configs import config_path
from daq.errors import InputError
from sim.unit import load_unit, unit_from_mapping
from tui import cli
from tui.unit_questions import ask_for_values


def template(stages):
    return config_path("templates", stages).read_text(encoding="utf-8")


def asked(answers, stages="two-stage"):
    """The text that answers lead to, then examples, and what was said."""
    said, lines = [], iter(answers)
    text = ask_for_values(template(stages), said.append, lambda: f"{next(lines, '-')}\n")
    return text, "".join(said)


def unit_of(text):
    import tomllib

    return unit_from_mapping(tomllib.loads(text), source="here")


@pytest.mark.parametrize("stages", ["one-stage", "two-stage", "three-stage"])
def test_examples_alone_give_the_template(stages):
    assert asked([], stages)[0] == template(stages)


def test_catalogue_values_are_converted_and_recorded():
    motor = ["0.85 mH", "4.1", "3.6 V/krpm", "4.87 oz-in/A", "86 gcm2", "-", "14 mNm"]
    chain = ["4.11", "9 V/krpm", "100 Hz", "0.7"]
    stage1 = ["72/12", "-", "0.3 kg.cm2", "0.02 Nm/arcmin", "-", "-"]
    text, said = asked([*motor, *chain, *stage1, "9", "-", "60 kg.cm^2", "-", "4 arcmin"])
    unit = unit_of(text)
    expected = {"L_a": 8.5e-4, "R_m": 4.1, "k_b": 0.0343775, "k_t": 0.0343898, "J_m": 8.6e-6,
                "T_f_m": 0.014, "k_a": 4.11, "k_ts": 0.0859437, "N_1": 6.0, "J_g1": 3e-5,
                "k_s1": 68.7549, "N": 9.0, "J_L": 6e-3, "b_t_deg": 4 / 60,
                "filter_numerator": 394784.176}  # fmt: skip
    example = unit_of(template("two-stage")).parameters
    for symbol, value in unit.parameters.items():
        assert value == pytest.approx(expected.get(symbol, example[symbol]), rel=1e-5), symbol
    assert unit.electronics.filter_denominator == pytest.approx((1.0, 879.646, 394784.176))
    assert "back-EMF constant; given as 3.6 V/krpm\n" in text
    assert "= 0.0343775 V.s/rad" in said
    assert len(text.splitlines()) == len(template("two-stage").splitlines())


def test_impossible_answer_is_asked_again():
    bad = ["", "much", "3,6", "-1", "0", "nan", "5 kg", "1e300"]
    text, said = asked([*bad, "0.85 mH"])
    assert unit_of(text).motor.L_a == 8.5e-4
    assert said.count("L_a: armature inductance") == len(bad) + 1
    assert "'5 kg' is no unit" not in said
    assert "'kg' is no unit of L_a; use one of: H, mH, uH" in said


def test_answers_are_cross_checked_and_revisable():
    text, said = asked(["-", "-", "0.046", "46", "<", "0.035", "35 mNm/A"])
    assert "if k_t is in mN.m/A, give 0.046" in said
    assert (unit_of(text).motor.k_b, unit_of(text).motor.k_t) == (0.035, 0.035)


def test_closed_input_writes_nothing():
    with pytest.raises(InputError, match="nothing was written"):
        ask_for_values(template("two-stage"), lambda text: None, lambda: "")


@settings(max_examples=20)
@given(st.lists(st.text(st.characters(exclude_characters="\n"), max_size=12), max_size=12))
def test_any_input_gives_a_valid_unit_file(answers):
    assert unit_of(asked(answers)[0]).stages == 2


def test_missing_terminal_asks_no_questions(tmp_path, capsys):
    out = tmp_path / "x.toml"
    command = [sys.executable, "-m", "tui.cli", "new-unit", "--ask", "--out", str(out)]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr == (
        "error: --ask needs a terminal; leave it out and edit the file that is written\n"
    )
    assert not out.exists()


def test_at_a_terminal(tmp_path):
    ours, theirs = pty.openpty()
    out, text = tmp_path / "my drive.toml", ""
    command = [sys.executable, "-m", "tui.cli", "new-unit", "--ask", "--out", str(out)]
    answers = iter(
        [b"4", b"1", b"perhaps", b"no", b"0.85 mH", b"\xb5", b"4.1"]
    )  # a micro sign that is no UTF-8
    with subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs) as program:
        os.close(theirs)
        until_s = time.monotonic() + 120.0
        seen = 0
        while time.monotonic() < until_s:
            if not select.select([ours], [], [], 1.0)[0]:
                continue
            try:
                text += os.read(ours, 4096).decode("utf-8", "replace")
            except OSError:  # it has ended
                break
            if text[seen:].rstrip().endswith(":"):
                seen = len(text)
                os.write(ours, next(answers, b"-") + b"\n")
        os.close(ours)
    assert program.returncode == 0, text
    unit = load_unit(str(out))
    assert (unit.name, unit.stages, unit.motor.L_a, unit.motor.R_m) == ("MY DRIVE", 1, 8.5e-4, 4.1)
    assert "neither 1, 2 nor 3" in text
    assert "'perhaps' is neither yes nor no" in text
    assert "new-unit --check" in text


@pytest.fixture
def check(capsys):
    def call(path):
        code = cli.main(["new-unit", "--check", str(path)])
        return code, *capsys.readouterr()

    return call


def test_file_is_described_from_motor_to_load(check):
    code, out, err = check(config_path("units", "adss"))
    assert (code, err) == (0, "")
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert [line.split()[0] for line in lines[1:6]] == ["motor", "stage", "shaft", "stage", "load"]
    for line in (
        "stage 1 5.94 : 1, mesh k_g1 3.4e+04 N.m/rad",
        "ratio from motor to load: 62.37",
        "load 7.069e-07 kg.m^2 7.1 %",
        "total backlash: 0.066 deg at the load, 4.116 deg at the motor",
        "ARF 149 Hz, RF 154.7 Hz",
        "no warnings",
    ):
        assert line in lines
    assert max(map(len, out.splitlines())) <= 80


def test_warnings_and_refusals_of_a_checked_file(check, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(template("one-stage").replace("b_t_deg = 0.12", "b_t_deg = 7.2"))
    code, out, _ = check(path)
    assert code == 0
    assert "warning: backlash.b_t_deg 7.2 deg" in out
    assert "stage 2" not in out
    path.write_text(template("one-stage").replace("k_t = 4.6e-2", "k_t = 46.0"))
    code, out, err = check(path)
    assert (code, out) == (2, "")
    assert "if k_t is in mN.m/A, give 0.046" in err


@pytest.mark.parametrize(
    ("words", "said"),
    [([], "give --out FILE"), (["--check", "a.toml", "--out", "b.toml"], "leave out the other")],
)
def test_conflicting_options_write_nothing(words, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["new-unit", *words]) == 2
    assert said in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
