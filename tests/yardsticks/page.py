"""Measured tables of the docs, and the machine they were measured on.

Owns the way from a benchmark's lines into the page: each benchmark has a block
of its own between two comments, and replaces that alone.
"""

from __future__ import annotations

import os
import platform
import re
from datetime import date
from pathlib import Path

__all__ = ["DOCS", "machine", "replace_block"]

DOCS = Path(__file__).resolve().parents[2] / "docs"


def machine() -> str:
    """This machine in a line."""
    try:
        known = Path("/proc/cpuinfo").read_text()
    except OSError:
        known = ""
    name = re.search(r"model name\s*:\s*(.*)", known)
    wide = "AVX-512" if "avx512f" in known else "AVX2" if "avx2" in known else "no AVX"
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    busy = f", load {os.getloadavg()[0]:.1f} at the end" if hasattr(os, "getloadavg") else ""
    processor = name[1].strip() if name else platform.processor()
    return f"{processor}, {cores} cores, {wide}{busy}; {date.today():%d %B %Y}"


def replace_block(name: str, lines: list[str], page: Path = DOCS / "performance.md") -> None:
    """Put lines between the comments ``measured: name`` and ``end: name`` of a page."""
    begin, end = f"<!-- measured: {name} -->", f"<!-- end: {name} -->"
    text = page.read_text()
    before, found, rest = text.partition(begin)
    _, closed, after = rest.partition(end)
    if not found or not closed:
        raise ValueError(f"{page.name} has no block {name!r}")
    page.write_text("\n".join([f"{before}{begin}", *lines, f"{end}{after}"]))
