"""Planning: which sweep tells most of a drive before anything was measured.

Owns the choice of band, levels and points for a given time at the bench.
"""

from analysis.planning.sweep_choice import Planned, plan_sweep

__all__ = ["Planned", "plan_sweep"]
