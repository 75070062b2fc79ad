"""Where the program begins: before anything that takes time is loaded.

Owns what becomes of an interrupt while the command line itself is being loaded, which nobody else
could tell in words, and that only installed code is loaded: none from the working directory, and
none of another distribution in place of ours. It knows no verb.
"""

from __future__ import annotations

import os
import sys

from tui.exit_codes import INTERRUPTED

__all__ = ["main"]

_REFUSED = 2
_PACKAGES = ("daq", "sim", "analysis", "tui")
_MARK = b'__distribution__ = "lashbench"'
"""In the first lines of each of our packages."""


def main() -> int:
    """Run the command line; its exit code."""
    _stand_in_for_closed_streams()
    fault = _keep_to_own_code()
    if fault is not None:
        sys.stderr.write(f"error: {fault}\n")
        return _REFUSED
    try:
        if _shows_front_page(sys.argv[1:]):
            return 0
        from tui.cli import main as run

        code = run()
    except KeyboardInterrupt:
        sys.stderr.write("error: interrupted\n")
        code = INTERRUPTED
    if code == INTERRUPTED:
        # An interrupt that met code made of text, as methods of a dataclass are, ends the process
        # by a signal though it was caught. CPython takes that back when it next runs such code.
        exec("")
    return code


def _shows_front_page(words: list[str]) -> bool:
    """Whether the words asked for the help or the version alone, and stdout took it."""
    from tui.verbs import FRONT_PAGES, front_page

    if words not in FRONT_PAGES or sys.stdout is None:
        return False
    try:
        sys.stdout.write(front_page(words))
        sys.stdout.flush()
    except OSError:
        # The command line tells what is wrong with stdout.
        return False
    return True


def _stand_in_for_closed_streams() -> None:
    """Let narration go nowhere where the caller closed stderr, and nothing come from stdin.

    The interpreter has None for these, which nobody expects, and the next file to be opened would
    take the number. A result needs its stdout, and says so (`tui.text.output`).
    """
    for name, mode in (("stdin", "r"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(os.open(os.devnull, os.O_RDWR), mode, encoding="utf-8"))


def _keep_to_own_code() -> str | None:
    """Take the working directory off the search path; what is wrong all the same, in words.

    What PYTHONPATH adds is searched last: it may hold libraries that are nowhere else, and stands
    in for none that is installed. What Python itself loads before the program begins is not seen
    to, but told.
    """
    root = os.path.realpath(os.path.join(os.path.dirname(__file__), os.pardir))
    try:
        here = os.path.realpath(os.getcwd())
    except OSError:
        here = ""  # the directory is gone
    words = "" if sys.flags.ignore_environment else os.environ.get("PYTHONPATH", "")
    given = {os.path.realpath(word) for word in words.split(os.pathsep)} if words else set()
    first, last, was_here = [], [], False
    for number, place in enumerate(sys.path):
        real = os.path.realpath(place)
        is_added = real in given or number == 0 or not os.path.isabs(place)
        if real == here and is_added:
            was_here = True
            if real == root:
                last.append(root)
        elif real in given and real != root:
            last.append(place)
        else:
            first.append(place)
    sys.path[:] = first + last
    if was_here and here != root and (name := _loaded_from(here)):
        return (
            f"the module {name} was loaded from the working directory ({here}); unset PYTHONPATH, "
            "or work in another folder"
        )
    return next((fault for name in _PACKAGES if (fault := _foreign(name, root))), None)


def _loaded_from(folder: str) -> str | None:
    """A module that lies in a folder and was loaded already."""
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if file and name != "__main__" and "." not in name:
            place = os.path.dirname(os.path.realpath(file))
            if folder in (place, os.path.dirname(place)):
                return name
    return None


def _foreign(name: str, root: str) -> str | None:
    """Why a package of that name is not ours, in words."""
    from importlib.util import find_spec

    spec = find_spec(name)
    place = "nowhere" if spec is None else spec.origin or "a folder without __init__.py"
    ours = os.path.join(root, name, "__init__.py")
    if os.path.realpath(place) == ours:
        try:
            with open(ours, "rb") as file:
                if _MARK in file.read(4096):
                    return None
        except OSError:
            return None  # in an archive, where nothing is written over
    return (
        f"another distribution owns the package {name!r} ({place}); install lashbench into an "
        "environment of its own, as uv tool install and pipx do"
    )
