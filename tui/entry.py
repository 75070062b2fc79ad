"""Where the program begins: before anything that takes time is loaded.

Owns what becomes of an interrupt while the command line itself is being loaded, which nobody else
could tell in words. It knows no verb.
"""

from __future__ import annotations

import sys

__all__ = ["INTERRUPTED", "main"]

INTERRUPTED = 130
"""Exit code of what was interrupted, as shells have it."""


def main() -> int:
    """Run the command line; its exit code."""
    try:
        from tui.cli import main as run
    except KeyboardInterrupt:
        sys.stderr.write("error: interrupted\n")
        return INTERRUPTED
    return run()
