"""A figure as a file: PNG, SVG or PDF, whole or not at all, the same bytes for the same figure.

Owns which kinds there are and how one is written. It must never overwrite what was read.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from daq.errors import InputError
from daq.formats.atomic import checked_target, replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["PICTURES", "checked_picture", "save_picture"]

PICTURES = ("png", "svg", "pdf")
"""Suffixes of the kinds that can be written."""

_DPI = 130
_UNDATED = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}


def checked_picture(path: Path, sources: Sequence[Path] = ()) -> str:
    """The kind of a picture by its suffix, once it is known that it can be written.

    Parameters
    ----------
    path
        File to write.
    sources
        Files that are read for it, none of which it may replace.

    Raises
    ------
    InputError
        If the suffix names no kind, nothing can be written there, or it is one of the sources.
    """
    kind = path.suffix.lower().removeprefix(".")
    if kind not in PICTURES:
        raise InputError(
            f"{path}: {path.suffix or 'no suffix'} is no kind of picture; give a name that ends "
            f"in {', '.join('.' + one for one in PICTURES)}"
        )
    checked_target(path, *sources)
    return kind


def save_picture(figure: Figure, path: Path) -> None:
    """Write a figure; the suffix names its kind.

    Raises
    ------
    InputError
        As `checked_picture`.
    LashbenchError
        If the disk refuses it.
    """
    from matplotlib import rc_context

    kind = checked_picture(path)
    with replacing(path) as stream, rc_context({"svg.hashsalt": "lashbench"}):
        figure.savefig(stream, format=kind, dpi=_DPI, metadata=_UNDATED[kind])
