"""The report on one measurement: one HTML file that needs nothing else.

Owns its document, its page and its figures. It computes no answer.
"""

from __future__ import annotations

from analysis.report.page import Diagnosed, file_origin, stored_origin, write_report

__all__ = ["Diagnosed", "file_origin", "stored_origin", "write_report"]
