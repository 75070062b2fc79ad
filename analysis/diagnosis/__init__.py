"""What a simulation gets wrong against a measurement, and why.

Owns the order of a diagnosis, its result and its figures. Its stages are in rooms below.
"""

from __future__ import annotations

from analysis.diagnosis.diagnose import Cause, Diagnosis, Size, diagnose_response

__all__ = ["Cause", "Diagnosis", "Size", "diagnose_response"]
