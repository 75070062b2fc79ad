"""The history of a bench: every measurement, committed point by point.

Owns the SQLite file, its layout and its queries. It judges nothing that it holds.
"""

from __future__ import annotations

from daq.store.store import Store

__all__ = ["Store"]
