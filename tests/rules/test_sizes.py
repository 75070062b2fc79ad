"""Modules and folders stay small enough to be read; a longer module says why it is."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]
MOST_LINES, MOST_FILES = 400, 20


def modules(*tops):
    found = [file for top in tops for file in sorted((ROOT / top).rglob("*.py"))]
    assert found
    return found


def test_long_modules_state_their_reason():
    for file in modules("daq", "sim", "analysis", "tui", "lashbench"):
        text = file.read_text(encoding="utf-8")
        if len(text.splitlines()) > MOST_LINES:
            assert "more than 400 lines" in (ast.get_docstring(ast.parse(text)) or ""), file


def test_no_folder_has_too_many_modules():
    files = modules("daq", "sim", "analysis", "tui", "tests")
    for folder in {file.parent for file in files}:
        count = sum(file.parent == folder for file in files)
        assert count <= MOST_FILES, f"{folder}: {count}"
