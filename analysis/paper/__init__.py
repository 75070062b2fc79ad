"""The reproduction of the paper: Table 2, its figures, the error index and section 5.

Owns the paper's numbers and what is computed of them again. It judges no measurement.
"""

from __future__ import annotations

from analysis.paper.reproduction import ReproducedRow, Reproduction, reproduce

__all__ = ["Reproduction", "ReproducedRow", "reproduce"]
