"""Runs that others could have put into the cache folder are simulated anew, not believed."""

import numpy as np
import pytest

from analysis.ensemble.machine import Machine
from analysis.ensemble.run_cache import run_families
from analysis.observation.observation import unread
from daq.plan import SweepPlan
from sim.unit import load_unit

ADSS = load_unit("adss")
SEEN = unread(SweepPlan((150.0,), (2.5,), settle_cycles=1, integrate_cycles=2), 5e-4)
FAMILIES = [[Machine(0.3, 1)]]


def doctored(file):
    """Make every kept reading twice what it was."""
    with np.load(file) as kept:
        arrays = dict(kept)
    np.savez(file, **{name: 2.0 * held if name.endswith("mean") else held
                      for name, held in arrays.items()})  # fmt: skip


@pytest.mark.parametrize(("mode", "factor"), [(0o755, 2.0), (0o777, 1.0), (0o1777, 1.0)])
def test_runs_of_others_are_not_read(tmp_path, mode, factor):
    cache = tmp_path / "cache"
    honest = run_families(ADSS, FAMILIES, SEEN, cache=cache)
    (file,) = cache.iterdir()
    doctored(file)
    cache.chmod(mode)
    found = run_families(ADSS, FAMILIES, SEEN, cache=cache)
    np.testing.assert_array_equal(found.mean, factor * honest.mean)
