"""Where the program begins: before anything that takes time is loaded.

Owns what becomes of an interrupt while the command line itself is being loaded, which nobody else
could tell in words. It knows no verb.
"""

from __future__ import annotations

import os
import sys

__all__ = ["INTERRUPTED", "main"]

INTERRUPTED = 130
"""Exit code of what was interrupted, as shells have it."""


def main() -> int:
    """Run the command line; its exit code."""
    _stand_in_for_closed_streams()
    try:
        from tui.cli import main as run
    except KeyboardInterrupt:
        sys.stderr.write("error: interrupted\n")
        return INTERRUPTED
    return run()


def _stand_in_for_closed_streams() -> None:
    """Let narration go nowhere where the caller closed stderr, and nothing come from stdin.

    The interpreter has None for these, which nobody expects, and the next file to be opened would
    take the number. A result needs its stdout, and says so (`tui.output`).
    """
    for name, mode in (("stdin", "r"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_RDWR), mode, encoding="utf-8"))
