"""How lashbench starts a Python child of its own: isolated from what lies about it.

Owns command line and environment of such a child. No code comes from the working directory,
from PYTHONPATH or from a start-up file that an environment variable names. It starts nothing.
"""

from __future__ import annotations

import os
import site
import sys
from pathlib import Path

from daq.errors import InputError

__all__ = ["child_command", "child_environment"]

_START = Path(__file__).resolve().with_name("child_start.py")


def child_command(module: str, *arguments: str) -> list[str]:
    """Command line that runs one of our modules as a program.

    Parameters
    ----------
    module
        Full name, such as ``daq.watchdog``; it must lie in a package of lashbench.

    Raises
    ------
    InputError
        If the interpreter does not know its own file.
    """
    if not sys.executable:
        raise InputError("this Python does not know where its own program is; start it by its path")
    # As -I, but for a user's own site-packages where this process has its packages from there.
    alone = [] if site.ENABLE_USER_SITE else ["-s"]
    return [sys.executable, "-E", "-P", *alone, str(_START), module, *arguments]


def child_environment(**more: str) -> dict[str, str]:
    """The environment of such a child: that of this process without Python's own variables.

    Parameters
    ----------
    more
        Variables to set beside.
    """
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    return kept | more
