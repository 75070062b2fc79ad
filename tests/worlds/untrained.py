"""A posterior that was not trained: it believes its prior, and no ratio sooner than another.

Real but for what it reads of a response, which is nothing, and so simulates nothing.
"""

from __future__ import annotations

import numpy as np

from analysis.inference.checkpoint import Checkpoint
from analysis.inference.examples import Scales
from analysis.inference.network import first_weights
from analysis.inference.plans import Landmarks
from analysis.inference.posterior import Posterior
from analysis.inference.prior import Prior
from sim.unit import load_unit

SHAPE = {"widths": (8, 8), "blocks": 1, "hidden": 32, "queries": 2}
SIZE, SIZE_STD = 0.5, 0.15
"""What it believes of every size, as shares of its range."""


class Untrained(Posterior):
    """Of an ADSS; `favoured` effects are e^5 times likelier in every set than others."""

    def __init__(self, favoured: tuple[str, ...] = ()) -> None:
        scales = Scales(Prior(load_unit("adss")), Landmarks(116.0, 150.0), 5.0)
        shape = scales.architecture(**SHAPE)
        weights = first_weights(shape, np.random.default_rng(0))
        weights["size.b"][: shape.parameters] = SIZE
        weights["size.b"][shape.parameters :] = np.log(SIZE_STD)
        weights["single.b"][[scales.prior.effects.index(effect) for effect in favoured]] = 5.0
        checkpoint = Checkpoint("ADSS", 116.0, 150.0, 5.0, shape, weights, 0)
        super().__init__(scales, checkpoint, lambda part: None)

    def summary(self, observation, tolerance, total_known=True):
        return np.zeros((1, SHAPE["hidden"]), dtype=np.float32)
