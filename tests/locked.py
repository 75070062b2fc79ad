"""Check that what is installed is what requirements.lock says was tested; needs no network.

Run as a script, as ``make check`` does, it prints what differs and exits 1. What
pyproject.toml requires for work and for tests, however deep, must stand in the lock
and be installed in that version, and every requirement must be met. Whether a
version is known to be weak is another question: ``make audit`` asks it.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterable, Iterator
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
_PINNED = re.compile(r"([A-Za-z0-9._-]+)==([A-Za-z0-9.+!_-]+)")


def required() -> list[Requirement]:
    """What the project requires itself, and for its tests."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lines = project["dependencies"] + project["optional-dependencies"]["dev"]
    return [Requirement(line) for line in lines]


def locked() -> str:
    """The lock as it stands."""
    return (ROOT / "requirements.lock").read_text(encoding="utf-8")


def differences(lock: str, wanted: Iterable[Requirement]) -> list[str]:
    """Everything in which what is installed is not what was asked for and locked."""
    pinned, found = _read(lock)
    seen: set[tuple[str, str]] = set()
    waiting = list(wanted)
    while waiting:
        one = waiting.pop()
        name = canonicalize_name(one.name)
        try:
            installed = metadata.version(name)
        except metadata.PackageNotFoundError:
            found.append(f"{name}: is required and not installed")
            continue
        if not one.specifier.contains(installed, prereleases=True):
            found.append(f"{one}: is required, {installed} is installed")
        if pinned.get(name) != installed:
            tested = pinned.get(name, "none")
            found.append(f"{name}: {installed} is installed, {tested} is in the lock")
        for extra in ("", *one.extras):
            if (name, extra) not in seen:
                seen.add((name, extra))
                waiting += _required_by(name, extra)
    return sorted(set(found))


def _read(lock: str) -> tuple[dict[str, str], list[str]]:
    """Version by name, and a line for each that pins no version."""
    lines = [line.strip() for line in lock.splitlines()]
    matches = {line: _PINNED.fullmatch(line) for line in lines if line and line[0] != "#"}
    pinned = {canonicalize_name(match[1]): match[2] for match in matches.values() if match}
    return pinned, [f"{line}: pins no version" for line, match in matches.items() if not match]


def _required_by(name: str, extra: str) -> Iterator[Requirement]:
    """What an installed package requires with one extra, or with none."""
    for requirement in map(Requirement, metadata.requires(name) or []):
        if requirement.marker is None or requirement.marker.evaluate({"extra": extra}):
            yield requirement


def main() -> int:
    """Check this environment and say what differs."""
    found = differences(locked(), required())
    for line in found:
        print(line, file=sys.stderr)  # noqa: T201
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
