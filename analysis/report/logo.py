"""A logo as a part of a page: a PNG, JPEG or SVG file, whole.

Owns which pictures are taken. As the picture of a page an SVG runs nothing and fetches nothing.
"""

from __future__ import annotations

import base64
from pathlib import Path

from daq.errors import ConfigurationError

__all__ = ["logo_address"]

_MOST_BYTES = 1 << 20
_KINDS = {
    ".png": ("image/png", (b"\x89PNG\r\n\x1a\n",)),
    ".jpg": ("image/jpeg", (b"\xff\xd8\xff",)),
    ".jpeg": ("image/jpeg", (b"\xff\xd8\xff",)),
    ".svg": ("image/svg+xml", (b"<svg", b"<?xml")),
}


def logo_address(path: Path) -> str:
    """The ``data:`` address of a picture.

    Raises
    ------
    ConfigurationError
        If it cannot be read, is larger than 1 MiB, or is no PNG, JPEG or SVG.
    """
    kind = _KINDS.get(path.suffix.lower())
    if kind is None:
        raise ConfigurationError(f"{path}: a logo is a .png, .jpg or .svg file")
    try:
        with path.open("rb") as file:
            content = file.read(_MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise ConfigurationError(f"{path}: the logo cannot be read ({reason})") from error
    if len(content) > _MOST_BYTES:
        raise ConfigurationError(f"{path}: a logo has up to 1 MiB; give a smaller one")
    if not content.lstrip().startswith(kind[1]):
        raise ConfigurationError(f"{path}: is no {path.suffix[1:].upper()} picture")
    return f"data:{kind[0]};base64,{base64.b64encode(content).decode('ascii')}"
