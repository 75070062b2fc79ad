"""Check that the documentation reads plainly: short sentences, and none of the old words.

Owns the limits and the list of banned words. Sentences are those of README, CONTRIBUTING and docs/
(all but the generated api.md); words are looked for in docstrings, too. It judges no content.
"""

from __future__ import annotations

import ast
import re
import statistics
import sys
from collections.abc import Iterator
from pathlib import Path

from markdown_it import MarkdownIt

FLOORS = ("daq", "sim", "analysis", "tui")
MEDIAN_WORDS, MOST_WORDS = 17, 40
DOCUMENTATION_WORDS = 45_000

BANNED = (
    r"purses?",
    r"overdrafts?",
    r"atlas(es)?",
    r"lending",
    r"glanced?( at)?",
    r"second thoughts",
    r"adding up",
    r"(who|what|whoever|whatever) leads",
    r"told to be",
    r"earn(s|ed)? its name",
)
"""Words of the search that is gone, wrong in pages and in docstrings."""

BANNED_IN_PAGES = (
    *BANNED,
    r"hunts?",
    r"contests?",
    r"likeness",
    r"own runs",
    r"lent",
    r"(units? of )?heats?",
    r"felt (as|alike)",
    r"nobody (suspects|knows|has tried|had tried)",
    r"beside what",
    r"in doubt",
    r"doubted",
    r"the house",
)
"""Words of the same dialect that docstrings still have."""


def pages(root: Path) -> list[Path]:
    """README, CONTRIBUTING and every page under docs/ that somebody writes."""
    written = [page for page in (root / "docs").rglob("*.md") if page.name != "api.md"]
    return sorted([root / "CONTRIBUTING.md", root / "README.md", *written])


def texts(page: Path) -> Iterator[tuple[str, str]]:
    """("prose" or "cell", text) of a page; code is one word, and headings are left out."""
    within = ""
    for block in MarkdownIt().enable("table").parse(page.read_text(encoding="utf-8")):
        if block.type in ("heading_open", "td_open", "th_open"):
            within = "heading" if block.type == "heading_open" else "cell"
        elif block.type in ("heading_close", "td_close", "th_close"):
            within = ""
        elif block.type == "inline" and within != "heading":
            parts = ["CODE" if part.type == "code_inline" else part.content or " "
                     for part in block.children or []]  # fmt: skip
            yield within or "prose", "".join(parts)


def sentences(text: str) -> list[str]:
    """The sentences of a text; a point ends one where a blank and a capital or a digit follow."""
    return [one for one in re.split(r"(?<=[.!?])[)*\"]*\s+(?=[(*\"A-Z0-9])", text) if one.strip()]


def length(sentence: str) -> int:
    """How many words it has."""
    return len(re.findall(r"\S*\w\S*", sentence))


def docstrings(root: Path) -> Iterator[tuple[Path, str]]:
    """The docstrings of modules and of what is public in them."""
    for floor in FLOORS:
        for file in sorted((root / floor).rglob("*.py")):
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
                    name = getattr(node, "name", "")
                    if not name.startswith("_") and (told := ast.get_docstring(node)):
                        yield file, told


def offences(root: Path) -> list[str]:
    """Everything that breaks a rule, a line each."""
    found, lengths, total = [], [], 0
    for page in pages(root):
        name = page.relative_to(root)
        if name.parts[0] == "docs":
            total += length(page.read_text(encoding="utf-8"))
        for kind, text in texts(page):
            found += [f"{name}: banned: {word!r}" for word in _banned(text, BANNED_IN_PAGES)]
            for sentence in sentences(text):
                words = length(sentence)
                if kind == "prose":
                    lengths.append(words)
                if words > MOST_WORDS:
                    found.append(f"{name}: {words} words: {sentence[:60]!r}")
    if lengths and (median := statistics.median(lengths)) > MEDIAN_WORDS:
        found.append(f"docs: the median sentence has {median:.0f} words, more than {MEDIAN_WORDS}")
    interface = root / "docs" / "api.md"
    total += length(interface.read_text(encoding="utf-8")) if interface.exists() else 0
    if total > DOCUMENTATION_WORDS:
        found.append(f"docs: {total} words, more than {DOCUMENTATION_WORDS}")
    for file, told in docstrings(root):
        found += [f"{file.relative_to(root)}: banned: {w!r}" for w in _banned(told, BANNED)]
    return found


def _banned(text: str, patterns: tuple[str, ...]) -> list[str]:
    every = rf"\b(?:{'|'.join(patterns)})\b"
    return [match.group() for match in re.finditer(every, text, re.IGNORECASE)]


def main() -> int:
    """Check this project and say what is wrong."""
    found = offences(Path(__file__).parents[1])
    for line in found:
        print(line, file=sys.stderr)  # noqa: T201
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
