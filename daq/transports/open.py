"""From a URL to an open transport, recorded on the way if that is wanted.

Owns nothing but the choice. Transports that live on a floor above, such as
the simulated analyser's, come in as factories by scheme.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from daq.errors import LashbenchError
from daq.transports.address import (
    DEFAULT_GPIB_ADDRESS,
    HostedAddress,
    PrologixSerial,
    PrologixTcp,
    ReplayFile,
    SerialPort,
    VisaAddress,
    is_hislip,
    parse_address,
)
from daq.transports.base import Deadline, Transport

if TYPE_CHECKING:
    from daq.transports.links import SerialLink

__all__ = ["TransportFactory", "load_transport", "open_transport"]

TransportFactory = Callable[[str], Transport]
"""Opens a transport from what follows ``scheme:`` in the URL."""

_OPENING_S = 10.0
"""Bound of opening; an Arduino that resets takes two of it, a Prologix that restarts five."""


def open_transport(
    url: str,
    factories: Mapping[str, TransportFactory] | None = None,
    *,
    record: Path | None = None,
    fault: Callable[[str], None] | None = None,
    opening_s: float = _OPENING_S,
    gpib_address: int = DEFAULT_GPIB_ADDRESS,
) -> Transport:
    """Open the transport that a URL names; docs/instrument.md explains the forms.

    Parameters
    ----------
    url
        See `daq.transports.address.FORMS`.
    factories
        Transports provided by the caller, by scheme (``"sim"``).
    record
        File to record the dialogue to; must not exist yet.
    fault
        Told if that file takes no more; see `daq.transports.transcript.Recorder`.
    opening_s
        Bound of opening, s.
    gpib_address
        Taken where an adapter's URL names none.

    Raises
    ------
    ConfigurationError
        If the URL has no known form.
    LinkError
        If nothing answers there.
    FileFormatError
        If a transcript to be replayed is damaged.
    InputError
        If the transcript to be recorded cannot be written.
    """
    provided = dict(factories or {})
    address = parse_address(url, tuple(provided), gpib_address)
    transport: Transport
    match address:
        case HostedAddress(scheme=scheme, rest=rest):
            transport = provided[scheme](rest)
        case VisaAddress(resource=resource) if resource.upper().endswith("::SOCKET"):
            from daq.transports.links import TcpLink
            from daq.transports.stream import StreamTransport

            _, host, port, _ = resource.split("::")
            transport = StreamTransport(
                TcpLink(host, int(port), Deadline.after(opening_s)), resource
            )
        case VisaAddress(resource=resource) if is_hislip(resource):
            from daq.transports.hislip import open_hislip

            transport = open_hislip(resource, Deadline.after(opening_s))
        case VisaAddress(resource=resource) if resource.upper().startswith("TCPIP"):
            from daq.transports.vxi11 import open_vxi11

            transport = open_vxi11(resource, Deadline.after(opening_s))
        case VisaAddress(resource=resource):
            from daq.transports.visa import open_visa

            transport = open_visa(resource, Deadline.after(opening_s))
        case PrologixSerial() | PrologixTcp():
            transport = _open_prologix(address, url, opening_s)
        case SerialPort(device=device, baud=baud, flow=flow):
            from daq.transports.stream import StreamTransport

            # RS-232 interfaces of instruments end a reply with CR, with or without LF behind it.
            transport = StreamTransport(_serial_link(device, baud, flow), url, reply_end=b"\r")
        case ReplayFile(path=path):
            from daq.transports.transcript import Replay

            transport = Replay(path)
    if record is None:
        return transport
    from daq.transports.transcript import Recorder

    try:
        return Recorder(transport, record, fault)
    except LashbenchError:
        transport.close()
        raise


def load_transport(url: str) -> None:
    """Import whatever opening that URL will need; nothing is opened.

    Raises
    ------
    ConfigurationError
        If the URL has no known form.
    """
    # A host's name is looked up with it.
    import encodings.idna  # noqa: F401

    match parse_address(url):
        case VisaAddress(resource=resource) if resource.upper().endswith("::SOCKET"):
            import daq.transports.links
            import daq.transports.stream  # noqa: F401
        case VisaAddress(resource=resource) if is_hislip(resource):
            import daq.transports.hislip
            import daq.transports.links  # noqa: F401
        case VisaAddress(resource=resource) if resource.upper().startswith("TCPIP"):
            import daq.transports.links
            import daq.transports.vxi11  # noqa: F401
        case VisaAddress(resource=resource):
            from daq.transports.visa import load_backend

            load_backend(resource)
        case PrologixTcp():
            import daq.transports.links
            import daq.transports.prologix
            import daq.transports.prologix_adapter  # noqa: F401
        case PrologixSerial(device=device):
            import daq.transports.prologix
            import daq.transports.prologix_adapter  # noqa: F401

            _load_serial(device)
        case SerialPort(device=device):
            import daq.transports.stream  # noqa: F401

            _load_serial(device)
        case _:
            pass


def _load_serial(device: str) -> None:
    import serial

    import daq.transports.links  # noqa: F401
    from daq.transports.ports import ports

    serial.Serial()
    # While it is there, so that it is found again should it come back under another name.
    ports.note(device)


def _serial_link(device: str, baud: int = 115200, flow: str = "none") -> SerialLink:
    """Open a port where its adapter is now, and remember which adapter that is."""
    from daq.transports.links import SerialLink
    from daq.transports.ports import ports

    link = SerialLink(ports.now(device), baud, flow)
    ports.note(device)
    return link


def _open_prologix(address: PrologixSerial | PrologixTcp, url: str, opening_s: float) -> Transport:
    from daq.transports.links import Link, TcpLink
    from daq.transports.prologix import PrologixTransport
    from daq.transports.prologix_adapter import Adapter

    deadline = Deadline.after(opening_s)
    link: Link
    if isinstance(address, PrologixSerial):
        link = _serial_link(address.device)
    else:
        link = TcpLink(address.host, address.port, deadline)
    try:
        return PrologixTransport(Adapter(link, address.gpib_address, deadline), url)
    except LashbenchError:
        link.close()
        raise
