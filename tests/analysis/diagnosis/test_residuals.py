"""Departures of a measurement from a model: where they are, of which sweep, and in words."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from worlds.synthetic import LEVELS, ROWS, candidate, observation, read

from analysis.diagnosis.residuals import Residual, describe_residuals, find_residuals


def test_departures_are_found_only_where_present():
    values = read((), np.array([0.5]), np.random.default_rng(4))
    quiet = observation(values)
    assert len(find_residuals(candidate(quiet), quiet)) <= 2
    values = values.copy()
    band = (np.arange(ROWS) >= ROWS - 6) & (np.arange(ROWS) < ROWS - 3)
    values[0, band] += 0.2
    loud = observation(values)
    found = find_residuals(candidate(loud), loud)
    assert (found[0].quantity, found[0].source_vpk) == ("gain", LEVELS[1])
    assert loud.frequency_hz[band][0] == found[0].low_hz
    assert found[0].mean == pytest.approx(0.2 * 8.686, rel=0.25)
    at = f"{found[0].low_hz:.4g} to {found[0].high_hz:.4g} Hz"
    assert at in describe_residuals(found, loud)
    assert describe_residuals((), loud) == "no band departs by itself by more than chance"
    assert "sweep" not in found[0].to_json()
    # A grid of thirds is told as it is read off a screen.
    thirds = replace(found[0], low_hz=34.0, high_hz=39.0 + 1.0 / 3.0, source_vpk=10.0 / 3.0)
    assert "most at 34 to 39.33 Hz and 3.333 V, where" in describe_residuals((thirds,), loud)

    # The same rows as two sweeps, of which the second departs.
    (plan, rows), half = loud.plans[0], ROWS // 2
    sweeps = tuple(
        (replace(plan, levels_vpk=(level,)), rows[part])
        for level, part in zip(LEVELS, (slice(half), slice(half, None)), strict=True)
    )
    apart = replace(loud, plans=sweeps)
    again = find_residuals(candidate(apart), apart)
    assert [(one.low_hz, one.source_vpk) for one in again] == [
        (one.low_hz, one.source_vpk) for one in found
    ]
    assert again[0].to_json()["sweep"] == 1
    assert f"{LEVELS[1]:g} V of sweep 2, where the gain" in describe_residuals(again, apart)


@pytest.mark.parametrize(("unread", "told"), [(1, True), (2, False), (3, False)])
def test_a_band_read_by_half_is_reported(unread, told):
    """Bands are of three rows here."""
    values = read((), np.array([0.5]), np.random.default_rng(4)).copy()
    band = slice(ROWS - 6, ROWS - 3)
    values[0, band] += 0.3
    values[0, ROWS - 6 : ROWS - 6 + unread] = np.nan
    loud = observation(values)
    found = find_residuals(candidate(loud), loud)
    at = [one for one in found if one.low_hz == loud.frequency_hz[ROWS - 6] and
          one.source_vpk == LEVELS[1] and one.quantity == "gain"]  # fmt: skip
    assert len(at) == told
    assert all(np.isfinite(one.mean) for one in found)


def departing(level_vpk, quantity="gain"):
    return Residual(34.0, 39.0, level_vpk, quantity, 1.0, 5.0)


@pytest.mark.parametrize(
    ("counts", "told"),
    [
        ((1, 0, 0), "in 1 band, at 1 V alone;"),
        ((0, 1, 0), "in 1 band, at 2 V alone;"),
        ((0, 0, 2), "in 2 bands, at 3.5 V alone;"),
        ((2, 0, 3), "in 5 bands, at 1 V and 3.5 V alone;"),
        ((1, 0, 1), "in 2 bands, at 1 V and 3.5 V alone;"),
        ((1, 1, 2), "in 4 bands, mostly at high source levels;"),
        ((4, 1, 2), "in 7 bands, mostly at low source levels;"),
        ((3, 1, 2), "in 6 bands, at all source levels alike;"),
        ((2, 3, 3), "in 8 bands, at all source levels alike;"),
    ],
)
def test_description_names_the_departing_levels(counts, told):
    levels = (1.0, 2.0, 3.5)
    seen = SimpleNamespace(source_vpk=np.repeat(levels, 4), values=np.zeros((3, 12)))
    found = [departing(v) for v, count in zip(levels, counts, strict=True) for _ in range(count)]
    assert describe_residuals(tuple(found), seen).startswith(f"the gain alone departs {told}")


@pytest.mark.parametrize(
    ("quantities", "phase", "told"),
    [
        (("gain",), 0.0, "the gain alone departs in 1 band;"),
        (("phase", "phase"), 0.0, "the phase alone departs in 2 bands;"),
        (("gain", "phase"), 0.0, "gain and phase depart in 2 bands;"),
        # Nobody knows whether a phase that was not read agrees.
        (("gain",), np.nan, "the gain departs in 1 band;"),
    ],
)
def test_description_names_departing_read_quantities_only(quantities, phase, told):
    values = np.zeros((3, 4))
    values[1] = phase
    seen = SimpleNamespace(source_vpk=np.full(4, 2.0), values=values)
    found = tuple(departing(2.0, quantity) for quantity in quantities)
    assert describe_residuals(found, seen).startswith(told)
