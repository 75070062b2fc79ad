"""The command that a line runs for each result: a label printer, a mail, a web hook.

Owns how it is started and how long it may take. It gets the result as one JSON document on its
standard input. It runs while the source is off, without a shell, and its failure changes nothing.
"""

from __future__ import annotations

import os
import shlex
import shutil
import signal
import subprocess
from contextlib import suppress

from daq.errors import InputError

__all__ = ["Hook"]

_LONGEST_S = 30.0
_MOST_TOLD = 200


class Hook:
    """A command for results.

    Parameters
    ----------
    command
        Program and its arguments, as in a shell, but run without one.

    Raises
    ------
    InputError
        If it is none, or the program is not there.
    """

    def __init__(self, command: str) -> None:
        try:
            self._words = shlex.split(command)
        except ValueError as error:
            raise InputError(f"--on-result {command!r} is no command ({error})") from error
        if not self._words:
            raise InputError("--on-result is empty; give a command, or leave it out")
        if shutil.which(self._words[0]) is None:
            raise InputError(
                f"--on-result: the program {self._words[0]!r} was not found; give its path"
            )

    def run(self, document: str, bound_s: float = _LONGEST_S) -> str:
        """Run it with a result; what went wrong, in one line, empty if nothing did."""
        try:
            process = subprocess.Popen(
                self._words, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE, start_new_session=True,
            )  # fmt: skip
        except OSError as error:
            return f"it could not be started ({error.strerror})"
        try:
            _, said = process.communicate(f"{document}\n".encode(), timeout=bound_s)
        except subprocess.TimeoutExpired:
            _end(process)
            return f"it took longer than {bound_s:g} s and was ended"
        except BaseException:
            _end(process)
            raise
        if process.returncode == 0:
            return ""
        words = " ".join(said.decode("utf-8", "replace").split())[-_MOST_TOLD:]
        return f"it ended with {process.returncode}" + (f": {words}" if words else "")


def _end(process: subprocess.Popen[bytes]) -> None:
    """End it and what it started."""
    with suppress(OSError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    for stream in (process.stdin, process.stderr):
        if stream is not None:
            with suppress(OSError):
                stream.close()
