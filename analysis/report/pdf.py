"""A report as PDF: the HTML page, printed by Chromium or WeasyPrint.

Owns which program prints it. The page is what the HTML report holds; nothing is fetched.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from daq.errors import InputError, LashbenchError
from daq.formats.atomic import replacing

__all__ = ["find_printer", "print_pdf"]

_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
_LONGEST_S = 120.0
_WEASYPRINT = "weasyprint"


def find_printer() -> str:
    """The program that prints: path of a browser, or of weasyprint.

    Raises
    ------
    InputError
        If there is none.
    """
    for name in (*_BROWSERS, _WEASYPRINT):
        found = shutil.which(name)
        if found:
            return found
    raise InputError(
        "a PDF needs Chromium or WeasyPrint, and neither was found; give a name that ends in "
        ".html, and print that from a browser"
    )


def print_pdf(page: Path, path: Path) -> None:
    """Print an HTML file as PDF; it appears whole or not at all.

    Raises
    ------
    InputError
        If no program prints, or no file can be made at `path`.
    LashbenchError
        If the program fails.
    """
    printer = find_printer()
    with TemporaryDirectory() as folder:
        made = Path(folder) / "page.pdf"
        _run(_command(printer, page, made, Path(folder)))
        if not made.is_file() or made.stat().st_size == 0:
            raise LashbenchError(f"{path}: {printer} printed nothing; give a .html name instead")
        with replacing(path) as stream, made.open("rb") as file:
            shutil.copyfileobj(file, stream)


def _command(printer: str, page: Path, made: Path, folder: Path) -> list[str]:
    if Path(printer).name == _WEASYPRINT:
        return [printer, str(page), str(made)]
    # The page runs nothing; the browser's sandbox cannot be had by root.
    is_root = hasattr(os, "geteuid") and os.geteuid() == 0
    return [
        printer, "--headless", "--disable-gpu", *(["--no-sandbox"] if is_root else []),
        f"--user-data-dir={folder / 'profile'}", "--host-resolver-rules=MAP * ~NOTFOUND",
        "--no-pdf-header-footer", f"--print-to-pdf={made}", page.resolve().as_uri(),
    ]  # fmt: skip


def _run(command: list[str]) -> None:
    try:
        done = subprocess.run(command, capture_output=True, timeout=_LONGEST_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise LashbenchError(f"{command[0]} did not print the report ({error})") from error
    if done.returncode != 0:
        said = " ".join(done.stderr.decode("utf-8", "replace").split())[-200:]
        raise LashbenchError(f"{command[0]} did not print the report ({said})")
