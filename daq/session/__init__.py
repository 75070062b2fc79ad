"""A measuring session: it measures, records, and always ends with the source off.

Owns the order of a measurement, and the processes and locks that guard the source. It knows no
instrument by name.
"""

from __future__ import annotations

from daq.session.session import Session

__all__ = ["Session"]
