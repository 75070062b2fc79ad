"""Shell completion: the scripts are taken by the shells and complete verbs and options."""

import shutil
import subprocess

import pytest

from tui.cli import VERBS, main

bash = pytest.mark.skipif(not shutil.which("bash"), reason="there is no bash here")


@pytest.fixture
def script(tmp_path, capsys):
    assert main(["completion", "bash"]) == 0
    path = tmp_path / "lashbench"
    path.write_text(capsys.readouterr().out)
    return path


def completed(script, *words):
    """What bash would offer for the last word."""
    program = 'source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMP_POINT=999;'
    program += ' COMP_LINE="$*"; _lashbench; printf "%s\\n" "${COMPREPLY[@]}"'
    run = subprocess.run(
        ["bash", "--norc", "-c", program, "bash", script, *words],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert run.stderr == ""
    return {word.strip() for word in run.stdout.splitlines()}


@bash
def test_bash_completes_verbs_options_and_choices(script):
    assert set(VERBS) <= completed(script, "lashbench", "")
    assert completed(script, "lashbench", "dia") == {"diagnose"}
    assert "--instrument" in completed(script, "lashbench", "measure", "--in")
    assert completed(script, "lashbench", "measure", "--direction", "") >= {"up", "down"}


@pytest.mark.parametrize(("shell", "mark"), [("zsh", "#compdef lashbench"), ("fish", "complete")])
def test_other_shells_complete_every_verb(shell, mark, capsys):
    assert main(["completion", shell]) == 0
    text = capsys.readouterr().out
    assert mark in text
    assert all(verb in text for verb in VERBS)


def test_unknown_shell_is_a_usage_error(capsys):
    assert main(["completion", "tcsh"]) == 2
    assert "tcsh" in capsys.readouterr().err
