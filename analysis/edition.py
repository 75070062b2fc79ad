"""Which edition of the inference an answer comes from.

Owns one number, which is raised whenever the same response and unit would be answered
otherwise than before: what a history holds from another edition is not taken for today's.
"""

from __future__ import annotations

__all__ = ["EDITION"]

EDITION = "12"
"""Edition of estimate and diagnosis; histories before editions hold those of the first."""
