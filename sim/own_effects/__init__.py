"""Effects of one's own: Python files beside a unit file that extend the catalogue for that unit.

Owns whether such a file may be read, its identity, and what it must define. It holds no effect of
its own, and nothing is executed that was not asked for (`sources.TRUST`).
"""

from sim.own_effects.sources import TRUST, EffectSource, OwnEffects

__all__ = ["TRUST", "EffectSource", "OwnEffects"]
