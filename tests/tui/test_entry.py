"""An interrupt while the program is still being loaded: one line, and the exit code of others."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from daq.configs import config_path
from tui import entry

ROOT = Path(entry.__file__).parents[1]


@pytest.mark.parametrize(
    ("module", "word"),
    [("tui.verbs", "--version"), ("tui.cli", "doctor"), ("cyclopts", "doctor"),
     ("tui.text.output", "doctor")],
)  # fmt: skip
def test_interrupt_while_loading_is_one_line(module, word):
    program = f"""
import sys

class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            raise KeyboardInterrupt

sys.meta_path.insert(0, Interrupting())
from tui.entry import main
sys.exit(main())
"""
    run = subprocess.run(
        [sys.executable, "-c", program, word], capture_output=True, text=True, check=False
    )
    assert (run.returncode, run.stderr, run.stdout) == (130, "error: interrupted\n", "")


@pytest.mark.parametrize(
    ("closed", "code", "said"),
    [("2>&-", 0, ""), ("<&-", 0, ""), (">&-", 1, "error: there is no stdout to write")],
)
def test_closed_streams_are_handled(closed, code, said):
    words = "measure --dry-run --json --unit adss --instrument sim: --level 2"
    words += " --start 100 --stop 110 --points 3"
    program = "from tui.entry import main; raise SystemExit(main())"
    line = f'"{sys.executable}" -c "{program}" {words}'
    run = subprocess.run(
        ["/bin/sh", "-c", f"{line} {closed}"], capture_output=True, text=True, check=False
    )
    assert (run.returncode, run.stderr[: len(said)]) == (code, said)
    assert bool(run.stdout) == (code == 0)


NAMES = ("analysis", "daq", "sim", "numpy", "cyclopts", "sqlalchemy", "json", "queue")
CONSOLE = [str(Path(sys.executable).with_name("lashbench"))]
MODULE = [sys.executable, "-m", "tui.cli"]


def beside(folder, *names):
    """Files with the names of libraries in somebody's folder, which leave a trace when run."""
    for name in names:
        (folder / f"{name}.py").write_text(f"open({str(folder / 'ran')!r}, 'a').write({name!r})\n")


@pytest.mark.parametrize(
    ("command", "added"),
    [
        (CONSOLE, None),
        (MODULE, "{cwd}"),
        (CONSOLE, "."),
        pytest.param(MODULE, None, marks=pytest.mark.long),
        pytest.param(CONSOLE, ":/nowhere", marks=pytest.mark.long),
    ],
)
def test_working_directory_module_is_not_run(tmp_path, command, added):
    beside(tmp_path, *NAMES)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    if added is not None:
        environment["PYTHONPATH"] = added.format(cwd=tmp_path)
    words = "measure --dry-run --unit adss --instrument sim: --level 2"
    words += " --start 100 --stop 110 --points 3"
    run = subprocess.run(
        [*command, *words.split()], cwd=tmp_path, env=environment, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert (run.returncode, run.stderr) == (0, "")
    assert run.stdout.startswith("3 points")
    assert not (tmp_path / "ran").exists()


def test_pythonpath_replaces_no_installed_module(tmp_path):
    beside(tmp_path, *NAMES)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    run = subprocess.run(
        [*CONSOLE, "--version"], cwd="/", env=environment, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert (run.returncode, run.stderr) == (0, "")
    assert not (tmp_path / "ran").exists()


def test_modules_from_working_directory_are_reported(tmp_path):
    """Modules that Python loads before the program."""
    (tmp_path / "usercustomize.py").write_text("")
    (tmp_path / "sitecustomize.py").write_text("")
    run = subprocess.run(
        [*CONSOLE, "--version"], cwd=tmp_path, env={**os.environ, "PYTHONPATH": "."},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr.count("\n") == 1
    assert f"customize was loaded from the working directory ({tmp_path})" in run.stderr


@pytest.mark.parametrize("name", ["daq", "sim", "analysis"])
@pytest.mark.parametrize("way", ["before", "over"])
def test_package_of_another_distribution_is_reported(tmp_path, name, way):
    """It lies where it is found first, or its files were written over ours."""
    root, other = tmp_path / "ours", tmp_path / "other"
    for package in ("daq", "sim", "analysis", "tui"):
        shutil.copytree(ROOT / package, root / package, ignore=shutil.ignore_patterns("*.code"))
    foreign = (other if way == "before" else root) / name
    foreign.mkdir(parents=True, exist_ok=True)
    (foreign / "__init__.py").write_text('"""Something else of this name."""\n')
    program = f"import sys; sys.path[:0] = [{str(other)!r}, {str(root)!r}];"
    program += "from tui.entry import main; sys.exit(main())"
    run = subprocess.run(
        [sys.executable, "-c", program, "--version"], capture_output=True, text=True, check=False
    )
    assert (run.returncode, run.stdout) == (2, "")
    assert run.stderr.count("\n") == 1
    assert f"another distribution owns the package '{name}' ({foreign}" in run.stderr


def test_interrupt_in_generated_code_keeps_exit_code(tmp_path):
    """Methods of dataclasses are such; Python would end by the signal though it was caught."""
    shutil.copy(config_path("units", "adss"), tmp_path / "unit.toml")
    with (tmp_path / "unit.toml").open("a") as file:
        file.write('\n[own_effects]\nfiles = ["met.py"]\n')
    (tmp_path / "met.py").write_text('exec("raise KeyboardInterrupt")\n')
    words = ["new-unit", "--check", str(tmp_path / "unit.toml"), "--trust-effects"]
    ended = subprocess.run(
        [sys.executable, "-m", "tui.cli", *words], capture_output=True, text=True
    )
    assert (ended.returncode, ended.stderr) == (130, "error: interrupted\n")
