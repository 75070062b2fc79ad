"""What several tests of the search share."""

import pytest
import synthetic_search


@pytest.fixture
def runs(monkeypatch):
    """A search reads the synthetic world; what it asks for is counted."""
    return synthetic_search.simulate_in(monkeypatch)
