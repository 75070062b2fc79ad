"""The wheel: what it puts into an environment, and whether that works away from the checkout."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def pip(*words):
    command = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *words]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    pip("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder), str(ROOT))
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    folder = tmp_path_factory.mktemp("installed")
    pip("install", "--no-deps", "--no-compile", "--no-index", "--target", str(folder), str(wheel))
    return folder


def run_installed(installed, cwd, program):
    return subprocess.run(
        [sys.executable, "-c", program],
        cwd=cwd,
        env={"PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
        check=False,
    )


def test_it_holds_the_four_floors_and_nothing_beside_them(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    top = {name.split("/")[0] for name in names}
    (metadata,) = [name for name in top if name.endswith(".dist-info")]
    assert top - {metadata} == {"daq", "sim", "analysis", "tui"}
    assert "daq/_configs/units/adss.toml" in names
    sources = {str(path.relative_to(ROOT)) for path in (ROOT / "tui").rglob("*.py")}
    assert sources <= set(names)


def test_what_comes_with_it_is_found_away_from_the_checkout(installed, tmp_path):
    program = (
        "import daq, sim.unit, daq.configs as c; print(daq.__file__);"
        "print(c.config_names('units'), sim.unit.load_unit('edss').name);"
        "print([p.is_file() for p in map(c.sample_path, c.sample_names())])"
    )
    run = run_installed(installed, tmp_path, program)
    assert run.returncode == 0, run.stderr
    place, units, samples = run.stdout.splitlines()
    assert Path(place).is_relative_to(installed)
    assert units == "['adss', 'edss'] EDSS"
    assert samples == "[True]"


def test_its_command_runs_away_from_the_checkout(installed, tmp_path):
    program = "import sys, tui.cli as c; print(c.__file__); sys.exit(c.main(['--help']))"
    run = run_installed(installed, tmp_path, program)
    assert run.returncode == 0, run.stderr
    place, text = run.stdout.split("\n", 1)
    assert Path(place).is_relative_to(installed)
    assert "simulate" in text
