"""Checks of the software: Python, the packages that lashbench requires, its compiled engine.

Owns what counts as installed: a package that is there in the right version and
can also be loaded. It installs nothing.
"""

from __future__ import annotations

import os
import platform
import re
import sys
from collections.abc import Iterator
from importlib import import_module, metadata
from pathlib import Path

from tui.checkup.finding import Finding, failed, noted, passed
from tui.text.shell_quote import pip_install

__all__ = ["check_engine", "check_packages", "check_python", "satisfies"]

_OWN = "lashbench"
_REQUIREMENT = re.compile(r"([A-Za-z0-9._-]+)(?:\[[^]]*\])?\s*\(?([^;)]*)\)?\s*(?:;(.*))?")
_MODULES = {"pyserial": "serial"}
"""Modules whose name is not that of their package."""


def check_python() -> Iterator[Finding]:
    """Whether this Python is new enough."""
    wanted = metadata.metadata(_OWN)["Requires-Python"] or ""
    found = f"{platform.python_version()} at {sys.executable}"
    if satisfies(platform.python_version(), wanted):
        yield passed("Python", found)
    else:
        remedy = f"install Python {wanted} and set lashbench up again with it"
        yield failed("Python", f"{found}; {wanted} is needed", remedy)


def check_packages() -> Iterator[Finding]:
    """Whether every required package is there, in a version that is meant, and loads."""
    wanted = dict(_requirements(metadata.requires(_OWN) or []))
    faults = {name: fault for name, spec in wanted.items() if (fault := _fault(name, spec))}
    sound = [f"{name} {metadata.version(name)}" for name in [_OWN, *wanted] if name not in faults]
    if not faults:
        yield passed("packages", ", ".join(sound))
    for name, fault in faults.items():
        spec = f"{name}{wanted[name]}"
        yield failed(f"package {name}", fault, pip_install(spec))


def check_engine() -> Iterator[Finding]:
    """Whether the compiled engine loads, and is kept from run to run."""
    name = "compiled engine"
    try:
        from numba import config

        if getattr(config, "DISABLE_JIT", False):
            slow = "numba compiles nothing: a diagnosis takes hundreds of times longer"
            yield failed(name, slow, "unset NUMBA_DISABLE_JIT")
            return
        from sim.engine.machine_code import code_folder, multiplies_and_adds

        import_module("analysis.emulation.kernels")
    except ImportError as error:
        yield failed(name, f"cannot be loaded: {error}", "put the packages right first")
        return
    except RuntimeError as error:
        # Numba finds no folder at all that its cache could lie in.
        move = "set NUMBA_CACHE_DIR to a folder that you can write to"
        yield failed(name, f"cannot be loaded: {' '.join(str(error).split())}", move)
        return
    folder = code_folder()
    kept = len(list(folder.glob("*.code")))
    found = f"{kept} compiled programs kept in {folder}"
    if not multiplies_and_adds():
        yield noted(name, f"{found}; this processor is an old one, which is slow", "use another")
    elif not _may_write(folder):
        move = "set XDG_CACHE_HOME to a folder that you can write to"
        yield noted(name, f"{found}, which you cannot write to: start-up may take longer", move)
    else:
        yield passed(name, found)


def satisfies(version: str, specifiers: str) -> bool:
    """Whether a release meets specifiers such as ``>=2.0,<2.5``; forms not known here pass."""
    have = _release(version)
    for part in specifiers.replace(" ", "").split(","):
        if part.startswith(">=") and have < _release(part[2:]):
            return False
        if part.startswith("<") and not part.startswith("<=") and have >= _release(part[1:]):
            return False
    return True


def _requirements(lines: list[str]) -> Iterator[tuple[str, str]]:
    """Name and specifiers of what is required without any extra."""
    for line in lines:
        match = _REQUIREMENT.match(line)
        if match and "extra" not in (match[3] or ""):
            yield match[1], match[2].strip()


def _fault(name: str, specifiers: str) -> str:
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        return "is not installed"
    if not satisfies(version, specifiers):
        return f"is {version}; {specifiers} is needed"
    module = _MODULES.get(name.lower(), name.replace("-", "_"))
    try:
        import_module(module)
    # A broken package may raise anything, a missing shared library an OSError.
    except Exception as error:
        return f"{version} cannot be loaded: {' '.join(str(error).split())}"
    return ""


def _release(version: str) -> tuple[int, ...]:
    """The numbers of a release without trailing zeros, so that 2.0 and 2 are one."""
    match = re.match(r"[0-9]+(?:\.[0-9]+)*", version)
    numbers = [int(part) for part in match[0].split(".")] if match else []
    while numbers and not numbers[-1]:
        numbers.pop()
    return tuple(numbers)


def _may_write(folder: Path) -> bool:
    """Whether files can be made in a folder, or the folder itself."""
    while not os.path.exists(folder) and folder != folder.parent:
        folder = folder.parent
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)
