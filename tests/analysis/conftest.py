"""What several tests of refinement share."""

import pytest
from worlds import synthetic_runs

pytest.register_assert_rewrite("outputs.report_pages")


@pytest.fixture
def world():
    """The synthetic world as an executor; what is asked of it is counted."""
    return synthetic_runs.World()
