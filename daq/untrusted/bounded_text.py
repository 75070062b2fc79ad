"""Text that others wrote, taken within bounds: of size, of nesting, of digits.

Owns the bounds that keep a damaged or hostile file from filling the memory or
the stack, and the parsing of TOML and JSON under them. It knows nothing of
what the text means. Every refusal is a `ValueError` in one line, for the
caller to say of which file and place.
"""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

__all__ = ["LEVELS_LIMIT", "parse_json", "parse_toml", "read_bytes", "read_text"]

LEVELS_LIMIT = 32
"""Tables and lists inside each other that a document may hold; ours hold less than ten."""
_LENGTH_LIMIT = 1 << 20
"""Characters of one TOML document."""
_KEY_PARTS = 500
"""Dots between two separators: the parser takes time in the square of the parts of a key."""
# One that is not closed counts to the end of its line: to fail there would take time in the square.
_QUOTED = re.compile(r'"(?:[^"\\\n]|\\.)*"?|' r"'[^'\n]*'?")
_SEPARATOR = re.compile(r"[=,{}\[\]\n]")


def read_bytes(path: Path, limit_bytes: int) -> bytes:
    """The content of a file or pipe, which may be one that never ends.

    Raises
    ------
    OSError
        If it cannot be read.
    ValueError
        If it is longer than `limit_bytes`.
    """
    with path.open("rb") as file:
        content = file.read(limit_bytes + 1)
    if len(content) > limit_bytes:
        raise ValueError(f"it has more than {limit_bytes} bytes")
    return content


def read_text(path: Path, limit_bytes: int, encoding: str = "utf-8") -> str:
    """The same as text; raises ValueError as well if it is none in that encoding."""
    return read_bytes(path, limit_bytes).decode(encoding)


def parse_toml(text: str) -> dict[str, Any]:
    """A TOML document; raises ValueError if it is none, or beyond the bounds."""
    if len(text) > _LENGTH_LIMIT:
        raise ValueError(f"it has more than {_LENGTH_LIMIT} characters")
    if max(piece.count(".") for piece in _SEPARATOR.split(_QUOTED.sub("", text))) > _KEY_PARTS:
        raise ValueError(f"it holds a key of more than {_KEY_PARTS} parts")
    try:
        document = tomllib.loads(text)
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error
    return _shallow(document)


def parse_json(text: str) -> Any:
    """A JSON document; raises ValueError if it is none, or beyond the bounds."""
    try:
        document = json.loads(text)
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error
    return _shallow(document)


def _shallow(document: Any) -> Any:
    """The document, if it is nested within bounds; looked at level by level, not by recursion."""
    level = [document]
    for _ in range(LEVELS_LIMIT + 1):
        inner: list[Any] = []
        for item in level:
            if isinstance(item, dict):
                inner += item.values()
            elif isinstance(item, list):
                inner += item
        if not inner:
            return document
        level = [item for item in inner if isinstance(item, dict | list)]
    raise ValueError(f"it is nested more than {LEVELS_LIMIT} deep")
