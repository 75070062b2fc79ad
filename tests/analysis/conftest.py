"""What several tests of refinement share."""

import pytest
from worlds import synthetic_runs

pytest.register_assert_rewrite("outputs.report_pages")


@pytest.fixture
def runs(monkeypatch):
    """A hunt reads the synthetic world; what it asks for is counted."""
    return synthetic_runs.simulate_in(monkeypatch)
