"""Exit codes that no error carries.

Owns them alone, and loads nothing: the program begins with this.
"""

from __future__ import annotations

__all__ = ["INTERRUPTED"]

INTERRUPTED = 130
"""Exit code of what was interrupted, as shells have it."""
