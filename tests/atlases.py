"""The atlases that come with lashbench, of the paper's units in their usual sweeps.

``python tests/atlases.py`` simulates them anew into configs/atlases, which is due when the
engine, an effect or the edition of an atlas has changed; tests say when.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from hidden import BANDS_HZ, LEVELS_VPK
from numpy.typing import NDArray

from analysis.atlas import Atlas, atlas_name, coarse_stride, simulate_atlas, write_atlas
from analysis.observation import Observation, unread
from daq.plan import SweepPlan, spaced_frequencies
from sim.unit import load_unit

FOLDER = Path(__file__).parents[1] / "configs" / "atlases"
POINTS = 61

BITS = 11
"""Kept of a reading: to 0.05 %, where a regression is trusted to 0.3 % (`analysis.surface`)."""

VARIANCE_BITS = 7


def usual_sweep(unit: str, levels_vpk: tuple[float, ...] = LEVELS_VPK) -> Observation:
    """What an atlas of a unit by name is made for: the coarse look at its usual sweep."""
    whole = unread(SweepPlan(spaced_frequencies(*BANDS_HZ[unit], POINTS), levels_vpk), 1e-3)
    return whole.thinned(coarse_stride(whole))


def rounded(atlas: Atlas) -> Atlas:
    """The same readings with as many digits as they deserve, which a file keeps in a third."""
    return {
        key: replace(
            one,
            mean=_rounded(one.mean.real, BITS) + 1j * _rounded(one.mean.imag, BITS),
            variance=_rounded(one.variance, VARIANCE_BITS),
        )
        for key, one in atlas.items()
    }


def _rounded(values: NDArray[np.float64], bits: int) -> NDArray[np.float64]:
    share, exponent = np.frexp(values)
    return np.ldexp(np.round(np.ldexp(share, bits)), exponent - bits)


def main() -> None:
    """Write them all, and nothing else stays."""
    FOLDER.mkdir(exist_ok=True)
    for file in FOLDER.glob("*.npz"):
        file.unlink()
    for name in BANDS_HZ:
        unit, coarse = load_unit(name), usual_sweep(name)
        for rare in (False, True):
            atlas = rounded(simulate_atlas(unit, coarse, rare=rare))
            write_atlas(FOLDER / atlas_name(unit, coarse, rare), atlas)


if __name__ == "__main__":
    main()
