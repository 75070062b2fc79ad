"""Files that define effects, as a unit names them: read once, known by their digest.

Owns the section of the unit file, the rule that code is executed only where somebody asked for it,
and the list of what was read. It executes nothing: `sim.own_effects.definitions` does.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Annotated

from pydantic import Field

from daq.errors import ConfigurationError
from daq.untrusted.bounded_text import read_text
from daq.untrusted.toml_files import Section
from daq.untrusted.trust import distrust
from daq.untrusted.visible_text import visible_line

__all__ = ["TRUST", "EffectSource", "OwnEffects", "announce", "announced", "read_sources"]

TRUST = "LASHBENCH_TRUST_EFFECTS"
"""Environment variable; 1 allows the effect files of unit files to be executed."""

_LIMIT_BYTES = 1 << 20


class OwnEffects(Section):
    """Section of a unit file: effects that only this unit has."""

    files: Annotated[tuple[str, ...], Field(min_length=1)]
    """Python files, relative to the folder of the unit file."""


@dataclass(frozen=True, slots=True)
class EffectSource:
    """The text of a file that defines effects. `file`: its path, for messages."""

    file: str
    text: str

    @property
    def digest(self) -> str:
        """SHA-256 of the text: the identity of what it defines."""
        return hashlib.sha256(self.text.encode()).hexdigest()


_ANNOUNCED: dict[str, EffectSource] = {}


def read_sources(unit_file: Path, names: Sequence[str]) -> tuple[EffectSource, ...]:
    """Read the effect files that a unit file names.

    Raises
    ------
    ConfigurationError
        If nobody allowed it, or a file is not beside the unit file, cannot be read, or could have
        been written by others.
    """
    _require_trust(f"{unit_file}: own_effects.files", names)
    sources = tuple(_read(unit_file, name) for name in names)
    announce(sources)
    return sources


def announce(sources: Sequence[EffectSource]) -> None:
    """Let the catalogue know of sources, as where a unit arrives from another process.

    Raises
    ------
    ConfigurationError
        If nobody allowed it in this process.
    """
    new = [one for one in sources if one.digest not in _ANNOUNCED]
    if new:
        _require_trust("own_effects", [one.file for one in new])
    _ANNOUNCED.update({one.digest: one for one in new})


def announced() -> Iterator[EffectSource]:
    """Every source that was read or announced, in that order."""
    yield from tuple(_ANNOUNCED.values())


def _require_trust(key: str, names: Sequence[str]) -> None:
    if os.environ.get(TRUST) != "1":
        shown = ", ".join(map(visible_line, names))
        raise ConfigurationError(
            f"{key}: {shown} would be executed as Python code; read it, and if you trust it give "
            f"--trust-effects (or set {TRUST}=1)"
        )


def _read(unit_file: Path, name: str) -> EffectSource:
    fault, path = f"{unit_file}: own_effects.files", unit_file.parent / name
    shown = visible_line(name)
    parts = PurePosixPath(name)
    if parts.is_absolute() or ".." in parts.parts or parts.suffix != ".py":
        raise ConfigurationError(
            f"{fault}: {shown} is no Python file beside the unit file; give a name like "
            "my_effect.py, in the same folder or one below"
        )
    try:
        text = read_text(path, _LIMIT_BYTES)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ConfigurationError(f"{fault}: {path}: cannot be read ({reason})") from error
    doubt = distrust(path)
    if doubt is not None:
        raise ConfigurationError(
            f"{fault}: {path}: {doubt}; code is executed only where you alone can write "
            "(chmod go-w)"
        )
    return EffectSource(str(path), text)
