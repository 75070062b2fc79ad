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

_LOADERS = ("LD_PRELOAD", "LD_AUDIT", "DYLD_INSERT_LIBRARIES")
"""Variables that load other code into every program."""
_LIBRARIES = ("numpy", "sqlalchemy")
"""Where these are, there is all that `daq` needs."""
_START = Path(__file__).resolve().with_name("child_start.py")


def child_command(module: str, *arguments: str) -> list[str]:
    """Command line that runs one of our modules as a program.

    Parameters
    ----------
    module
        Full name, such as ``daq.session.watchdog``; it must lie in a package of lashbench.

    Raises
    ------
    InputError
        If the interpreter does not know its own file.
    """
    if not sys.executable:
        raise InputError("this Python does not know where its own program is; start it by its path")
    # As -I, but for a user's own site-packages where this process has its packages from there.
    flags = [] if site.ENABLE_USER_SITE else ["-s"]
    flags += ["-B"] if sys.dont_write_bytecode else []
    places = os.pathsep.join(_places_of_libraries())
    return [sys.executable, "-E", "-P", *flags, str(_START), places, module, *arguments]


def child_environment(**more: str) -> dict[str, str]:
    """The environment of such a child: that of this process without what loads other code.

    Parameters
    ----------
    more
        Variables to set beside.
    """
    kept = {
        name: value
        for name, value in os.environ.items()
        if name not in _LOADERS and not name.startswith("PYTHON")
    }
    return kept | more


def _places_of_libraries() -> list[str]:
    """Folders of libraries that this process has from where a child would not look, if any."""
    files = (getattr(sys.modules.get(name), "__file__", None) for name in _LIBRARIES)
    places = (str(Path(file).resolve().parents[1]) for file in files if file)
    return list(dict.fromkeys(places))
