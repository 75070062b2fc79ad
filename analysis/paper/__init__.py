"""The reproduction of the paper: Table 2, its figures, the error index and section 5.

Owns the paper's numbers and what is computed of them again. It judges no measurement.
"""

from __future__ import annotations

from analysis.paper.reproduction import Reproduction, reproduce
from analysis.paper.table2 import ReproducedRow

__all__ = ["Reproduction", "ReproducedRow", "reproduce"]
