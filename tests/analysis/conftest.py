"""What several tests of the search share."""

import pytest
import synthetic_atlas
import synthetic_search


@pytest.fixture
def runs(monkeypatch):
    """A search reads the synthetic world; what it asks for is counted."""
    return synthetic_search.simulate_in(monkeypatch)


@pytest.fixture(scope="session")
def atlas():
    """What single causes do where two add up exactly; read, never changed."""
    return synthetic_atlas.drawn()
