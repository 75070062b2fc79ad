"""HTML that cannot be broken by what stands in it: text is escaped unless it is `Markup`.

Owns how elements are written. It knows nothing of reports and opens no file.
"""

from __future__ import annotations

import html
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from daq.untrusted.visible_text import visible

__all__ = ["Markup", "data_block", "document", "element", "joined", "table"]

_POLICY = "default-src 'none'; style-src 'unsafe-inline'"
"""Held by every browser: the page can fetch nothing and run nothing."""

_VOID = frozenset({"meta", "br", "hr", "col", "img"})


class Markup(str):
    """Text that is HTML already and is not escaped again."""

    __slots__ = ()


Child = str | Iterable[str]


def element(tag: str, *children: Child, **attributes: str | bool) -> Markup:
    """An element; a child that is no `Markup` is escaped, so is every attribute.

    A trailing underscore of an attribute's name is dropped (``class_``) and the
    other underscores become hyphens; True gives a bare attribute, False none.

    >>> element("p", "1 < 2 ", element("b", "&"), class_="x")
    '<p class="x">1 &lt; 2 <b>&amp;</b></p>'
    """
    words = "".join(
        f" {name.rstrip('_').replace('_', '-')}" + ("" if value is True else f'="{_safe(value)}"')
        for name, value in attributes.items()
        if value is not False
    )
    if tag in _VOID:
        return Markup(f"<{tag}{words}>")
    return Markup(f"<{tag}{words}>{joined(*children)}</{tag}>")


def joined(*children: Child) -> Markup:
    """Children one after the other, as one piece of markup."""
    return Markup("".join(_piece(child) for child in children))


def table(
    rows: Sequence[Sequence[str]],
    head: Sequence[str] = (),
    row_heads: bool = False,
    **attributes: str,
) -> Markup:
    """A table; with `row_heads` the first cell of each row is its heading."""
    top: tuple[Markup, ...] = ()
    if head:
        top = (
            element("thead", element("tr", [element("th", cell, scope="col") for cell in head])),
        )
    lines = [
        element(
            "tr",
            [
                element("th", cell, scope="row")
                if row_heads and not column
                else element("td", cell)
                for column, cell in enumerate(row)
            ],
        )
        for row in rows
    ]
    return element("table", *top, element("tbody", lines), **attributes)


def document(title: str, body: Markup, style: str, *, pictures: bool = False) -> str:
    """A whole page in English that can fetch nothing and run nothing.

    Parameters
    ----------
    style
        Its style sheet, which is not escaped.
    pictures
        Whether pictures within the page are shown.
    """
    head = (
        element("meta", charset="utf-8"),
        element(
            "meta",
            http_equiv="Content-Security-Policy",
            content=f"{_POLICY}; img-src data:" if pictures else _POLICY,
        ),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("title", title),
        element("style", Markup(style)),
    )
    page = element("html", element("head", head), element("body", element("main", body)), lang="en")
    return f"<!DOCTYPE html>\n{page}\n"


def data_block(content: Mapping[str, Any], identifier: str) -> Markup:
    """A JSON document inside of a page, for programs; no text in it can end the block.

    Raises
    ------
    ValueError
        If a number in it is not finite.
    """
    text = json.dumps(content, indent=1, allow_nan=False)
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return Markup(f'<script type="application/json" id="{_safe(identifier)}">{text}</script>')


def _piece(child: Child) -> str:
    if isinstance(child, Markup):
        return child
    if isinstance(child, str):
        return _safe(child)
    return "".join(_piece(part) for part in child)


def _safe(text: str | bool) -> str:
    # Some may stand in no HTML, not even escaped; others show as something else than they are.
    return html.escape(visible(str(text)), quote=True)
