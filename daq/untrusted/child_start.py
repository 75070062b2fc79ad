"""The file that every Python child of lashbench starts from, isolated from the working directory.

Owns the child's module path: `daq` is the one beside this file, whatever else has the name, and the
folders of our packages and libraries are searched last. It refuses a module from anywhere else.
"""

from __future__ import annotations

import os
import sys
from importlib.machinery import PathFinder
from importlib.util import find_spec, module_from_spec
from pathlib import Path
from runpy import run_module

__all__ = ["main"]


def main(words: list[str]) -> None:
    """Run a module as the main program.

    Parameters
    ----------
    words
        Folders of libraries, with the system's separator; the module; the words for it.
    """
    root = Path(__file__).resolve().parents[2]
    places, *words = words
    for place in (str(root), *places.split(os.pathsep)):
        if place and place not in sys.path:
            sys.path.append(place)
    _load_package(root)
    name = words[0]
    spec = find_spec(name)
    found = None if spec is None or spec.origin is None else Path(spec.origin).resolve()
    if found is None or not found.is_relative_to(root):
        sys.exit(f"{name} is not the one of lashbench in {root}, but {found}")
    sys.argv = words
    run_module(name, run_name="__main__", alter_sys=True)


def _load_package(root: Path) -> None:
    spec = PathFinder.find_spec("daq", [str(root)])
    if spec is None or spec.loader is None:
        sys.exit(f"the package daq is not in {root}; install lashbench again")
    package = sys.modules["daq"] = module_from_spec(spec)
    spec.loader.exec_module(package)


if __name__ == "__main__":
    main(sys.argv[1:])
