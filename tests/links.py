"""Check that every link in the documentation leads somewhere.

Run as a script it prints the broken ones and exits 1. Links out to the web
are not followed; links to files, pictures and headings must exist.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

from markdown_it import MarkdownIt
from markdown_it.token import Token


def broken_links(root: Path) -> list[str]:
    """Every broken link of the Markdown files in the root and under docs/, as ``file: target``."""
    pages = sorted([*root.glob("*.md"), *(root / "docs").rglob("*.md")])
    return [
        f"{page.relative_to(root)}: {target}"
        for page in pages
        for target in _targets(page)
        if not _leads_somewhere(page, target, root)
    ]


def _targets(page: Path) -> Iterator[str]:
    for token in _tokens(page):
        target = token.attrs.get("href") or token.attrs.get("src")
        if target:
            yield str(target)


def _tokens(page: Path) -> Iterator[Token]:
    for block in MarkdownIt().parse(page.read_text(encoding="utf-8")):
        yield block
        yield from block.children or []


def _leads_somewhere(page: Path, target: str, root: Path) -> bool:
    if re.match(r"(https?|mailto):", target):
        return True
    name, _, heading = unquote(target).partition("#")
    file = (page.parent / name).resolve() if name else page.resolve()
    if not file.is_relative_to(root.resolve()) or not file.exists():
        return False
    return not heading or (file.suffix == ".md" and heading in _headings(file))


def _headings(page: Path) -> set[str]:
    # As the usual hosts make them: lower case, spaces to hyphens, the rest dropped.
    blocks = MarkdownIt().parse(page.read_text(encoding="utf-8"))
    titles = [
        text.content
        for opening, text in zip(blocks, blocks[1:], strict=False)
        if opening.type == "heading_open"
    ]
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def main() -> int:
    """Check this project and say what is broken."""
    broken = broken_links(Path(__file__).parents[1])
    for link in broken:
        print(f"broken link in {link}", file=sys.stderr)  # noqa: T201
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
