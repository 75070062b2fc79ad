"""The folder of a first day: report and transcript, written as it goes.

Owns their names, and that a folder which was made for nothing does not stay. An earlier report is
never written over.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from daq.errors import InputError
from daq.formats.atomic import write_text

__all__ = ["Folder"]


class Folder:
    """A folder that is made if it is not there; use it as a context manager.

    Raises
    ------
    InputError
        If it holds a report or a transcript already, or cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self.transcript = path / "transcript.jsonl"
        self.report = path / "report.md"
        self.history = path / "first-day.db"
        """Only a name: the bench's lock is made beside it."""
        for file in (self.report, self.transcript):
            if file.exists() or file.is_symlink():
                raise InputError(
                    f"{file} is there already, of an earlier first day; nothing was sent: give "
                    "another folder with --out, or move it away"
                )
        self._made: list[Path] = []
        missing = [one for one in (path, *path.parents) if not one.exists()]
        for one in reversed(missing):
            try:
                one.mkdir()
            except OSError as error:
                self._undo()
                raise InputError(f"{path}: cannot be made ({error.strerror})") from error
            self._made.append(one)
        if not path.is_dir():
            raise InputError(f"{path}: is not a folder; give another one with --out")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Take away what tells nothing: the folder of a run that reached no instrument."""
        if not self.report.exists():
            with suppress(OSError):
                self.transcript.unlink()
            self._undo()

    def write(self, text: str) -> None:
        """Replace the report, whole."""
        write_text(self.report, text)

    def _undo(self) -> None:
        # Those that hold something, of whomever, stay.
        with suppress(OSError):
            for one in reversed(self._made):
                one.rmdir()
