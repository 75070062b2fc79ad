"""How much of the total backlash sits in each gear stage, and how sure that is.

Owns the estimate for a unit that is as its datasheet says. It looks for no cause.
"""

from __future__ import annotations

from analysis.estimate.estimate import (
    Estimate,
    Uncertain,
    estimate_features,
    estimate_response,
    free_axes,
)

__all__ = ["Estimate", "Uncertain", "estimate_features", "estimate_response", "free_axes"]
