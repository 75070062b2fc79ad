"""Anti-resonance (ARF), resonance (RF) and damping, read from a response.

Owns readings from one response alone. It simulates nothing.
"""

from __future__ import annotations

from analysis.resonance.extract import (
    Feature,
    FeaturePair,
    LevelFeatures,
    Method,
    extract,
    summary,
    to_json,
)

__all__ = ["Feature", "FeaturePair", "LevelFeatures", "Method", "extract", "summary", "to_json"]
