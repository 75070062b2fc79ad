"""Instrument URLs: every form is read, everything else is refused with the list of forms."""

import contextlib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq.errors import ConfigurationError, FileFormatError, InputError
from daq.transports.address import (
    FORMS,
    HostedAddress,
    PrologixSerial,
    PrologixTcp,
    ReplayFile,
    SerialPort,
    VisaAddress,
    parse_address,
)
from daq.transports.open import open_transport


@pytest.mark.parametrize(
    ("url", "address"),
    [
        ("sim:", HostedAddress("sim", "")),
        ("sim:edss?ratio=0.3", HostedAddress("sim", "edss?ratio=0.3")),
        ("TCPIP::127.0.0.1::5025::SOCKET", VisaAddress("TCPIP::127.0.0.1::5025::SOCKET")),
        ("tcpip0::bench-7.lab::inst0::instr", VisaAddress("tcpip0::bench-7.lab::inst0::instr")),
        ("TCPIP::gateway::gpib0,11::INSTR", VisaAddress("TCPIP::gateway::gpib0,11::INSTR")),
        ("GPIB0::11::INSTR", VisaAddress("GPIB0::11::INSTR")),
        (
            "USB0::0x03EB::0x2065::GPIB_11_3E1F::INSTR",
            VisaAddress("USB0::0x03EB::0x2065::GPIB_11_3E1F::INSTR"),
        ),
        ("USB::1003::08293::X-7::0::INSTR", VisaAddress("USB::1003::08293::X-7::0::INSTR")),
        ("TCPIP::h::hislip0,4880::INSTR", VisaAddress("TCPIP::h::hislip0,4880::INSTR")),
        ("GPIB::5", VisaAddress("GPIB::5")),
        ("prologix:/dev/ttyUSB0?addr=14", PrologixSerial("/dev/ttyUSB0", 14)),
        ("prologix:COM3", PrologixSerial("COM3", 11)),
        ("prologix:socket://10.0.0.2:1234?addr=0", PrologixSerial("socket://10.0.0.2:1234", 0)),
        ("prologix-tcp:10.0.0.2:1234?addr=30", PrologixTcp("10.0.0.2", 1234, 30)),
        ("prologix-tcp:[::1]:1234", PrologixTcp("::1", 1234, 11)),
        ("serial:/dev/ttyUSB0", SerialPort("/dev/ttyUSB0", 9600, "none")),
        ("serial:COM3?baud=19200", SerialPort("COM3", 19200, "none")),
        ("serial:COM3?flow=hardware&baud=300", SerialPort("COM3", 300, "hardware")),
        ("serial:socket://10.0.0.2:4001", SerialPort("socket://10.0.0.2:4001", 9600, "none")),
        ("replay:runs/a b.jsonl", ReplayFile(Path("runs/a b.jsonl"))),
    ],
)
def test_every_form_is_read(url, address):
    assert parse_address(url) == address


@pytest.mark.parametrize(
    ("url", "fault"),
    [
        ("", "no scheme"),
        ("127.0.0.1:5025", "no scheme"),
        ("SIM:", "no scheme"),
        ("http://bench", "unknown scheme 'http'"),
        ("TCPIP::host::SOCKET", "no VISA name"),
        ("TCPIP::host::70000::SOCKET", "70000"),
        ("TCPIP::host::0::SOCKET", "has 0 where"),
        ("TCPIP::host::5025::SOCKET?addr=11", "no VISA name"),
        ("GPIB0::31::INSTR", "31"),
        ("GPIB0::11::40::INSTR", "40"),
        ("USB0::0x03EB::INSTR", "no VISA name"),
        ("USB0::0x03EB::70000::X::INSTR", "has 70000"),
        ("USB0::0x10000::1::X::INSTR", "no VISA name"),
        ("USB0::1::1::X::RAW", "no VISA name"),
        ("ASRL3::INSTR", "no VISA name"),
        ("PRLGX-TCPIP::host::INTFC", "no VISA name"),
        ("prologix:", "no serial device"),
        ("prologix:/dev/tty USB", "no serial device"),
        ("prologix:COM3?addr=31", "'31'"),
        ("prologix:COM3?addr=", "''"),
        ("prologix:COM3?addr=-1", "'-1'"),
        ("prologix:COM3?addr=1&addr=2", "one option only"),
        ("prologix:COM3?baud=9600", "one option only"),
        ("prologix:COM3?", "one option only"),
        ("prologix:COM3?addr", "nothing readable"),
        ("prologix-tcp:host", "HOST:PORT"),
        ("prologix-tcp:host:0", "HOST:PORT"),
        ("prologix-tcp:host:99999", "HOST:PORT"),
        ("prologix-tcp:host:12a", "HOST:PORT"),
        ("prologix-tcp:a:b:1", "HOST:PORT"),
        ("serial:", "no serial device"),
        ("serial:?baud=9600", "no serial device"),
        ("serial:/dev/tty USB", "no serial device"),
        ("serial:COM3?baud=9601", "'9601' baud"),
        ("serial:COM3?baud=", "'' baud"),
        ("serial:COM3?flow=rts", "flow control 'rts'"),
        ("serial:COM3?addr=11", "these options once each, 'baud' and 'flow'"),
        ("serial:COM3?baud=300&baud=300", "these options once each"),
        ("replay:", "no file"),
    ],
)
def test_other_address_is_refused_with_forms(url, fault):
    with pytest.raises(ConfigurationError) as refusal:
        parse_address(url)
    assert fault in str(refusal.value)
    assert all(form in str(refusal.value) for form in FORMS)
    assert refusal.value.exit_code == 2


@given(st.text(max_size=40))
def test_parser_raises_no_other_error(text):
    with contextlib.suppress(ConfigurationError):
        parse_address(text)


def test_a_refusal_is_one_line():
    with pytest.raises(ConfigurationError) as refusal:
        parse_address("two\nlines")
    assert "\n" not in str(refusal.value)


@given(st.text(max_size=12), st.integers(-5, 200))
def test_an_accepted_gpib_address_is_one(place, address):
    try:
        parsed = parse_address(f"prologix:{place}?addr={address}")
    except ConfigurationError:
        return
    assert parsed.gpib_address == address
    assert 0 <= address <= 30


def test_a_scheme_without_a_provider_is_unknown():
    with pytest.raises(ConfigurationError, match="unknown scheme 'sim'"):
        open_transport("sim:", {})


def test_provided_scheme_gets_text_after_colon():
    seen = []
    assert open_transport("sim:a?b=c", {"sim": lambda rest: seen.append(rest) or "wire"}) == "wire"
    assert seen == ["a?b=c"]


def test_replay_of_empty_file_is_bad_file(tmp_path):
    with pytest.raises(FileFormatError, match="cannot be read"):
        open_transport(f"replay:{tmp_path / 'gone'}")


def test_a_transcript_is_never_written_over(tmp_path):
    path = tmp_path / "run.jsonl"
    path.write_text("evidence")

    class Wire:
        address = "x:"
        closed = False

        def close(self):
            Wire.closed = True

    with pytest.raises(InputError, match="give a new file"):
        open_transport("sim:", {"sim": lambda _: Wire()}, record=path)
    assert Wire.closed
    assert path.read_text() == "evidence"
