"""A headless browser for tests of pages, where the machine has one."""

import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")


def browser() -> str:
    """The browser's command; the test that asks is skipped where there is none."""
    for name in NAMES:
        found = shutil.which(name)
        if found:
            return found
    pytest.skip(f"no headless browser on this machine; any of {', '.join(NAMES)} would do")


@dataclass(frozen=True)
class Seen:
    """What a browser made of a page."""

    text: str
    """The page as the browser holds it, after loading."""
    complaints: list[str]
    """Lines of its console: errors, refused requests, broken markup of pictures."""
    pages: int
    """Sheets of A4."""


def look(page: Path, folder: Path) -> Seen:
    """Open a page, read it back and print it."""
    common = [
        browser(), "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr",
        f"--user-data-dir={folder / 'profile'}", "--host-resolver-rules=MAP * ~NOTFOUND",
    ]  # fmt: skip
    pdf = folder / "page.pdf"
    shown = _run([*common, "--dump-dom", page.as_uri()])
    printed = _run([*common, "--no-pdf-header-footer", f"--print-to-pdf={pdf}", page.as_uri()])
    complaints = [
        line for line in (shown.stderr + printed.stderr).splitlines() if ":CONSOLE" in line
    ]
    return Seen(shown.stdout, complaints, len(re.findall(rb"/Type\s*/Page\b", pdf.read_bytes())))


def _run(command: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
