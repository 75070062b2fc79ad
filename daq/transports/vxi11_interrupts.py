"""The client's side of VXI-11's interrupt channel: a port on which a gateway calls.

Owns the port and the calls that come in on it; their handles are given out. It answers nothing,
because the specification has these calls go one way, and asks nobody to call.
"""

from __future__ import annotations

import socket
from contextlib import suppress

from daq.errors import LinkError
from daq.transports.base import Deadline
from daq.transports.rpc import Records, parse_call

__all__ = ["PROGRAM", "InterruptServer"]

PROGRAM = 0x0607B1
"""Number of the program that is served."""
_SERVICE_REQUEST = 30
_CHUNK = 4096


class InterruptServer:
    """Listens where the gateway can reach this machine.

    Parameters
    ----------
    host
        Address of this machine on the gateway's side.
    gateway
        Address of the gateway; nobody else is listened to.

    Raises
    ------
    LinkError
        If no port can be had.
    """

    def __init__(self, host: str, gateway: str) -> None:
        try:
            self._listener = socket.create_server((host, 0), backlog=1)
        except OSError as error:
            raise LinkError(f"no port on {host} for service requests ({error})") from error
        self._gateway = gateway
        self._wire: socket.socket | None = None
        self._records = Records()

    @property
    def place(self) -> tuple[int, int]:
        """Address and port as the call wants them."""
        host, port = self._listener.getsockname()
        return int.from_bytes(socket.inet_aton(host), "big"), int(port)

    def wait(self, deadline: Deadline) -> bytes | None:
        """The handle of the next service request; None if none came.

        Raises
        ------
        LinkError
            If the gateway hung up, or says something else.
        """
        try:
            while True:
                while (record := self._records.take()) is not None:
                    call = parse_call(record)
                    if (call.program, call.procedure) == (PROGRAM, _SERVICE_REQUEST):
                        return call.arguments.bytes()
                if self._wire is None and not self._met(deadline):
                    return None
                assert self._wire is not None
                self._wire.settimeout(max(deadline.remaining_s, 1e-3))
                data = self._wire.recv(_CHUNK)
                if not data:
                    raise LinkError("the gateway closed its interrupt channel")
                self._records.feed(data)
        except TimeoutError:
            return None
        except (OSError, ValueError) as error:
            raise LinkError(f"the interrupt channel failed ({error})") from error

    def _met(self, deadline: Deadline) -> bool:
        """Whether the gateway has connected by the deadline."""
        while True:
            self._listener.settimeout(max(deadline.remaining_s, 1e-3))
            wire, place = self._listener.accept()
            if place[0] == self._gateway:
                self._wire = wire
                return True
            wire.close()

    def close(self) -> None:
        """Let go; may be called twice."""
        for wire in (self._listener, self._wire):
            if wire is not None:
                with suppress(OSError):
                    wire.close()
