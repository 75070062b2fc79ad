"""The wheel: what it puts into an environment, and whether that works away from the checkout."""

import subprocess
import sys
import tomllib
import zipfile
from email import message_from_string
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


def run_installed(installed, cwd, program, *words):
    return subprocess.run(
        [sys.executable, "-c", program, *words],
        cwd=cwd,
        env={"PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
        check=False,
    )


def test_wheel_holds_floors_and_notebook_names_only(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    top = {name.split("/")[0] for name in names}
    (metadata,) = [name for name in top if name.endswith(".dist-info")]
    assert top - {metadata} == {"daq", "sim", "analysis", "tui", "lashbench"}
    assert "daq/_configs/units/adss.toml" in names
    sources = {str(path.relative_to(ROOT)) for path in (ROOT / "tui").rglob("*.py")}
    assert sources <= set(names)


def test_metadata_are_those_an_index_shows(wheel):
    with zipfile.ZipFile(wheel) as archive:
        (place,) = [name for name in archive.namelist() if name.endswith(".dist-info/METADATA")]
        metadata = message_from_string(archive.read(place).decode())
        licences = [name for name in archive.namelist() if name.endswith("licenses/LICENSE")]
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert (metadata["Name"], metadata["Version"]) == ("lashbench", project["version"])
    assert metadata["License-Expression"] == "Apache-2.0"
    assert licences
    assert metadata["Description-Content-Type"] == "text/markdown"
    assert metadata.get_payload() == (ROOT / "README.md").read_text()
    assert "backlash" in metadata["Keywords"]
    assert "Programming Language :: Python :: 3.11" in metadata.get_all("Classifier")
    extras = set(metadata.get_all("Provides-Extra"))
    assert extras == set(project["optional-dependencies"])


def test_the_citation_is_of_this_version():
    yaml = pytest.importorskip("yaml")
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert {"cff-version", "message", "title", "authors"} <= set(citation)
    assert citation["cff-version"] == "1.2.0"
    assert citation["title"] == project["name"]
    assert str(citation["version"]) == project["version"]
    assert citation["license"] == project["license"]
    for author in citation["authors"] + citation["references"][0]["authors"]:
        assert {"name"} <= set(author) or {"family-names", "given-names"} <= set(author)


def test_tests_pass_outside_the_checkout(installed, tmp_path):
    program = (
        "import sys, pytest, daq, tui; print(daq.__file__, tui.__file__);"
        "sys.exit(pytest.main(['-p', 'no:cacheprovider', *sys.argv[1:]]))"
    )
    words = ("-c", str(ROOT / "pyproject.toml"), "--rootdir", str(ROOT))
    names = ("daq/formats/test_csv_columns.py", "tui/test_logs.py")
    tests = (str(ROOT / "tests" / name) for name in names)
    run = run_installed(installed, tmp_path, program, *words, *tests)
    assert run.returncode == 0, run.stdout + run.stderr
    assert all(
        Path(place).is_relative_to(installed) for place in run.stdout.splitlines()[0].split()
    )


def test_shipped_files_are_found_outside_checkout(installed, tmp_path):
    program = (
        "import daq, sim.unit, daq.configs as c; print(daq.__file__);"
        "print(c.config_names('units'), sim.unit.load_unit('edss').name);"
        "print([p.is_file() for p in map(c.sample_path, c.sample_names())])"
    )
    run = run_installed(installed, tmp_path, program)
    assert run.returncode == 0, run.stderr
    place, units, samples = run.stdout.splitlines()
    assert Path(place).is_relative_to(installed)
    here = sorted(path.stem for path in (ROOT / "configs" / "units").glob("*.toml"))
    assert {"adss", "edss"} <= set(here)
    assert units == f"{here} EDSS"
    assert samples == "[True]"


def test_command_runs_outside_the_checkout(installed, tmp_path):
    program = "import sys, tui.cli as c; print(c.__file__); sys.exit(c.main(['--help']))"
    run = run_installed(installed, tmp_path, program)
    assert run.returncode == 0, run.stderr
    place, text = run.stdout.split("\n", 1)
    assert Path(place).is_relative_to(installed)
    assert "simulate" in text
