"""One servo behind every simulated analyser: what is read of it is the same.

Readings scatter, and undamped play need not repeat: what two analysers read differs by no more
than their error bars allow. Every real driver measures its own instrument.
"""

import pytest

from analysis.resonance import extract
from daq.drivers import DRIVERS
from daq.store import Store
from tui import cli

SWEEP = ["--level", "3", "--level", "4", "--start", "120", "--stop", "180", "--points", "31"]


@pytest.fixture(scope="module")
def levels(tmp_path_factory):
    """Features by level, for each driver."""
    folder = tmp_path_factory.mktemp("same")
    found = {}
    for driver in DRIVERS:
        url = f"{driver.scheme}:sim:" if driver.scheme else "sim:"
        db = folder / f"{driver.scheme}.db"
        place = ["--unit", "adss", "--instrument", f"{url}?ratio=0.4&seed=10", "--db", str(db)]
        assert cli.main(["measure", *place, *SWEEP, "--yes"]) == 0
        with Store(db) as store:
            found[driver.scheme] = extract(store.response(1))
    return found


@pytest.mark.parametrize("level", [0, 1])
@pytest.mark.parametrize("driver", [driver.scheme for driver in DRIVERS if driver.scheme])
def test_resonances_agree_between_instruments(levels, driver, level):
    """Four comparisons of normal errors: by chance one in 400 is more than 3.5 of them apart."""
    first, other = levels[""][level], levels[driver][level]
    # The error of an ARF that two or three chaotic points decide is uncertain itself: on one
    # processor it is 0.4 Hz by one instrument and 3.3 Hz by the other.
    for one, two, alike in ((first.arf, other.arf, 10.0), (first.rf, other.rf, 4.0)):
        assert one is not None
        assert two is not None
        apart_hz = abs(one.frequency_hz - two.frequency_hz)
        assert apart_hz < 3.5 * (one.std_hz**2 + two.std_hz**2) ** 0.5
        assert 1.0 / alike < one.std_hz / two.std_hz < alike
