"""Values as one-line TOML, for the comment lines of text formats.

Owns only the writing; reading is the standard library's. A value that TOML
has no word for is refused, never turned into a string that looks like it.
"""

from __future__ import annotations

import datetime
import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

__all__ = ["toml_key", "toml_value"]

_BARE = re.compile(r"[A-Za-z0-9_-]+\Z")


def toml_key(key: str) -> str:
    """A key, quoted where it must be."""
    return key if _BARE.match(key) else _quoted(key)


def toml_value(value: Any) -> str:
    """A value on one line; tables are inline ones, in which keys without a value are left out.

    Numbers keep all their digits. NumPy scalars and arrays count as the numbers they hold.

    Raises
    ------
    TypeError
        If the value, or one inside it, is none that TOML can say.
    """
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, int):
        return str(int(value))
    if isinstance(value, float):
        return repr(float(value))
    if isinstance(value, datetime.datetime | datetime.date | datetime.time):
        return value.isoformat()
    if isinstance(value, Mapping):
        pairs = (f"{toml_key(str(k))} = {toml_value(v)}" for k, v in value.items() if v is not None)
        return f"{{{', '.join(pairs)}}}"
    if isinstance(value, Sequence) and not isinstance(value, bytes | bytearray):
        return f"[{', '.join(toml_value(item) for item in value)}]"
    raise TypeError(f"{type(value).__name__} has no form in TOML")


def _quoted(text: str) -> str:
    if not text.isprintable() and any("\ud800" <= character <= "\udfff" for character in text):
        raise TypeError("half of a surrogate pair has no form in TOML")
    # A JSON string is a TOML string once DEL is escaped and nothing else is.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
