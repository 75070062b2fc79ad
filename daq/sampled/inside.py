"""The wire to a converter that is driven by this program itself: no wire at all.

Owns the `Transport` over an interpreter, and the options of a device's address.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from urllib.parse import parse_qsl, unquote

from daq.errors import BenchTimeout, ConfigurationError, LinkError, ProtocolError
from daq.sampled.converter import Converter, Interpreter
from daq.transports.base import Deadline, block_of, checked_line

__all__ = ["InsideTransport", "device_and_options"]


def device_and_options(scheme: str, rest: str, known: dict[str, str]) -> tuple[str, dict[str, str]]:
    """Device and options of ``scheme:DEVICE?name=value``; `known` has the presets.

    Raises
    ------
    ConfigurationError
        If an option is not known, comes twice, or has no preset and was left out.
    """
    place, _, query = rest.partition("?")
    try:
        pairs = parse_qsl(query, keep_blank_values=True, strict_parsing=bool(query))
    except ValueError as error:
        raise ConfigurationError(f"{scheme}:{rest} has nothing readable after '?'") from error
    given = dict(pairs)
    wrong = sorted(set(given) - set(known))
    if wrong or len(given) < len(pairs):
        raise ConfigurationError(
            f"{scheme}:{rest}: {', '.join(wrong) or 'an option'} is not known or comes twice; "
            f"options are {', '.join(known)}"
        )
    options = known | given
    if missing := [name for name, value in options.items() if not value]:
        raise ConfigurationError(f"{scheme}:{rest}: {', '.join(missing)} must be given")
    return unquote(place), options


class InsideTransport:
    """Messages to an interpreter in this process; see `Transport`.

    Parameters
    ----------
    close
        Lets the device go.
    alive
        Raises `LinkError` where the device is gone.
    """

    def __init__(
        self,
        converter: Converter,
        address: str,
        close: Callable[[], None],
        alive: Callable[[], None],
    ) -> None:
        self.address = address
        self._interpreter = Interpreter(converter)
        self._let_go, self._alive = close, alive
        self._is_open = True
        self._reply: bytes | None = None
        self._waiting = "nothing"

    def write(self, line: str, deadline: Deadline) -> None:
        """Execute one message."""
        data = checked_line(line)
        if not self._is_open:
            raise LinkError(f"{self.address}: is closed")
        self._alive()
        self._waiting = line
        self._reply = self._interpreter.run(data)

    def _message(self, deadline: Deadline) -> bytes:
        if not self._is_open:
            raise LinkError(f"{self.address}: is closed")
        reply, self._reply = self._reply, None
        if reply is None:
            raise BenchTimeout(f"{self.address}: {self._waiting!r} has no answer")
        return reply

    def read(self, deadline: Deadline) -> str:
        """One text reply, without terminator."""
        return self._message(deadline).decode("ascii").strip()

    def read_block(self, deadline: Deadline) -> bytes:
        """The payload of one definite-length block."""
        return block_of(self._message(deadline), f"{self.address}: the answer to {self._waiting!r}")

    def read_bytes(self, count: int, deadline: Deadline) -> bytes:
        """A reply of so many bytes."""
        message = self._message(deadline)
        if len(message) != count:
            raise ProtocolError(f"{self.address}: {len(message)} bytes came, {count} were due")
        return message

    def serial_poll(self, deadline: Deadline) -> None:
        """None: there is no such thing here."""

    def device_clear(self, deadline: Deadline) -> bool:
        """Forget a reply."""
        self._reply = None
        return True

    def pause(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(seconds)

    def close(self) -> None:
        """Let the device go; its output falls silent with it."""
        if self._is_open:
            self._is_open = False
            self._let_go()
