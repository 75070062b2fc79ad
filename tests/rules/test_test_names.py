"""The names of tests are short: what is longer than the limit is a sentence, not a name."""

import ast
from pathlib import Path

TESTS = Path(__file__).parents[1]
MOST_WORDS = 14
"""No name has more. Eight are the aim; lower this when the longest have been renamed."""


def names():
    for file in sorted(TESTS.rglob("test_*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            function = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
            if function and node.name.startswith("test_"):
                yield file, node.name


def words(name):
    return len(name.split("_")) - 1


def test_no_test_has_a_sentence_for_a_name():
    found = list(names())
    assert len(found) > 1000
    assert [f"{file.name}: {name}" for file, name in found if words(name) > MOST_WORDS] == []
