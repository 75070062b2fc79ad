"""Where an instrument is, as a URL: strict reading of every form, with all forms in the refusal.

Owns the address records and their grammar. It opens nothing.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import parse_qsl, unquote

from daq.errors import ConfigurationError

__all__ = [
    "FORMS",
    "Address",
    "HostedAddress",
    "PrologixSerial",
    "PrologixTcp",
    "ReplayFile",
    "SerialPort",
    "VisaAddress",
    "is_hislip",
    "parse_address",
]

FORMS = (
    "sim:",
    "TCPIP::HOST::PORT::SOCKET",
    "TCPIP::HOST::inst0::INSTR",
    "TCPIP::HOST::hislip0::INSTR",
    "GPIB0::11::INSTR",
    "USB0::0x03EB::0x2065::SERIAL::INSTR",
    "prologix:DEVICE?addr=11",
    "prologix-tcp:HOST:PORT?addr=11",
    "serial:DEVICE?baud=9600&flow=none",
    "replay:FILE",
)
"""Every form of URL, by example."""

DEFAULT_GPIB_ADDRESS = 11
"""That of the preset driver's instrument; another driver has its own."""
BAUD_RATES = (300, 600, 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200)
FLOWS = ("none", "hardware", "software")

_VISA = re.compile(
    r"""
    GPIB\d* :: (?P<pad>\d{1,2}) (:: (?P<sad>\d{1,3}))? (::INSTR)?
    | TCPIP\d* :: [^:\s]+ :: (?P<port>\d{1,5}) ::SOCKET
    | TCPIP\d* :: [^:\s]+ (:: [A-Za-z]\w*(,\d+)*)? ::INSTR
    | USB\d* :: (?P<vendor>0x[0-9A-F]{1,4}|\d{1,5}) :: (?P<product>0x[0-9A-F]{1,4}|\d{1,5})
      :: [^:\s]+ (:: \d{1,2})? ::INSTR
    """,
    re.IGNORECASE | re.VERBOSE | re.ASCII,
)
_SCHEME = re.compile(r"([a-z][a-z0-9-]*):(?!:)(.*)", re.DOTALL)
_HOST_PORT = re.compile(r"(\[[0-9A-Fa-f:.%]+\]|[^\s:/?\[\]]+):(\d{1,5})", re.ASCII)


@dataclass(frozen=True, slots=True)
class HostedAddress:
    """A transport that a floor above provides under a scheme of its own, such as ``sim:``."""

    scheme: str
    rest: str
    """What follows the colon, for the provider to read."""


@dataclass(frozen=True, slots=True)
class VisaAddress:
    """A VISA resource name."""

    resource: str


@dataclass(frozen=True, slots=True)
class PrologixSerial:
    """An adapter on a serial port (or behind a pyserial URL)."""

    device: str
    gpib_address: int = DEFAULT_GPIB_ADDRESS


@dataclass(frozen=True, slots=True)
class PrologixTcp:
    """An adapter on the network."""

    host: str
    port: int
    gpib_address: int = DEFAULT_GPIB_ADDRESS


@dataclass(frozen=True, slots=True)
class SerialPort:
    """An instrument's own RS-232 interface on a serial port (or behind a pyserial URL)."""

    device: str
    baud: int = 9600
    flow: str = "none"
    """One of `FLOWS`."""


@dataclass(frozen=True, slots=True)
class ReplayFile:
    """A transcript that answers in an instrument's place."""

    path: Path


Address = HostedAddress | VisaAddress | PrologixSerial | PrologixTcp | SerialPort | ReplayFile


def parse_address(
    url: str, hosted: tuple[str, ...] = ("sim",), gpib_address: int = DEFAULT_GPIB_ADDRESS
) -> Address:
    """Read an instrument URL.

    Parameters
    ----------
    url
        One of `FORMS`. VISA names may be in any case, schemes are lower case.
    hosted
        Schemes that the caller itself provides a transport for.
    gpib_address
        Taken where an adapter's URL names none.

    Raises
    ------
    ConfigurationError
        If it has none of the forms; the message says what is wrong and lists them.
    """
    text = url.strip()
    if "::" in text and not text.startswith(("prologix:", "prologix-tcp:", "serial:", "replay:")):
        return _visa(url, text)
    match = _SCHEME.fullmatch(text)
    if match is None:
        raise _refusal(url, "has no scheme")
    scheme, rest = match.groups()
    if scheme in hosted:
        return HostedAddress(scheme, rest)
    if scheme == "replay":
        if not rest:
            raise _refusal(url, "names no file")
        return ReplayFile(Path(rest))
    if scheme == "prologix":
        return _prologix_serial(url, rest, gpib_address)
    if scheme == "prologix-tcp":
        return _prologix_tcp(url, rest, gpib_address)
    if scheme == "serial":
        return _serial(url, rest)
    raise _refusal(url, f"has the unknown scheme {scheme!r}")


def is_hislip(resource: str) -> bool:
    """Whether a VISA name is of an instrument on HiSLIP, as ``TCPIP::HOST::hislip0::INSTR``."""
    kind, *parts = resource.split("::")
    named = len(parts) > 1 and parts[1].lower().startswith("hislip")
    return kind.upper().startswith("TCPIP") and named


def _visa(url: str, text: str) -> VisaAddress:
    match = _VISA.fullmatch(text)
    if match is None:
        raise _refusal(url, "is no VISA name of a kind that is served here")
    ranges = {
        "pad": (0, 30), "sad": (96, 126), "port": (1, 65535),
        "vendor": (0, 65535), "product": (0, 65535),
    }  # fmt: skip
    for name, (low, high) in ranges.items():
        value = match.group(name)
        if value is not None and not low <= int(value, 16 if "x" in value.lower() else 10) <= high:
            raise _refusal(url, f"has {value} where {low} to {high} is allowed")
    return VisaAddress(text)


def _prologix_serial(url: str, rest: str, preset: int) -> PrologixSerial:
    device, gpib_address = _with_gpib_address(url, rest, preset)
    if not device or any(sign.isspace() for sign in device):
        raise _refusal(url, "names no serial device")
    return PrologixSerial(device, gpib_address)


def _prologix_tcp(url: str, rest: str, preset: int) -> PrologixTcp:
    place, gpib_address = _with_gpib_address(url, rest, preset)
    match = _HOST_PORT.fullmatch(place)
    if match is None or not 1 <= int(match.group(2)) <= 65535:
        raise _refusal(url, "needs HOST:PORT with a port from 1 to 65535")
    return PrologixTcp(match.group(1).strip("[]"), int(match.group(2)), gpib_address)


def _serial(url: str, rest: str) -> SerialPort:
    device, options = _with_options(url, rest, ("baud", "flow"))
    if not device or any(sign.isspace() for sign in device):
        raise _refusal(url, "names no serial device")
    baud, flow = options.get("baud", "9600"), options.get("flow", "none")
    if baud not in map(str, BAUD_RATES):
        raise _refusal(url, f"has {baud!r} baud; it is one of {', '.join(map(str, BAUD_RATES))}")
    if flow not in FLOWS:
        raise _refusal(url, f"has flow control {flow!r}; it is one of {', '.join(FLOWS)}")
    return SerialPort(device, int(baud), flow)


def _with_gpib_address(url: str, rest: str, preset: int) -> tuple[str, int]:
    place, options = _with_options(url, rest, ("addr",))
    value = options.get("addr", str(preset))
    if not re.fullmatch(r"\d{1,2}", value, re.ASCII) or int(value) > 30:
        raise _refusal(url, f"has GPIB address {value!r}; it is a number from 0 to 30")
    return place, int(value)


def _with_options(url: str, rest: str, known: tuple[str, ...]) -> tuple[str, dict[str, str]]:
    place, mark, query = rest.partition("?")
    if not mark:
        return unquote(place), {}
    try:
        options = parse_qsl(query, keep_blank_values=True, strict_parsing=True)
    except ValueError as error:
        raise _refusal(url, "has nothing readable after '?'") from error
    keys = [key for key, _ in options]
    if not keys or not set(keys) <= set(known) or len(set(keys)) < len(keys):
        one = len(known) == 1
        words = " and ".join(f"{name!r}" for name in known)
        raise _refusal(
            url, f"may have {'one option only' if one else 'these options once each'}, {words}"
        )
    return unquote(place), dict(options)


def _refusal(url: str, fault: str) -> ConfigurationError:
    return ConfigurationError(f"instrument {url!r} {fault}; use one of: {', '.join(FORMS)}")
