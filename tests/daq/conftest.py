"""A fresh history to measure into."""

import pytest

from daq.store import Store

pytest.register_assert_rewrite("session_runs", "driven_sr785")


@pytest.fixture
def store(tmp_path):
    with Store(tmp_path / "bench.db", create=True) as opened:
        yield opened
