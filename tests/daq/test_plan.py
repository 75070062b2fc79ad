"""Frequencies of a sweep: what is laid out, and what is refused before it is."""

import time

import pytest

from daq.errors import InputError
from daq.plan import MOST_POINTS, spaced_frequencies


def test_both_ends_are_included_in_even_steps():
    assert spaced_frequencies(100.0, 140.0, 5) == (100.0, 110.0, 120.0, 130.0, 140.0)
    assert spaced_frequencies(1.0, 100.0, 3, "log") == pytest.approx((1.0, 10.0, 100.0))
    assert spaced_frequencies(120.0, 120.0, 1) == (120.0,)


@pytest.mark.parametrize(
    ("band", "said"),
    [
        ((0.0, 10.0, 5), "must be above 0 Hz"),
        ((float("nan"), 10.0, 5), "must be above 0 Hz"),
        ((10.0, 10.0, 5), "must lie above the start"),
        ((10.0, 20.0, 1), "1 points cannot span a band"),
        ((10.0, 20.0, 10**10), f"10000000000 points are more .* up to {MOST_POINTS}"),
    ],
)
def test_invalid_sweep_is_refused_at_once(band, said):
    began = time.monotonic()
    with pytest.raises(InputError, match=said):
        spaced_frequencies(*band)
    # Ten thousand million numbers would take a minute, and eighty gigabytes.
    assert time.monotonic() - began < 5.0


def test_largest_sweep_is_laid_out():
    assert len(spaced_frequencies(10.0, 20.0, MOST_POINTS)) == MOST_POINTS
