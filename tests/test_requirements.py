"""What is required: it is installed as it was tested, and an audit never calls unasked sound."""

import json
import re
from importlib import metadata

import pytest
from audit import verdict
from locked import differences, locked, required
from packaging.requirements import Requirement

LOCKED, OWN = locked(), required()


def test_installed_versions_are_locked_ones():
    assert differences(LOCKED, OWN) == []


@pytest.mark.parametrize("name", ["numpy", "llvmlite", "execnet"])
def test_other_version_is_reported(name):
    """Of what is required itself, by what is required, and for the tests alone."""
    other, count = re.subn(rf"(?m)^{name}==.*$", f"{name}==0.1", LOCKED)
    assert count == 1
    installed = metadata.version(name)
    assert differences(other, OWN) == [f"{name}: {installed} is installed, 0.1 is in the lock"]
    missing = re.sub(rf"(?m)^{name}==.*\n", "", LOCKED)
    assert differences(missing, OWN) == [f"{name}: {installed} is installed, none is in the lock"]


def test_unpinned_or_absent_requirement_is_reported():
    assert differences(f"{LOCKED}some-package\n", OWN) == ["some-package: pins no version"]
    absent, newer = Requirement("no-such-package"), Requirement("numpy>=99")
    assert differences(LOCKED, [absent]) == ["no-such-package: is required and not installed"]
    assert differences(LOCKED, [newer]) == [
        f"numpy>=99: is required, {metadata.version('numpy')} is installed"
    ]


def answer(*packages):
    return json.dumps({"dependencies": list(packages), "fixes": []})


SOUND = {"name": "a", "version": "1.0", "vulns": []}
SKIPPED = {"name": "b", "skip_reason": "Dependency not found"}
WEAK = {"name": "c", "version": "2.0", "vulns": [
    {"id": "PYSEC-1", "fix_versions": ["2.1"], "aliases": [], "description": ""},
    {"id": "PYSEC-2", "fix_versions": [], "aliases": [], "description": ""},
]}  # fmt: skip


@pytest.mark.parametrize(
    ("said", "complaints", "code", "line"),
    [
        (answer(SOUND, SOUND), "", 0, "2 packages audited, none with a known weakness"),
        (answer(SOUND, WEAK), "", 1, "c 2.0: PYSEC-1 (mended in 2.1); PYSEC-2 (not mended)"),
        (answer(SOUND, SKIPPED), "", 2, "not audited: b"),
        (answer(SKIPPED, SKIPPED), "", 2, "nothing was audited: the database of known "
         "weaknesses did not answer"),
        ("", "a\nConnectionError: no route\n", 2, "nothing was audited: ConnectionError: no route"),
        ("", "", 2, "nothing was audited: no answer"),
    ],
)  # fmt: skip
def test_skipped_requirement_is_not_called_sound(said, complaints, code, line):
    assert verdict(said, complaints) == (code, [line])


def test_weakness_precedes_skipped_requirement():
    code, lines = verdict(answer(WEAK, SKIPPED), "")
    assert code == 1
    assert lines[-1] == "not audited: b"
