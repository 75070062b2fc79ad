"""Reading a binary file in a child process, where a crash, a bomb or a loop costs nothing.

Owns the child, its limits on memory, processor time and output, and what passes between: plain
arrays and one JSON text. Libraries that read binary formats can crash on damaged files; no such
library reads a file in the process that may drive a bench.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from threading import Timer
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError, InputError, LashbenchError
from daq.formats.reading import NOTHING_TOLD, Reading
from daq.formats.record import ARRAYS, response_from, taken_apart
from daq.frf import FrequencyResponse
from daq.untrusted.child import child_command, child_environment

__all__ = ["main", "read_apart", "read_arrays_apart"]

_MEMORY_BYTES = 2 << 30
_PROCESSOR_S = 60
_OUTPUT_BYTES = 512 << 20
"""A million rows are 97 MB, the largest document 64 MB."""
_ADVICE = "it is damaged or made to harm; give another copy, or a CSV"


def read_apart(
    module: str, path: Path, reading: Reading = NOTHING_TOLD, *, clock_s: float = 180.0
) -> FrequencyResponse:
    """What `read` of a format's module makes of a file, read in a child process.

    Parameters
    ----------
    module
        Full name of the format's module, such as ``daq.formats.mat``.
    reading
        What the file does not say itself.
    clock_s
        When the child is ended, s.

    Raises
    ------
    FileFormatError
        If the module refuses the file, or the child crashed or ran into a limit.
    InputError
        If no child can be started.
    """
    head, rest = _answer_of(module, path, reading, clock_s)
    if "refused" in head:
        raise FileFormatError(head["refused"])
    arrays: dict[str, Any] = {}
    for name, dtype in ARRAYS.items():
        size = head["rows"] * np.dtype(dtype[0]).itemsize
        arrays[name], rest = np.frombuffer(rest[:size], dtype[0]).copy(), rest[size:]
    return response_from(arrays, head["document"], path)


def read_arrays_apart(
    module: str, path: Path, *, clock_s: float = 180.0
) -> dict[str, NDArray[np.float64]]:
    """Named vectors that `read` of a module finds in a file, read in a child process.

    Raises
    ------
    FileFormatError
        If the module refuses the file, or the child crashed or ran into a limit.
    InputError
        If no child can be started.
    """
    head, rest = _answer_of(module, path, NOTHING_TOLD, clock_s)
    if "refused" in head:
        raise FileFormatError(head["refused"])
    arrays = {}
    for name, size in head["vectors"]:
        arrays[name], rest = np.frombuffer(rest[: 8 * size]).copy(), rest[8 * size :]
    return arrays


def _answer_of(
    module: str, path: Path, reading: Reading, clock_s: float
) -> tuple[dict[str, Any], memoryview]:
    try:
        child = subprocess.Popen(
            child_command("daq.formats.apart", module, str(path), reading.to_json()),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            # Each thread of linear algebra reserves memory, and there is nothing to calculate.
            env=child_environment(OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1"),
            # Ctrl-C in the terminal is for us, who end the child.
            start_new_session=True,
        )
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            f"{path}: the process that reads it cannot be started ({reason})"
        ) from error
    late = Timer(clock_s, child.kill)
    late.daemon = True
    late.start()
    assert child.stdout is not None
    try:
        answer = child.stdout.read(_OUTPUT_BYTES + 1)
        child.stdout.close()
        child.wait()
    except BaseException:
        child.kill()
        child.wait()
        raise
    finally:
        late.cancel()
    line, found, rest = answer.partition(b"\n")
    if child.returncode or not found:
        raise FileFormatError(f"{path}: cannot be read ({_ending(child.returncode)}); {_ADVICE}")
    head: dict[str, Any] = json.loads(line)
    return head, memoryview(rest)


def _ending(code: int) -> str:
    """How a child ended that gave no answer."""
    if code in (-signal.SIGKILL, -getattr(signal, "SIGXCPU", 0)):
        return "it took too long"
    if code < 0:
        with suppress(ValueError):
            return f"the library that reads it crashed, {signal.Signals(-code).name}"
    return f"the process that reads it ended with code {code}"


def main(words: list[str]) -> int:
    """Read one file and write what it holds to stdout.

    Parameters
    ----------
    words
        Name of the format's module, path of the file, and perhaps a `Reading` as JSON.
    """
    module, path, *told = words
    _limit()
    try:
        reading = Reading.from_json(told[0]) if told else NOTHING_TOLD
        response = import_module(module).read(Path(path), reading)
        if not isinstance(response, FrequencyResponse):
            return _say_vectors(response)
        arrays, document = taken_apart(response, Path(path))
    except LashbenchError as error:
        return _say(refused=str(error))
    except MemoryError:
        return _say(
            refused=f"{path}: cannot be read (it unpacks to more than any response); {_ADVICE}"
        )
    except Exception as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
    else:
        _say(rows=len(response), document=document)
        for values in arrays.values():
            sys.stdout.buffer.write(values.tobytes())
        return 0
    return _say(refused=f"{path}: cannot be read ({reason}); {_ADVICE}")


def _say(**head: Any) -> int:
    sys.stdout.buffer.write(json.dumps(head).encode("ascii") + b"\n")
    return 0


def _say_vectors(vectors: dict[str, NDArray[np.float64]]) -> int:
    _say(vectors=[(name, values.size) for name, values in vectors.items()])
    for values in vectors.values():
        sys.stdout.buffer.write(np.ascontiguousarray(values, dtype=float).tobytes())
    return 0


def _limit() -> None:
    """Bound what this process may take; a system without such bounds has the clock's alone."""
    try:
        import resource
    except ImportError:
        return
    for kind, most in (
        (resource.RLIMIT_AS, _MEMORY_BYTES),
        (resource.RLIMIT_CPU, _PROCESSOR_S),
        (resource.RLIMIT_FSIZE, 0),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(kind)[1]
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        with suppress(OSError, ValueError):
            resource.setrlimit(kind, (most, most))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
