"""Which displayed point stands for a frequency, and where none does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.hp35670a.settings import GRID_HZ
from daq.hp35670a.trace import nearest_row

EDGES = st.integers(1, 3_276_000)


def axis(start_hz, stop_hz, whole):
    """401 points as displayed; unless `whole`, the axis ends one step before the stop."""
    places = np.arange(401) / (400 if whole else 401)
    # Sent as 32-bit reals by some revisions; the rounding must decide nothing.
    return (start_hz + places * (stop_hz - start_hz)).astype(np.float32).astype(float)


@given(EDGES, EDGES, st.booleans())
def test_both_ends_of_band_have_row(one, other, whole):
    low, high = min(one, other), max(one, other) + 1
    shown = axis(low * GRID_HZ, high * GRID_HZ, whole)
    assert nearest_row(shown, low * GRID_HZ) == 0
    # Where the step is finer than a 32-bit real can tell, several rows are the same.
    row = nearest_row(shown, high * GRID_HZ)
    assert row is not None
    assert shown[row] == shown[-1]


def test_rounded_axis_keeps_its_last_point():
    places = np.arange(401) / 401
    assert nearest_row(110.0 + 65.0 * places, 175.0) == 400


@pytest.mark.parametrize("beyond_hz", [0.2, 1.0, 50.0])
def test_frequency_beyond_axis_has_no_row(beyond_hz):
    shown = axis(110.0, 175.0, True)
    assert nearest_row(shown, 175.0 + beyond_hz) is None
    assert nearest_row(shown, 110.0 - beyond_hz) is None
