"""Departures of a measurement from a model: where they are, of which sweep, and in words."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic import LEVELS, ROWS, candidate, observation, read

from analysis.misfit import describe_departures, find_departures


def test_departures_are_found_where_they_are_and_nowhere_else():
    values = read((), np.array([0.5]), np.random.default_rng(4))
    quiet = observation(values)
    assert len(find_departures(candidate(quiet), quiet)) <= 2
    values = values.copy()
    band = (np.arange(ROWS) >= ROWS - 6) & (np.arange(ROWS) < ROWS - 3)
    values[0, band] += 0.2
    loud = observation(values)
    found = find_departures(candidate(loud), loud)
    assert (found[0].quantity, found[0].source_vpk) == ("gain", LEVELS[1])
    assert loud.frequency_hz[band][0] == found[0].low_hz
    assert found[0].mean == pytest.approx(0.2 * 8.686, rel=0.25)
    at = f"{found[0].low_hz:.4g} to {found[0].high_hz:.4g} Hz"
    assert at in describe_departures(found, loud)
    assert describe_departures((), loud) == "nothing departs by more than chance"
    assert "sweep" not in found[0].to_json()
    # A grid of thirds is told as it is read off a screen.
    thirds = replace(found[0], low_hz=34.0, high_hz=39.0 + 1.0 / 3.0, source_vpk=10.0 / 3.0)
    assert "most at 34 to 39.33 Hz and 3.333 V, where" in describe_departures((thirds,), loud)

    # The same rows as two sweeps, of which the second departs.
    (plan, rows), half = loud.plans[0], ROWS // 2
    sweeps = tuple(
        (replace(plan, levels_vpk=(level,)), rows[part])
        for level, part in zip(LEVELS, (slice(half), slice(half, None)), strict=True)
    )
    apart = replace(loud, plans=sweeps)
    again = find_departures(candidate(apart), apart)
    assert [(one.low_hz, one.source_vpk) for one in again] == [
        (one.low_hz, one.source_vpk) for one in found
    ]
    assert again[0].to_json()["sweep"] == 1
    assert f"{LEVELS[1]:g} V of sweep 2, where the gain" in describe_departures(again, apart)
