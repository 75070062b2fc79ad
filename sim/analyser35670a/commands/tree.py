"""The command tree: which header names which command, in every spelling.

Owns short and long forms, optional nodes, numeric suffixes and the path that
lasts from one unit of a message to the next. It executes nothing.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Generic, TypeVar

__all__ = ["CommandTree", "Found", "Path", "key_of"]

Leaf = TypeVar("Leaf")

_PIECE = re.compile(r"(\[?):?([A-Z][A-Za-z]*)(#(\d?))?(\]?)")


@dataclass(frozen=True, slots=True)
class _Keyword:
    short: str
    long: str
    optional: bool
    most: int
    """Largest numeric suffix, 0 if none may be given."""

    def suffix_of(self, token: str) -> int | None:
        """The token's number (1 if left out), None if it is not this keyword."""
        for form in (self.long, self.short):
            if token == form:
                return 1
            digits = token[len(form) :]
            if self.most and token.startswith(form) and digits.isdigit():
                number = int(digits)
                return number if 1 <= number <= self.most else None
        return None


@dataclass(slots=True)
class _Node(Generic[Leaf]):
    keyword: _Keyword | None = None
    children: list[_Node[Leaf]] = field(default_factory=list)
    leaf: Leaf | None = None


@dataclass(frozen=True, slots=True)
class Path(Generic[Leaf]):
    """Where the next relative header is looked up."""

    node: _Node[Leaf]
    suffixes: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Found(Generic[Leaf]):
    """A command, the numbers in its header, and the path for the next one."""

    leaf: Leaf
    suffixes: tuple[int, ...]
    path: Path[Leaf]


def _pieces(pattern: str) -> list[_Keyword]:
    """Keywords of a pattern such as ``[SENSe]:VOLTage#:RANGe:[UPPer]``.

    ``#`` stands for a number from 1 to 4, ``#5`` for one from 1 to 5.
    """
    keywords = []
    for optional, name, numbered, most, _close in _PIECE.findall(pattern):
        short = "".join(letter for letter in name if letter.isupper())
        keywords.append(
            _Keyword(short, name.upper(), bool(optional), int(most or 4) if numbered else 0)
        )
    return keywords


def key_of(pattern: str, suffixes: tuple[int, ...] = ()) -> str:
    """Name under which a setting is kept: short forms, without optional nodes."""
    numbers = iter(suffixes)
    parts = []
    for keyword in _pieces(pattern):
        number = next(numbers, 1) if keyword.most else None
        if not keyword.optional:
            parts.append(keyword.short + ("" if number is None else str(number)))
    return ":".join(parts)


class CommandTree(Generic[Leaf]):
    """All headers of an instrument."""

    def __init__(self) -> None:
        self._root: _Node[Leaf] = _Node()

    @property
    def root(self) -> Path[Leaf]:
        """The path at the start of a message."""
        return Path(self._root)

    def add(self, pattern: str, leaf: Leaf) -> None:
        """Plant a command."""
        node = self._root
        for keyword in _pieces(pattern):
            node = _child(node, keyword)
        node.leaf = leaf

    def find(self, header: str, path: Path[Leaf]) -> Found[Leaf] | None:
        """Look up a header (upper case, without ``?``) from a path; None if undefined."""
        start = self.root if header.startswith(":") else path
        tokens = header.removeprefix(":").split(":")
        return _search(start, tokens)


def _child(node: _Node[Leaf], keyword: _Keyword) -> _Node[Leaf]:
    for child in node.children:
        if child.keyword == keyword:
            return child
    node.children.append(_Node(keyword))
    return node.children[-1]


def _search(
    path: Path[Leaf], tokens: list[str], base: Path[Leaf] | None = None
) -> Found[Leaf] | None:
    """Depth first: spend a token on a child, or pass through an optional one unseen.

    `base` is where the last token seen left off: optional nodes that were not
    sent are no part of the path that the next unit starts from.
    """
    base = base or path
    for child in path.node.children:
        keyword = child.keyword
        if keyword is None:
            continue
        number = keyword.suffix_of(tokens[0])
        if number is not None:
            below = Path(child, path.suffixes + ((number,) if keyword.most else ()))
            found = _search(below, tokens[1:]) if len(tokens) > 1 else _arrive(below, base)
            if found is not None:
                return found
        if keyword.optional:
            unseen = Path(child, path.suffixes + ((1,) if keyword.most else ()))
            found = _search(unseen, tokens, base)
            if found is not None:
                return found
    return None


def _arrive(at: Path[Leaf], base: Path[Leaf]) -> Found[Leaf] | None:
    """The command at a node, or behind the optional nodes below it."""
    if at.node.leaf is not None:
        return Found(at.node.leaf, at.suffixes, base)
    for child in at.node.children:
        keyword = child.keyword
        if keyword is not None and keyword.optional:
            below = Path(child, at.suffixes + ((1,) if keyword.most else ()))
            found = _arrive(below, base)
            if found is not None:
                return found
    return None
