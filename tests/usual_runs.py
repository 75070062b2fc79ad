"""The simulations that come with lashbench, of the paper's units in their usual sweeps.

``python tests/usual_runs.py`` makes the runs of an estimate in configs/runs.zip anew, which is due
when the engine or an edition has changed; tests say when.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray
from worlds.hidden import BANDS_HZ, LEVELS_VPK

from analysis.ensemble.batch import Family, read_families
from analysis.ensemble.datasheet_spread import spread_of
from analysis.ensemble.run_cache import run_name, write_runs
from analysis.estimate.design import RATIO, Families, every_family
from analysis.observation.observation import Observation, unread
from daq.plan import SweepPlan, spaced_frequencies
from sim.unit import load_unit

RUNS = Path(__file__).parents[1] / "configs" / "runs.zip"
POINTS = 61

BITS = 11
"""Kept of a reading: to 0.05 %, where a regression is trusted to 0.3 % (`emulation.emulator`)."""

VARIANCE_BITS = 7

FLIPS = 19_999
"""Of signs, by which kept runs are compared with new ones."""


def usual_sweep(unit: str, levels_vpk: tuple[float, ...] = LEVELS_VPK) -> Observation:
    """The usual sweep of a unit by name, before anything is read."""
    return unread(SweepPlan(spaced_frequencies(*BANDS_HZ[unit], POINTS), levels_vpk), 1e-3)


def _fewer_digits(mean: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """The same readings with as many digits as they deserve, which a file keeps in a third."""
    return _rounded(mean.real, BITS) + 1j * _rounded(mean.imag, BITS)


def _rounded(values: NDArray[np.float64], bits: int) -> NDArray[np.float64]:
    share, exponent = np.frexp(values)
    return np.ldexp(np.round(np.ldexp(share, bits)), exponent - bits)


def usual_families(name: str) -> Families:
    """All machines that an estimate of the usual sweep of a unit may ask for."""
    return every_family((RATIO,), usual_sweep(name), spread_of(load_unit(name)), seed=0)


def agreement(apart: NDArray[np.complex128], rng: np.random.Generator) -> float:
    """How likely kept runs are to differ from new ones at the same places by so much.

    `apart` (machines, rows): log of their ratio. Both come from one distribution if the engine is
    the same, so that every difference is as likely with the other sign, in all rows at once.
    """
    values = np.concatenate([apart.real, apart.imag], axis=1)
    values = values / np.sqrt(np.mean(values**2, axis=0))
    signs = rng.choice([-1.0, 1.0], (FLIPS + 1, len(values)))
    signs[0] = 1.0
    total = np.sum((signs @ values) ** 2, axis=1)
    return float(np.mean(total >= total[0]))


def main() -> None:
    """Write them all."""
    with ZipFile(RUNS, "w") as archive:
        for name in BANDS_HZ:
            unit, sweep = load_unit(name), usual_sweep(name)
            families = usual_families(name)
            tasks = [Family(unit, family, sweep.plans) for family in families]
            for family, (mean, variance) in zip(families, read_families(tasks), strict=True):
                content = BytesIO()
                write_runs(content, (_fewer_digits(mean), _rounded(variance, VARIANCE_BITS)))
                archive.writestr(run_name(unit, family, sweep), content.getvalue())


if __name__ == "__main__":
    main()
