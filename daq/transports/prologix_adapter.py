"""The adapter side of a Prologix-like GPIB controller: dialects, escaping, its own commands.

Owns the conversation with the adapter itself (lines that start with ``++``):
finding out which one it is before anything could be written to its memory,
setting it up and reading that back. It sends nothing to the instrument.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from daq.errors import LinkError, ProtocolError
from daq.transports.base import Deadline
from daq.transports.inbox import Inbox
from daq.transports.links import Link

__all__ = ["AR488", "OTHER", "PROLOGIX", "Adapter", "Dialect", "dialect_of", "escape"]

READ_TIMEOUT_MS = 500
"""How long the adapter itself waits for a byte from the instrument. Short, since a reply that
is late stays in the instrument and is asked for again; no adapter allows more than 3 s."""

MARGIN_S = 0.5
"""How much longer the host waits than the adapter: two time-outs must not cross."""

_ESCAPED = re.compile(rb"([\r\n\x1b+])")
_PATIENCE_S = 1.5
"""Wait for one answer of the adapter; an Arduino that resets on opening is deaf for about 2 s."""

_ASK_AGAIN_S = 0.4
"""Wait for a version text before it is asked for again: an adapter that starts hears nothing."""

_QUIET_S = 0.1
"""Silence after which an adapter is taken to have said all."""


def escape(message: bytes) -> bytes:
    """Protect CR, LF, ESC and ``+`` from the adapter by an ESC before each."""
    return _ESCAPED.sub(b"\x1b\\1", message)


@dataclass(frozen=True, slots=True)
class Dialect:
    """How one kind of adapter differs from the others."""

    name: str
    saves_on_change: bool
    """``++savecfg 0`` stops it from wearing its memory out. On an AR488 the same
    line *writes* the memory, so it is sent only where it is known to help."""
    echoes: bool
    """It may be in a verbose mode that echoes, and may answer ``*idn?`` itself."""


PROLOGIX = Dialect("Prologix", saves_on_change=True, echoes=False)
AR488 = Dialect("AR488", saves_on_change=False, echoes=True)
OTHER = Dialect("other", saves_on_change=False, echoes=False)


def dialect_of(version: str) -> Dialect | None:
    """The dialect that a version text gives away, None if it is no version text."""
    if "prologix" in version.lower():
        return PROLOGIX
    if "ar488" in version.lower():
        return AR488
    if "gpib" in version.lower() and any(sign.isdigit() for sign in version):
        return OTHER
    return None


class Adapter:
    """A Prologix-like adapter on a link, set up for one instrument address.

    Parameters
    ----------
    link
        The open pipe to it.
    gpib_address
        Primary address of the instrument, 0 to 30.
    deadline
        Bound of finding and setting it up.

    Attributes
    ----------
    inbox
        What came from it and was not taken.

    Raises
    ------
    LinkError
        If nothing that names itself a GPIB adapter answers ``++ver``, or a
        setting does not read back.
    """

    def __init__(self, link: Link, gpib_address: int, deadline: Deadline) -> None:
        self.link = link
        self.gpib_address = gpib_address
        self.inbox = Inbox(link, "a GPIB adapter")
        self._versions_due = 0
        self.version = ""
        self.version, self.dialect = self._find(deadline)
        self.set_up(deadline)

    # Bytes

    def send(self, data: bytes, deadline: Deadline) -> None:
        """Send one line, which is already escaped where it has to be."""
        self.link.send(data + b"\n", deadline)

    # The adapter's own commands

    def ask(self, command: str, deadline: Deadline) -> str | None:
        """One line of answer to an adapter command, None if it stays silent."""
        self.send(command.encode("ascii"), deadline)
        line = self._next_line(deadline)
        while line is not None and self._is_late(line):
            line = self._next_line(deadline)
        return line

    def taken_reply(self) -> bytes | None:
        """The next line of what the instrument said, None if none is whole yet.

        An adapter that was held up by the instrument answers an older `resynchronise` after that
        was given up. Its version is no reply of an instrument, and is dropped.
        """
        line = self.inbox.taken_line()
        while line is not None and self._is_late(_text(line)):
            line = self.inbox.taken_line()
        return line

    def lying(self) -> bytes:
        """What came and was not asked for, dropped here; empty if there is nothing."""
        lines = self.inbox.emptied().replace(b"\0", b"").split(b"\n")
        lying = b"\n".join(line for line in lines if not self._is_late(_text(line)))
        return lying if lying.strip() else b""

    def _is_late(self, line: str) -> bool:
        return bool(self.version) and line.endswith(self.version)

    def resynchronise(self, deadline: Deadline) -> bool:
        """Drop everything up to the adapter's own version text; False if it stays silent.

        The adapter works its lines off in order, so nothing older can follow
        the answer to this question. Answers still owed to earlier ones count.
        One that is starting just then hears nothing, so it is asked again.
        """
        heard = False
        while not heard:
            self.send(b"++ver", deadline)
            self._versions_due += 1
            heard = self._hears_version(deadline)
            if deadline.expired:
                break
        if heard:
            self._versions_due = 0  # those of before a reset never come
        self.inbox.clear()
        return heard

    def _hears_version(self, deadline: Deadline) -> bool:
        """Whether a version text came; drops what came before it, and waits for those owed."""
        heard = False
        patience = deadline.within(_ASK_AGAIN_S)
        while self._versions_due:
            line = self._next_line(patience)
            if line is None:
                break
            # A cut reply without line feed stands before the version on the same line.
            if line.endswith(self.version):
                self._versions_due -= 1
                heard = True
                patience = deadline.within(_ASK_AGAIN_S)
            elif patience.expired:
                break  # it talks on and on
        return heard

    def has_forgotten(self, deadline: Deadline) -> bool:
        """Whether it lost its settings, as after a reset by its own power or cable."""
        wanted = {"++addr": str(self.gpib_address), "++auto": "0", "++mode": "1"}
        return any(
            (self.ask(command, deadline) or "").split(" ")[0] != value
            for command, value in wanted.items()
        )

    def set_up(self, deadline: Deadline) -> None:
        """Make it a silent controller for one address; every line is read back.

        Raises
        ------
        LinkError
            If a setting does not read back as sent.
        """
        if self.dialect.saves_on_change:
            self.send(b"++savecfg 0", deadline)
        self.send(b"++mode 1", deadline)
        settings = {
            "++mode": "1",
            "++auto": "0",
            "++eoi": "1",
            # A line feed ends each message. EOI alone is not enough: some firmware of the AR488
            # asserts it after the last byte, and the instrument would wait for the end.
            "++eos": "2",
            "++eot_enable": "0",
            "++read_tmo_ms": str(READ_TIMEOUT_MS),
            "++addr": str(self.gpib_address),
        }
        if self.dialect.echoes:
            settings["++idn"] = "0"
        for command, value in settings.items():
            if command != "++mode":  # repeated, it sends an AR488's instrument to local and back
                self.send(f"{command} {value}".encode("ascii"), deadline)
            answer = self.ask(command, deadline)
            if answer is None or answer.split(" ")[0] != value:
                raise LinkError(
                    f"{self.link.name}: adapter {self.version!r} was sent '{command} {value}' "
                    f"and reads back {answer!r}; is it the adapter that the URL means?"
                )

    def close(self) -> None:
        """Let go of the link."""
        self.link.close()

    def _next_line(self, deadline: Deadline) -> str | None:
        while (line := self.inbox.taken_line()) is None:
            if not self.inbox.gather(deadline):
                return None
        return _text(line)

    def _find(self, deadline: Deadline) -> tuple[str, Dialect]:
        """Ask for the version until two answers are of the kind; the first may be a greeting."""
        heard = ""
        while not deadline.expired:
            for _ in range(2):
                self.send(b"++ver", deadline)
                patience = deadline.within(_PATIENCE_S)
                line = self._next_line(patience)
                while line is not None and dialect_of(line) is None and not patience.expired:
                    heard, line = line, self._next_line(patience)
                if line is None:
                    break
                # Answers to a `++ver` that was sent while it was starting may still come.
                self._hear_out(deadline)
            dialect = None if line is None else dialect_of(line)
            if line is not None and dialect is not None:
                return self._settled(line, dialect, deadline)
        heard = heard or _text(self.inbox.emptied())
        raise LinkError(
            f"{self.link.name}: no GPIB adapter answered '++ver' within {deadline.span_s:g} s "
            f"({f'it said {heard[:60]!r}' if heard else 'silent'}); is it a Prologix, AR488 or "
            "alike, and is the port right?"
        )

    def _settled(self, version: str, dialect: Dialect, deadline: Deadline) -> tuple[str, Dialect]:
        # Any text may be stored in an AR488 as its version; `real` asks for the truth, and
        # other adapters answer it with a complaint or the same text again.
        if dialect is OTHER:
            truth = self.ask("++ver real", deadline.within(_PATIENCE_S))
            if truth is not None and dialect_of(truth) is AR488:
                dialect = AR488
            self._hear_out(deadline)
        if dialect.echoes:
            self._silence_echo(version, deadline)
        return re.sub(r"^(> ?)+", "", version), dialect

    def _silence_echo(self, version: str, deadline: Deadline) -> None:
        for _ in range(2):
            answer = self.ask("++addr", deadline.within(_PATIENCE_S)) or ""
            if answer.split(" ")[0].isdigit():
                return
            self.send(b"++verbose", deadline)  # a toggle: the echo shows that it was on
            self._hear_out(deadline)
        raise ProtocolError(
            f"{self.link.name}: adapter {version!r} echoes what it is sent and cannot be "
            "silenced; send it '++verbose' from a terminal program"
        )

    def _hear_out(self, deadline: Deadline) -> None:
        while self.inbox.gather(deadline.within(_QUIET_S)):
            pass
        self.inbox.clear()


def _text(line: bytes) -> str:
    # Stray NUL bytes have been seen from adapters; nothing else is forgiven.
    return line.replace(b"\0", b"").decode("ascii", errors="replace").strip()
