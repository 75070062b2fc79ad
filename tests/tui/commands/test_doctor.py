"""The doctor: every check with its failing case made to happen, and the remedy it then names."""

import importlib.util
import json
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
from importlib import metadata
from types import SimpleNamespace

import llvmlite.binding
import pytest

from tui.checkup import instruments, software, surroundings
from tui.checkup.finding import Finding, examine, passed
from tui.checkup.self_test import check_itself
from tui.cli import main


def only(findings):
    (finding,) = findings
    return finding


def named(findings):
    return {finding.name: finding for finding in findings}


@pytest.fixture
def spoilt(monkeypatch, tmp_path):
    """Have a file stand where the user's files of a kind should lie."""
    (tmp_path / "file").write_text("")

    def spoil(kind):
        monkeypatch.setenv(f"XDG_{kind}_HOME", str(tmp_path / "file"))

    return spoil


def test_exit_code_separates_failure_from_note(spoilt, capsys):
    spoilt("STATE")
    assert main(["doctor"]) == 0
    out = capsys.readouterr().out
    assert re.search(r"^note  log: .+\n      -> .*XDG_STATE_HOME", out, re.MULTILINE)
    assert re.search(r"^ok    Python: ", out, re.MULTILINE)
    assert out.endswith("\n\nall that is needed is there\n")
    spoilt("DATA")
    assert main(["doctor"]) == 1
    out = capsys.readouterr().out
    assert re.search(r"^FAIL  history: .+\n      -> .*XDG_DATA_HOME", out, re.MULTILINE)
    assert out.endswith("\n1 to mend\n")


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash, which tells each exit code")
@pytest.mark.parametrize(
    ("words", "reader"),
    [
        ("", "head -n 1"),
        pytest.param("", "true", marks=pytest.mark.long),
        ("--json", "true"),
    ],
)
def test_closed_pipe_does_not_hide_failure(tmp_path, words, reader):
    """Through a real pipe: who is gone before the first line, and who leaves after it."""
    (tmp_path / "file").write_text("")
    lashbench = f"{shlex.quote(sys.executable)} -m tui.cli"
    said = subprocess.run(
        ["bash", "-c", f"{lashbench} doctor {words} | {reader} > read; echo ${{PIPESTATUS[0]}}"],
        env=os.environ | {"XDG_DATA_HOME": str(tmp_path / "file")},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120.0,
    )
    # No history can be made in a file. The interpreter does not complain of the pipe, either.
    assert (said.stdout, said.stderr) == ("1\n", "")
    assert len((tmp_path / "read").read_text().splitlines()) == (reader != "true")


def test_json_is_one_document_with_every_remedy(spoilt, capsys):
    spoilt("DATA")
    assert main(["doctor", "--json"]) == 1
    out, err = capsys.readouterr()
    assert err == ""
    document = json.loads(out)
    assert (document["ok"], document["failed"]) == (False, 1)
    for check in document["checks"]:
        assert set(check) == {"name", "state", "found", "remedy"}
        assert bool(check["remedy"]) == (check["state"] != "ok"), check
    assert [c["name"] for c in document["checks"] if c["state"] == "failed"] == ["history"]


def test_install_commands_quote_spaces_in_path(
    monkeypatch,
):
    python = "/home/a b/.venv/bin/python"
    monkeypatch.setattr(sys, "executable", python)
    monkeypatch.setattr(metadata, "requires", lambda _: ["no-such-package>=1"])
    (finding,) = software.check_packages()
    words = [python, "-m", "pip", "install", "no-such-package>=1"]
    assert shlex.split(finding.remedy) == words
    # Where it lies in none, nothing is quoted but what has to be.
    monkeypatch.setattr(sys, "executable", "/usr/bin/python3")
    (finding,) = software.check_packages()
    assert finding.remedy == "/usr/bin/python3 -m pip install 'no-such-package>=1'"


def test_this_installation_is_well(capsys):
    assert main(["doctor", "--json"]) == 0, capsys.readouterr()
    checks = {line["name"]: line for line in json.loads(capsys.readouterr().out)["checks"]}
    assert checks["self-test"]["state"] == "ok"
    assert f"numpy {metadata.version('numpy')}" in checks["packages"]["found"]
    assert {"Python", "compiled engine", "terminal", "history", "VISA on a LAN"} <= set(checks)


def test_bad_finding_must_state_its_remedy():
    for state in ("note", "failed"):
        with pytest.raises(ValueError, match="what to do"):
            Finding("x", state, "is wrong")


def test_failing_check_does_not_end_others():
    def breaks():
        yield passed("first half", "fine")
        raise RuntimeError("the bus\nis on fire")

    found = list(examine((("bus", breaks), ("next", lambda: [passed("next", "fine")]))))
    assert [(one.name, one.state) for one in found] == [
        ("first half", "ok"),
        ("bus", "failed"),
        ("next", "ok"),
    ]
    assert "RuntimeError: the bus is on fire" in found[1].found
    assert "--debug doctor" in found[1].remedy


def test_old_python_is_a_failure(monkeypatch):
    assert only(software.check_python()).state == "ok"
    monkeypatch.setattr(platform, "python_version", lambda: "3.9.18")
    finding = only(software.check_python())
    assert finding.state == "failed"
    assert "3.9.18" in finding.found
    assert finding.remedy.startswith("install Python >=3.11")


def test_missing_old_or_broken_packages_are_reported(monkeypatch, tmp_path):
    (tmp_path / "broken_here.py").write_text("raise OSError('libfoo.so: cannot open')")
    monkeypatch.syspath_prepend(tmp_path)
    lines = ["numpy<2.5,>=99", "no-such-package>=1", "broken_here>=1", "pytest", 'x>=1; extra=="y"']
    monkeypatch.setattr(metadata, "requires", lambda _: lines)
    version = metadata.version
    monkeypatch.setattr(
        metadata, "version", lambda name: "1.2" if name == "broken_here" else version(name)
    )
    found = named(software.check_packages())
    assert set(found) == {"package numpy", "package no-such-package", "package broken_here"}
    assert all(finding.state == "failed" for finding in found.values())
    assert found["package no-such-package"].found == "is not installed"
    assert found["package no-such-package"].remedy.endswith("-m pip install 'no-such-package>=1'")
    assert ">=99 is needed" in found["package numpy"].found
    assert "libfoo.so" in found["package broken_here"].found


@pytest.mark.parametrize(
    ("version", "specifiers", "good"),
    [
        ("2.4.6", ">=2.0,<2.5", True),
        ("2.5", "<2.5,>=2.0", False),
        ("2.5.0", ">=2.5", True),
        ("2.10", ">=2.9", True),
        ("2", ">=2.0.0", True),
        ("2.0rc1", ">=2", True),
        ("3.5", "", True),
        ("3.5", "!=3.5", True),
    ],
)
def test_versions_are_numbers_not_text(version, specifiers, good):
    assert software.satisfies(version, specifiers) is good


class NowhereToCache:
    """An importer under which a compiled module finds no place for its code."""

    name = "analysis.emulation.kernels"

    def find_spec(self, name, path=None, target=None):
        if name == self.name:
            raise RuntimeError("cannot cache function 'agree':\n no locator available")


def test_engine_not_compiled_or_missing_is_reported(monkeypatch, tmp_path):
    from numba import config

    with monkeypatch.context() as patch:
        patch.setattr(config, "DISABLE_JIT", 1)
        assert only(software.check_engine()).remedy == "unset NUMBA_DISABLE_JIT"
    with monkeypatch.context() as patch:
        (tmp_path / "file").write_text("")
        patch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
        finding = only(software.check_engine())
        assert finding.state == "note"
        assert "XDG_CACHE_HOME" in finding.remedy
    with monkeypatch.context() as patch:
        patch.setattr(llvmlite.binding, "get_host_cpu_features", dict)
        finding = only(software.check_engine())
        assert finding.state == "note"
        assert "slow" in finding.found
    with monkeypatch.context() as patch:
        patch.setattr(sys, "meta_path", [NowhereToCache(), *sys.meta_path])
        patch.delitem(sys.modules, NowhereToCache.name, raising=False)
        finding = only(software.check_engine())
        assert finding.state == "failed"
        assert "cannot cache function 'agree': no locator" in finding.found
        assert "NUMBA_CACHE_DIR" in finding.remedy
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "sim.engine.machine_code", None)
        finding = only(software.check_engine())
        assert finding.state == "failed"
        assert "cannot be loaded" in finding.found
    assert only(software.check_engine()).state == "ok"


@pytest.fixture
def terminal(monkeypatch):
    """A terminal of a given kind on both streams."""

    def install(term="xterm-256color", size=(100, 40), encoding="utf-8"):
        stream = SimpleNamespace(isatty=lambda: True, encoding=encoding)
        monkeypatch.setattr(sys, "stdin", stream)
        monkeypatch.setattr(sys, "stdout", stream)
        monkeypatch.setenv("TERM", term)
        monkeypatch.setenv("COLUMNS", str(size[0]))
        monkeypatch.setenv("LINES", str(size[1]))

    return install


def test_terminals_good_and_bad(terminal):
    terminal()
    assert only(surroundings.check_terminal()).state == "ok"
    terminal(term="dumb")
    assert "set TERM" in only(surroundings.check_terminal()).remedy
    terminal(size=(60, 40))
    assert "at least 80 x 24" in only(surroundings.check_terminal()).remedy
    terminal(encoding="ANSI_X3.4-1968")
    assert "UTF-8 locale" in only(surroundings.check_terminal()).remedy


def test_unwritable_folders_are_reported(monkeypatch, tmp_path):
    for variable in ("XDG_DATA_HOME", "XDG_CACHE_HOME", "XDG_STATE_HOME"):
        monkeypatch.setenv(variable, str(tmp_path / "not" / "yet"))
    assert all(finding.state == "ok" for finding in surroundings.check_folders())
    assert not (tmp_path / "not").exists()
    (tmp_path / "file").write_text("")
    for variable in ("XDG_DATA_HOME", "XDG_CACHE_HOME", "XDG_STATE_HOME"):
        monkeypatch.setenv(variable, str(tmp_path / "file"))
    found = named(surroundings.check_folders())
    assert {name: finding.state for name, finding in found.items()} == {
        "history": "failed",
        "cache": "note",
        "log": "note",
    }
    assert "XDG_DATA_HOME" in found["history"].remedy
    assert "XDG_CACHE_HOME" in found["cache"].remedy
    assert "XDG_STATE_HOME" in found["log"].remedy


def test_no_serial_port_is_a_note(monkeypatch):
    from serial.tools import list_ports

    monkeypatch.setattr(list_ports, "comports", list)
    finding = only(instruments.check_serial_ports())
    assert finding.state == "note"
    assert "plug" in finding.remedy


@pytest.mark.parametrize(
    ("members", "joined", "remedy"),
    [
        ([], [], "sudo usermod -aG dialout kim, then log out and in again"),
        (["kim"], [], "log out and in again: you joined group dialout after this log-in"),
        (["kim"], [20], "sudo chmod g+rw /dev/ttyUSB7; its group dialout, which you are in"),
    ],
)
def test_a_serial_port_of_another_group(monkeypatch, members, joined, remedy):
    grp, pwd = pytest.importorskip("grp"), pytest.importorskip("pwd")
    from serial.tools import list_ports

    monkeypatch.setattr(list_ports, "comports", lambda: [SimpleNamespace(device="/dev/ttyUSB7")])
    for variable in ("LOGNAME", "USER", "LNAME", "USERNAME"):
        monkeypatch.setenv(variable, "kim")
    monkeypatch.setattr(
        grp, "getgrnam", lambda name: SimpleNamespace(gr_name=name, gr_gid=20, gr_mem=members)
    )
    monkeypatch.setattr(pwd, "getpwnam", lambda name: SimpleNamespace(pw_gid=1000))
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    monkeypatch.setattr(os, "getgroups", lambda: joined)
    finding = only(instruments.check_serial_ports())
    assert (finding.name, finding.state) == ("serial port /dev/ttyUSB7", "note")
    assert finding.found == "kim may not open it"
    assert finding.remedy.startswith(remedy)


def test_a_port_on_windows_needs_no_group(monkeypatch):
    from serial.tools import list_ports

    monkeypatch.setattr(list_ports, "comports", lambda: [SimpleNamespace(device="COM3")])
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setitem(sys.modules, "grp", None)
    monkeypatch.setitem(sys.modules, "pwd", None)
    finding = only(instruments.check_serial_ports())
    assert finding.state == "ok"
    assert "prologix:COM3?addr=11" in finding.found


def test_visa_back_ends_are_reported(monkeypatch):
    import pyvisa
    from pyvisa.ctwrapper import IVIVisaLibrary

    def no_back_end(name):
        raise ValueError("Could not locate\na VISA implementation")

    monkeypatch.setattr(IVIVisaLibrary, "get_library_paths", staticmethod(tuple))
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with monkeypatch.context() as patch:
        patch.setattr(pyvisa, "ResourceManager", no_back_end)
        found = named(instruments.check_visa())
    assert found["VISA on a LAN"].state == "failed"
    assert "locate a VISA" in found["VISA on a LAN"].found
    assert found["VISA on a LAN"].remedy.endswith("--force-reinstall pyvisa-py")
    assert found["VISA for GPIB cards"].state == "note"
    assert "linux-gpib" in found["VISA for GPIB cards"].remedy
    monkeypatch.setattr(IVIVisaLibrary, "get_library_paths", staticmethod(lambda: ("/lib/visa",)))
    assert "/lib/visa" in named(instruments.check_visa())["VISA for GPIB cards"].found


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        # Play makes more of how a processor rounds: -0.9 to -1.1 dB were seen.
        (
            "&effect=load-inertia:J_L=0.006",
            r"40 Hz reads -(0\.[6-9]|1\.[0-4])\d dB, 0\.02 is right",
        ),
        ("&fault=dropped-connection", "the session failed"),
        ("&options=AY6", "the session failed"),
    ],
)
def test_wrong_or_impossible_self_test_is_reported(changed, said):
    finding = only(check_itself(f"sim:?ratio=0.3&seed=1{changed}"))
    assert finding.state == "failed"
    assert re.search(said, finding.found)
    assert "report this line" in finding.remedy


@pytest.mark.parametrize("seed", [2, 3, 4])
def test_self_test_does_not_depend_on_seed(seed):
    assert only(check_itself(f"sim:?ratio=0.3&seed={seed}")).state == "ok"
