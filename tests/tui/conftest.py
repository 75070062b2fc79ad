"""A history, and verbs run on it."""

import pytest

from tui import cli


@pytest.fixture
def db(tmp_path):
    return tmp_path / "bench.db"


@pytest.fixture
def run(db, capsys):
    """Run a verb on the history; exit code, stdout and stderr."""

    def call(verb, *words, history=True, compute=None):
        place = ["--db", str(db)] if history else []
        code = cli.main([verb, *map(str, words), *place], compute)
        out, err = capsys.readouterr()
        return code, out, err

    return call
