"""From bytes to message units and their arguments: the lexical half of the language.

Owns the cutting of a byte stream into units at ``;`` and at the end of a
message, past strings and binary blocks, and the reading of arguments. It
knows no command.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from sim.analyser35670a.errors import ScpiError

__all__ = ["Argument", "Assembler", "Unit", "read_arguments", "split_header"]

LONGEST_UNIT = 1_000_000
"""Bytes after which a unit is refused, so that no client can fill the memory."""

_NUMBER = re.compile(
    rb"([+-]?(?:\d+\.?\d*|\.\d+)(?:\s*[eE]\s*[+-]?\d+)?)\s*([A-Za-z/][A-Za-z0-9/]*)?"
)
_WORD = re.compile(rb"[A-Za-z][A-Za-z0-9_/]*:?")
_HEADER = re.compile(rb"(?:\*[A-Za-z]+|:?[A-Za-z][A-Za-z0-9_]*(?::[A-Za-z][A-Za-z0-9_]*)*)\??")
_BLANKS = bytes(set(range(33)) - {10})


@dataclass(frozen=True, slots=True)
class Unit:
    """One command or query, without terminator; `last` if the message ends with it."""

    text: bytes
    last: bool


@dataclass(frozen=True, slots=True)
class Argument:
    """One parameter: a number with its suffix, a word, a string, a block or ``(an expression)``."""

    kind: Literal["number", "word", "string", "block", "expression"]
    text: str = ""
    number: float = 0.0
    suffix: str = ""
    data: bytes = b""


class Assembler:
    """Collects bytes until a unit is complete."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forget everything, as a device clear does."""
        self._text = bytearray()
        self._quote = 0
        self._block_left = 0
        self._block_digits: bytearray | None = None
        self._block_header_left = 0
        self._indefinite = False
        self._in_message = False
        self._overflowed = False

    @property
    def in_message(self) -> bool:
        """Whether a message has begun and not ended."""
        return self._in_message

    def feed(self, byte: int, end: bool) -> Unit | None:
        """Take one byte, `end` if EOI came with it; a unit if that completes one."""
        if not self._in_message:
            if byte == 10 or byte in _BLANKS:
                return None
            self._in_message = True
        if self._in_block(byte):
            return self._finish(True) if end else None
        if self._quote:
            if byte == self._quote:
                self._quote = 0
            elif byte == 10:
                return self._finish(True)
        elif byte in b"'\"":
            self._quote = byte
        elif byte == 10:
            return self._finish(True)
        elif byte == 59:
            return self._finish(end)
        elif byte == 35 and self._text[-1:] in (b" ", b",", b"\t"):
            self._block_header_left = 1
            self._block_digits = None
        self._keep(byte)
        return self._finish(True) if end else None

    def _in_block(self, byte: int) -> bool:
        """Take a byte that belongs to a block, whatever it is."""
        if self._indefinite:
            # Only EOI ends it, and a line feed that comes with EOI.
            self._keep(byte)
            return True
        if self._block_left:
            self._block_left -= 1
            self._keep(byte)
            return True
        if not self._block_header_left:
            return False
        if not 48 <= byte <= 57:
            self._block_header_left = 0
            return False
        self._keep(byte)
        self._block_header_left -= 1
        if self._block_digits is None:
            self._block_digits = bytearray()
            self._block_header_left = byte - 48
            self._indefinite = byte == 48
        else:
            self._block_digits.append(byte)
            if not self._block_header_left:
                self._block_left = int(self._block_digits)
        return True

    def _keep(self, byte: int) -> None:
        if len(self._text) < LONGEST_UNIT:
            self._text.append(byte)
        else:
            self._overflowed = True

    def _finish(self, last: bool) -> Unit:
        text, overflowed = bytes(self._text), self._overflowed
        self.clear()
        self._in_message = not last
        return Unit(b"" if overflowed else text, last)


def split_header(text: bytes) -> tuple[str, bytes]:
    """Header of a unit in upper case, and what follows it.

    Raises
    ------
    ScpiError
        -113 if it does not begin with a header followed by white space.
    """
    stripped = text.strip(_BLANKS + b"\n")
    match = _HEADER.match(stripped)
    if match is None or (match.end() < len(stripped) and stripped[match.end()] not in _BLANKS):
        raise ScpiError(-113)
    return match.group().decode("ascii").upper(), stripped[match.end() :].lstrip(_BLANKS)


def read_arguments(text: bytes) -> list[Argument]:
    """Arguments between commas.

    Raises
    ------
    ScpiError
        -151 for a broken string, -161 for a broken block, -120 for anything
        that is no argument at all.
    """
    arguments: list[Argument] = []
    rest = text.strip(_BLANKS) if not text.startswith(b"#") else text
    while rest:
        argument, rest = _read_one(rest)
        arguments.append(argument)
        rest = rest.lstrip(_BLANKS)
        if not rest:
            break
        if not rest.startswith(b","):
            raise ScpiError(-120)
        rest = rest[1:].lstrip(_BLANKS)
        if not rest:
            raise ScpiError(-109)
    return arguments


def _read_one(text: bytes) -> tuple[Argument, bytes]:
    if text[:1] in (b"'", b'"'):
        return _read_string(text)
    if text.startswith(b"#"):
        return _read_block(text)
    if text.startswith(b"("):
        return _read_expression(text)
    if match := _NUMBER.match(text):
        digits, suffix = match.group(1), match.group(2) or b""
        number = float(bytes(digits).translate(None, b" \t"))
        return (
            Argument("number", digits.decode(), number, suffix.decode().upper()),
            text[match.end() :],
        )
    if match := _WORD.match(text):
        return Argument("word", match.group().decode().upper()), text[match.end() :]
    raise ScpiError(-120)


def _read_expression(text: bytes) -> tuple[Argument, bytes]:
    """Up to the parenthesis that closes the first one."""
    depth = 0
    for at, byte in enumerate(text):
        depth += {40: 1, 41: -1}.get(byte, 0)
        if not depth:
            inner = bytes(text[: at + 1])
            return Argument("expression", inner.decode("latin-1").upper()), text[at + 1 :]
    raise ScpiError(-120)


def _read_string(text: bytes) -> tuple[Argument, bytes]:
    quote = text[:1]
    content = bytearray()
    at = 1
    while True:
        close = text.find(quote, at)
        if close < 0:
            raise ScpiError(-151)
        content += text[at:close]
        if text[close + 1 : close + 2] != quote:
            return Argument("string", content.decode("latin-1")), text[close + 1 :]
        content += quote
        at = close + 2


def _read_block(text: bytes) -> tuple[Argument, bytes]:
    if not text[1:2].isdigit():
        raise ScpiError(-161)
    digits = int(text[1:2])
    if digits == 0:
        return Argument("block", data=text[2:].removesuffix(b"\n")), b""
    if not text[2 : 2 + digits].isdigit() or len(text) < 2 + digits:
        raise ScpiError(-161)
    begin = 2 + digits
    length = int(text[2:begin])
    if len(text) < begin + length:
        raise ScpiError(-161)
    return Argument("block", data=text[begin : begin + length]), text[begin + length :]
