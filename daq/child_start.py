"""The file that every Python child of lashbench starts from, isolated from the working directory.

Owns the child's module path: it adds the folder of our own packages at the end, and refuses a
module that would come from anywhere else. It imports nothing of ours before that is settled.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path
from runpy import run_module

__all__ = ["main"]


def main(words: list[str]) -> None:
    """Run the module that is named first as the main program, with the other words after it."""
    root = Path(__file__).resolve().parents[1]
    if str(root) not in sys.path:
        sys.path.append(str(root))
    name = words[0]
    spec = find_spec(name)
    found = None if spec is None or spec.origin is None else Path(spec.origin).resolve()
    if found is None or not found.is_relative_to(root):
        sys.exit(f"{name} is not the one of lashbench in {root}, but {found}")
    sys.argv = words
    run_module(name, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main(sys.argv[1:])
