"""Histories in a file and on a server."""

import pytest

from daq.store import Store


@pytest.fixture(params=["file", "server"])
def store(request, tmp_path):
    is_file = request.param == "file"
    place = tmp_path / "bench.db" if is_file else request.getfixturevalue("postgres_url")
    with Store(place, create=True) as opened:
        yield opened


@pytest.fixture
def file_store(tmp_path):
    """A history of whose file the test knows."""
    with Store(tmp_path / "bench.db", create=True) as opened:
        yield opened
