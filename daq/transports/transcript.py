"""A dialogue on file: recording what crosses a wire, and answering from such a record.

Owns the transcript format, one JSON object a line, each on disk before the
call returns. `Recorder` adds nothing to the dialogue and hides nothing of it;
`Replay` answers the recorded dialogue and no other, and says at which line
and how a dialogue departs from it.
"""

from __future__ import annotations

import base64
import json
import logging
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TextIO, TypeVar

from daq import errors
from daq.errors import FileFormatError, InputError, LashbenchError, ProtocolError
from daq.transports.base import Deadline, Transport
from daq.untrusted.bounded_calls import Aside, NoReturn
from daq.untrusted.bounded_text import parse_json, read_text

__all__ = ["Recorder", "Replay"]

_LOG = logging.getLogger("lashbench.transcript")

_VERSION = 1
_ANSWER_S = 5.0
"""Bound of one write of a transcript; the dialogue goes on without it then."""
_LIMIT_BYTES = 256 << 20
_RAISED = {name: getattr(errors, name) for name in errors.__all__}
_Result = TypeVar("_Result")


class Recorder:
    """A transport that writes down everything that passes through it.

    Parameters
    ----------
    transport
        The wire; closed with the recorder.
    path
        New file; an existing one is refused, since a transcript is evidence.
    fault
        Where to say that the file takes no more: the dialogue goes on without it, as a source that
        drives must be made safe over it.

    Raises
    ------
    InputError
        If the file exists or cannot be written.
    """

    def __init__(
        self, transport: Transport, path: Path, fault: Callable[[str], None] | None = None
    ) -> None:
        self._transport = transport
        self._path, self._tell = path, fault or _LOG.warning
        self.address = transport.address
        self._started_s = time.monotonic()
        # Beside: a file system that stops answering must not hold a dialogue with a source.
        self._aside = Aside("transcript")
        try:
            self._file: TextIO = self._aside.call(
                lambda: path.open("x", encoding="ascii", newline="\n"), _ANSWER_S
            )
        except (OSError, NoReturn) as error:
            raise InputError(
                f"{path}: the transcript cannot be written ({_why(error)}); give a new file"
            ) from error
        self._acts, self._is_over = -1, False
        self._note({"transcript": _VERSION, "address": self.address, "started": _now()})

    @property
    def lacks(self) -> list[str]:
        """What the wire turned out not to have, in words."""
        return list(getattr(self._transport, "lacks", ()))

    def write(self, line: str, deadline: Deadline) -> None:
        """Send one message."""
        self._record("write", lambda: self._transport.write(line, deadline), line=line)

    def read(self, deadline: Deadline) -> str:
        """One text reply."""
        return self._record("read", lambda: self._transport.read(deadline))

    def read_block(self, deadline: Deadline) -> bytes:
        """The payload of one block."""
        return self._record("block", lambda: self._transport.read_block(deadline))

    def read_bytes(self, count: int, deadline: Deadline) -> bytes:
        """A reply of so many bytes."""
        return self._record("bytes", lambda: self._transport.read_bytes(count, deadline))

    def serial_poll(self, deadline: Deadline) -> int | None:
        """The status byte."""
        return self._record("poll", lambda: self._transport.serial_poll(deadline))

    def device_clear(self, deadline: Deadline) -> bool:
        """Clear the instrument."""
        return self._record("clear", lambda: self._transport.device_clear(deadline))

    def pause(self, seconds: float) -> None:
        """Let time pass; not part of the dialogue."""
        self._transport.pause(seconds)

    def close(self) -> None:
        """Close the wire and the file."""
        self._transport.close()
        self._close_file()

    def _record(self, act: str, call: Callable[[], _Result], **asked: str) -> _Result:
        entry: dict[str, Any] = {"act": act, **asked}
        try:
            result = call()
        except LashbenchError as error:
            self._note(entry | {"raised": type(error).__name__, "message": str(error)})
            raise
        if isinstance(result, bytes):
            self._note(entry | {"base64": base64.b64encode(result).decode("ascii")})
        elif result is not None or act == "poll":
            self._note(entry | {"gave": result})
        else:
            self._note(entry)
        return result

    def _note(self, entry: dict[str, Any]) -> None:
        if self._is_over:  # closed while a last attempt to go safe is still under way
            return
        line = json.dumps(entry | {"t_s": round(time.monotonic() - self._started_s, 6)})

        def write() -> None:
            self._file.write(f"{line}\n")
            self._file.flush()

        try:
            self._aside.call(write, _ANSWER_S)
        except (OSError, NoReturn) as error:
            self._close_file()
            self._tell(
                f"{self._path}: the transcript ends after {self._acts} acts ({_why(error)}); "
                "the measurement goes on without"
            )
        else:
            self._acts += 1

    def _close_file(self) -> None:
        if self._is_over:
            return
        self._is_over = True
        # What is left in the buffer cannot be written either.
        if not self._aside.is_stuck:
            with suppress(OSError, NoReturn):
                self._aside.call(self._file.close, _ANSWER_S)
        self._aside.end()


def _why(error: OSError | NoReturn) -> str:
    if isinstance(error, NoReturn):
        return f"it does not answer within {_ANSWER_S:g} s"
    return error.strerror or str(error)


class Replay:
    """A transport that answers from a transcript, without an instrument and without waiting.

    Parameters
    ----------
    path
        Written by a `Recorder`.

    Raises
    ------
    FileFormatError
        If the file is no transcript, or any line of it is damaged; a last line
        that was cut off by a crash is left out.
    """

    def __init__(self, path: Path) -> None:
        self.address = f"replay:{path}"
        self._path = path
        self.recorded_address, self._entries = _recording(path)
        """Where the instrument was when the dialogue was recorded."""
        self._next = 0

    def write(self, line: str, deadline: Deadline) -> None:
        """Compare with the record; nothing is sent."""
        self._answer("write", line)

    def read(self, deadline: Deadline) -> str:
        """The recorded text reply."""
        return str(self._answer("read"))

    def read_block(self, deadline: Deadline) -> bytes:
        """The recorded block."""
        answer = self._answer("block")
        return answer if isinstance(answer, bytes) else b""

    def read_bytes(self, count: int, deadline: Deadline) -> bytes:
        """The recorded reply of so many bytes."""
        answer = self._answer("bytes")
        return answer if isinstance(answer, bytes) else b""

    def serial_poll(self, deadline: Deadline) -> int | None:
        """The recorded status byte."""
        answer = self._answer("poll")
        return answer if isinstance(answer, int) else None

    def device_clear(self, deadline: Deadline) -> bool:
        """What the recorded clear did."""
        return bool(self._answer("clear"))

    def pause(self, seconds: float) -> None:
        """Time does not pass in a replay."""

    def close(self) -> None:
        """Nothing to let go of."""

    @property
    def unused(self) -> int:
        """How many recorded acts have not been asked for yet."""
        return len(self._entries) - self._next

    def _answer(self, act: str, line: str | None = None) -> Any:
        asked = act if line is None else f"{act} {line!r}"
        if self._next >= len(self._entries):
            raise ProtocolError(
                f"{self._path}: the recording ends after {len(self._entries)} acts, "
                f"but the dialogue goes on with {asked}"
            )
        number, entry = self._entries[self._next]
        recorded = entry["act"] if "line" not in entry else f"{entry['act']} {entry['line']!r}"
        if recorded != asked:
            raise ProtocolError(
                f"{self._path}, line {number}: the recording has {recorded}, "
                f"the dialogue has {asked}; it departs here"
            )
        self._next += 1
        if "raised" in entry:
            raise _RAISED[entry["raised"]](entry["message"])
        if "base64" in entry:
            return base64.b64decode(entry["base64"], validate=True)
        return entry.get("gave")


_GIVES: dict[str, tuple[type, ...]] = {
    "write": (),
    "read": (str,),
    "block": (bytes,),
    "bytes": (bytes,),
    "poll": (int, type(None)),
    "clear": (bool,),
}


def _recording(path: Path) -> tuple[str, list[tuple[int, dict[str, Any]]]]:
    """The address in the first line, and the acts with the lines they stand on."""
    try:
        text = read_text(path, _LIMIT_BYTES, "ascii")
    except (OSError, ValueError) as error:
        raise FileFormatError(f"{path}: cannot be read as a transcript ({error})") from error
    lines = text.splitlines(keepends=True)
    if lines and not lines[-1].endswith("\n"):
        lines.pop()  # the recording process was killed while it wrote this line
    documents = [(number, _document(path, number, line)) for number, line in enumerate(lines, 1)]
    if not documents or documents[0][1].get("transcript") != _VERSION:
        raise FileFormatError(
            f'{path}: is not a transcript; its first line should hold "transcript": {_VERSION}'
        )
    for number, entry in documents[1:]:
        _check(path, number, entry)
    return str(documents[0][1].get("address", "")), documents[1:]


def _document(path: Path, number: int, line: str) -> dict[str, Any]:
    try:
        document = parse_json(line)
    except ValueError as error:
        raise FileFormatError(f"{path}, line {number}: is not JSON ({error})") from error
    if not isinstance(document, dict):
        raise FileFormatError(f"{path}, line {number}: is not a JSON object")
    return document


def _check(path: Path, number: int, entry: dict[str, Any]) -> None:
    act = entry.get("act")
    if act not in _GIVES or (act == "write") != isinstance(entry.get("line"), str):
        raise FileFormatError(f"{path}, line {number}: holds no act that a transcript knows")
    if "raised" in entry:
        if entry["raised"] not in _RAISED or not isinstance(entry.get("message"), str):
            raise FileFormatError(f"{path}, line {number}: holds no error that lashbench knows")
        return
    if act in ("block", "bytes"):
        try:
            base64.b64decode(entry["base64"], validate=True)
        except (KeyError, TypeError, ValueError) as error:
            raise FileFormatError(f"{path}, line {number}: holds no {act}") from error
    elif act != "write" and not isinstance(entry.get("gave", ...), _GIVES[act]):
        raise FileFormatError(f"{path}, line {number}: holds no answer to a {act}")


def _now() -> str:
    from datetime import UTC, datetime

    return datetime.now(UTC).isoformat(timespec="seconds")
