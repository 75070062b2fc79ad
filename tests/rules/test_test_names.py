"""The names of tests are short: subject, behaviour and condition in under eight words."""

import ast
from pathlib import Path

TESTS = Path(__file__).parents[1]
MOST_WORDS = 7
"""No name has more after `test_`. Further facts belong into the docstring."""


def names():
    for file in sorted(TESTS.rglob("test_*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            function = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
            if function and node.name.startswith("test_"):
                yield file, node.name


def words(name):
    return len(name.split("_")) - 1


def test_test_names_are_short():
    found = list(names())
    assert len(found) > 1000
    assert [f"{file.name}: {name}" for file, name in found if words(name) > MOST_WORDS] == []
