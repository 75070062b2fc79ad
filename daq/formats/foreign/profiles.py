"""Profiles: how the text files of a program are laid out, under a name.

Owns the TOML form of a profile, where profiles are found, and by which signs the profile of a file
is recognised. A profile holds no data and reads no response.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

from daq.configs import config_names, config_path
from daq.errors import InputError
from daq.formats.foreign.quantities import QUANTITIES
from daq.formats.foreign.table import Separator, Table
from daq.untrusted.toml_files import Positive, load_toml

__all__ = ["Profile", "load_profile", "matches", "profile_path", "profiles_like", "save_profile"]

_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,40}\Z")
Where = Annotated[int, Field(ge=1, le=10_000)] | Annotated[str, Field(min_length=1)]


class Profile(BaseModel):
    """How the files of a program are laid out."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    title: str = Field(min_length=1)
    """The program, and what was saved, for people."""
    signs: tuple[str, ...] = ()
    """Texts that stand in every such file above its numbers; * is anything."""
    separator: Separator | None = None
    decimal: Literal[".", ","] | None = None
    level_vpk: Positive | None = None
    """Source level, V peak, where all such files have the same."""
    averages: Annotated[int, Field(ge=1)] | None = None
    """Averages behind a coherence, where all such files have the same."""
    columns: dict[str, Where | tuple[Where, ...]]
    """For each quantity its column: a number from 1 or a header, or several of which one is there.
    * in a header is anything."""

    @field_validator("columns")
    @classmethod
    def _known(cls, columns: dict[str, object]) -> dict[str, object]:
        unknown = [name for name in columns if name not in QUANTITIES]
        if unknown:
            raise ValueError(f"{unknown[0]} is no quantity; use {', '.join(QUANTITIES)}")
        if not columns:
            raise ValueError("names no column")
        return columns


def load_profile(name_or_path: str) -> Profile:
    """The profile of a name that comes with lashbench, or of a path.

    Raises
    ------
    ConfigurationError
        If there is none, or it is wrong.
    """
    return load_toml(Profile, config_path("profiles", name_or_path))


def profile_path(name: str, own: Path) -> Path:
    """Where a profile of a name is kept in a folder of one's own.

    Raises
    ------
    InputError
        If it is no name.
    """
    if not _NAME.match(name):
        raise InputError(
            f"profile {name[:60]!r} is no name; use small letters, digits, - and _ up to 41"
        )
    return own / f"{name}.toml"


def save_profile(profile: Profile, name: str, own: Path) -> Path:
    """Keep a profile under a name in one's own folder, in place of one of that name there.

    Raises
    ------
    InputError
        If the name is none, or the file cannot be made.
    """
    from daq.formats.atomic import write_text
    from daq.formats.toml import toml_key, toml_value

    path = profile_path(name, own)
    held = profile.model_dump(exclude_none=True, exclude_defaults=True)
    columns = held.pop("columns")
    lines = [f"{toml_key(key)} = {toml_value(value)}" for key, value in held.items()]
    lines += ["", "[columns]"]
    lines += [f"{toml_key(key)} = {toml_value(value)}" for key, value in columns.items()]
    try:
        own.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{own}: cannot be made ({error.strerror or error})") from error
    write_text(path, "\n".join(lines) + "\n")
    return path


def profiles_like(table: Table) -> list[str]:
    """Names of the profiles that come with lashbench whose signs a table bears.

    Where several do, those with the most signs.
    """
    head = _plain("\n".join((*table.preamble, *table.names)))
    found: dict[str, int] = {}
    for name in config_names("profiles"):
        signs = load_profile(name).signs
        if signs and all(_pattern(sign).search(head) for sign in signs):
            found[name] = sum(len(sign) for sign in signs)
    most = max(found.values(), default=0)
    return [name for name, size in found.items() if size == most]


def matches(pattern: str, header: str) -> bool:
    """Whether a header is what a pattern says; * is anything, blanks and capitals do not count."""
    return _pattern(pattern).fullmatch(_plain(header)) is not None


def _pattern(text: str) -> re.Pattern[str]:
    return re.compile(re.escape(_plain(text)).replace(r"\*", ".*"))


def _plain(text: str) -> str:
    """A text as it is compared: the usual damage to a degree sign is mended."""
    for damaged in ("Â°", "\N{MASCULINE ORDINAL INDICATOR}", "\ufffd"):
        text = text.replace(damaged, "°")
    return re.sub(r"[^\S\n]+", " ", text).strip().lower()
