"""The interrupt channel of a VXI-11 gateway: calls to the client, one way, no answers.

Owns one connection to the port on which a client listens, and the calls for service requests.
It connects to nobody but the machine that asked for it, and never waits.
"""

from __future__ import annotations

import errno
import os
import socket
from contextlib import suppress

from daq.transports.rpc import Arguments, opaque, packed_call, words

__all__ = ["NOT_ESTABLISHED", "InterruptChannel", "channel_to"]

NOT_ESTABLISHED = 6
_NOT_SUPPORTED = 8
_TCP = 0

_SERVICE_REQUEST = 30
_MOST_UNHEARD = 1 << 16


class InterruptChannel:
    """A connection to a client's interrupt server; OSError if it cannot be made.

    Parameters
    ----------
    place
        Host and port of the client's server.
    program
        Number of the program that the client serves.
    """

    def __init__(self, place: tuple[str, int], program: int) -> None:
        self._wire = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._wire.setblocking(False)
        self._program = program
        self._number = 0
        self._out = bytearray()
        self.closed = False
        error = self._wire.connect_ex(place)
        if error not in (0, errno.EINPROGRESS):
            self.close()
            raise OSError(error, os.strerror(error))

    def request_service(self, handle: bytes) -> None:
        """Tell the client that the instrument of a link requests service."""
        self._number += 1
        self._out += packed_call(self._number, self._program, _SERVICE_REQUEST, opaque(handle))

    def flush(self) -> None:
        """Send what can be sent; a client that takes nothing is given up."""
        try:
            while self._out and not self.closed:
                del self._out[: self._wire.send(self._out)]
        except OSError as error:
            # A connection that is not made yet refuses to send, too.
            waits = error.errno in (errno.EAGAIN, errno.ENOTCONN)
            if not waits or len(self._out) > _MOST_UNHEARD:
                self.close()

    def close(self) -> None:
        """Hang up; may be called twice."""
        self.closed = True
        self._out.clear()
        with suppress(OSError):
            self._wire.close()


def channel_to(client: str, given: Arguments) -> tuple[InterruptChannel | None, int]:
    """The channel that a client asks for, or None, and the error of VXI-11.

    Parameters
    ----------
    client
        Address of who asks: a channel goes to nobody else.
    given
        Arguments of ``create_intr_chan``.
    """
    host, port, program, version, family = (given.whole() for _ in range(5))
    if family != _TCP or version != 1:
        return None, _NOT_SUPPORTED
    if socket.inet_ntoa(words(host)) != client or not 0 < port < 65536:
        return None, NOT_ESTABLISHED
    try:
        return InterruptChannel((client, port), program), 0
    except OSError:
        return None, NOT_ESTABLISHED
