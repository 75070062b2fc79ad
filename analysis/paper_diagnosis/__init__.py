"""The diagnosis from the paper's own two measured rows.

Owns the inference from five numbers a unit. It reads no response.
"""

from __future__ import annotations

from analysis.paper_diagnosis.diagnose import (
    PaperDiagnosis,
    diagnose_features,
    diagnose_paper,
    paper_reading,
)

__all__ = ["PaperDiagnosis", "diagnose_features", "diagnose_paper", "paper_reading"]
