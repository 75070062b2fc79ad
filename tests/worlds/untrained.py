"""A posterior that was not trained: it believes its prior, and no ratio sooner than another.

Real but for the datasheet's machine, which is not simulated.
"""

from __future__ import annotations

import numpy as np

from analysis.inference.checkpoint import Checkpoint
from analysis.inference.examples import Scales
from analysis.inference.network import first_weights
from analysis.inference.nominal import PROFILE, Nominal
from analysis.inference.plans import Landmarks
from analysis.inference.posterior import Posterior
from analysis.inference.prior import Prior
from analysis.observation.observation import Observation
from sim.unit import load_unit

SHAPE = {"widths": (8, 8), "blocks": 1, "hidden": 96, "queries": 2}
SIZE, SIZE_STD = 0.5, 0.15
"""What it believes of every size, as shares of its range."""


class Untrained(Posterior):
    """Of an ADSS; `favoured` effects are e^5 times likelier in every set than others.

    It may say that it was lent by another unit.

    Summaries are what a network makes of readings before any training: features by chance.
    """

    def __init__(self, favoured: tuple[str, ...] = (), lent_by: str = "") -> None:
        scales = Scales(Prior(load_unit("adss")), Landmarks(116.0, 150.0), 5.0)
        shape = scales.architecture(**SHAPE)
        weights = first_weights(shape, np.random.default_rng(0))
        for answer in ("count", "single", "pair", "ratio", "size", "error", "total"):
            weights[f"{answer}.w"][:] = 0.0
        weights["size.b"][: shape.parameters] = SIZE
        weights["size.b"][shape.parameters :] = np.log(SIZE_STD)
        weights["single.b"][[scales.prior.effects.index(effect) for effect in favoured]] = 5.0
        checkpoint = Checkpoint("ADSS", 116.0, 150.0, 5.0, shape, weights, 0)
        super().__init__(scales, checkpoint, flat, lent_by)


def flat(part: Observation) -> Nominal:
    """A machine that reads the same everywhere, in the sweep of an observation."""
    ((plan, _),) = part.plans
    mean = np.zeros((PROFILE, 3, len(plan.levels_vpk), len(plan.frequencies_hz)), dtype=np.float32)
    return Nominal(mean, np.ones_like(mean))
