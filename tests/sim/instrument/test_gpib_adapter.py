"""The fake GPIB adapters, from the host's end of the cable."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from sim.instrument.gpib_adapter import FakeAdapter
from sim.instrument.gpib_dialects import AR488, AR488_LATE_EOI, PROLOGIX_ETHERNET, PROLOGIX_USB

READY = b"++savecfg 0\n++addr 11\n++auto 0\n++eoi 1\n++eos 3\n++read_tmo_ms 1000\n"
IDENTITY = b"HEWLETT-PACKARD,35670A,LASHSIM001,A.01.11\n"


class Host:
    """The computer's end of the cable, with a clock of its own."""

    def __init__(self, adapter: FakeAdapter) -> None:
        self.adapter = adapter
        self.now = 0.0

    def send(self, data: bytes) -> bytes:
        self.adapter.receive(data, self.now)
        return self.heard()

    def heard(self) -> bytes:
        return self.adapter.take_output(self.now)

    def wait(self, seconds: float) -> bytes:
        """Let wall time pass; what came in the meantime."""
        heard = b""
        end = self.now + seconds
        while self.now < end:
            self.now = min(self.now + 0.01, end)
            self.adapter.pump(self.now)
            heard += self.heard()
        return heard


@pytest.fixture
def host(bench):
    """A Prologix that is set up."""
    host = Host(FakeAdapter(bench().instrument, PROLOGIX_USB))
    assert host.send(READY) == b""
    return host


@pytest.fixture
def arduino(bench):
    """An AR488 that is set up."""
    host = Host(FakeAdapter(bench().instrument, AR488))
    assert host.send(READY.replace(b"++savecfg 0\n", b"")) == b""
    return host


@pytest.mark.parametrize(
    ("dialect", "text"),
    [(PROLOGIX_USB, b"Prologix GPIB-USB Controller version 6."),
     (PROLOGIX_ETHERNET, b"Prologix GPIB-ETHERNET Controller version"),
     (AR488, b"AR488 GPIB controller")],
)  # fmt: skip
def test_version_reply_names_the_dialect(bench, dialect, text):
    host = Host(FakeAdapter(bench().instrument, dialect))
    reply = host.send(b"++ver\n")
    assert reply.startswith(text)
    assert reply.endswith(b"\r\n")


def test_query_is_answered_on_read(host):
    assert host.send(b"*IDN?\n") == b""
    assert host.send(b"++read eoi\n") == IDENTITY


def test_settings_read_back_and_are_checked(host):
    assert host.send(b"++addr\n") == b"11\r\n"
    assert host.send(b"++read_tmo_ms\n") == b"1000\r\n"
    assert host.send(b"++read_tmo_ms 3001\n++read_tmo_ms\n") == b"Invalid parameter\r\n1000\r\n"
    assert host.send(b"++auto 2\n") == b"Invalid parameter\r\n"
    assert host.send(b"++nonsense\n") == b"Unrecognized command\r\n"
    assert host.send(b"++addr 11 97\n++addr\n") == b"11 97\r\n"


def test_every_escaped_byte_passes(host):
    """A block upload with the four bytes that need an escape."""
    values = np.array([1.0, 2.0])
    payload = bytearray(values.astype(">f8").tobytes())
    payload[1:5] = b"\r\n\x1b+"
    message = b"TRAC D1,#216" + bytes(payload)
    escaped = b"".join(
        bytes([27, byte]) if byte in (10, 13, 27, 43) else bytes([byte]) for byte in message
    )
    seen = []
    host.adapter.instrument.listen = lambda data, end: seen.append((data, end)) or len(data)
    host.send(escaped + b"\n")
    assert seen == [(message, True)]


def test_unescaped_special_bytes_are_lost(host):
    seen = []
    host.adapter.instrument.listen = lambda data, end: seen.append(data) or len(data)
    host.send(b"FREQ:STEP +1E+2\n")
    host.send(b"\x1b+\x1b+ver\n")
    assert seen == [b"FREQ:STEP 1E2", b"++ver"]


def test_an_ar488_lets_a_single_plus_pass(arduino):
    arduino.send(b"FREQ:STEP +1E+2\n*IDN?\n++read eoi\n")
    assert arduino.send(b"FREQ:STEP?\n++read eoi\n") == b"+1.00000000000E+002\n"


@pytest.mark.parametrize(("eos", "ending"), [(0, b"\r\n"), (1, b"\r"), (2, b"\n"), (3, b"")])
def test_terminators(host, eos, ending):
    seen = []
    host.adapter.instrument.listen = lambda data, end: seen.append((data, end)) or len(data)
    host.send(b"++eos %d\n*CLS\n++eoi 0\n*CLS\r" % eos)
    assert seen == [(b"*CLS" + ending, True), (b"*CLS" + ending, False)]


def test_late_reply_times_out_silently_and_remains(bench):
    now = [0.0]
    controller = bench("slow-reply:seconds=2,phase=prepare", clock=lambda: now[0])
    host = Host(FakeAdapter(controller.instrument))
    host.send(READY + b"*IDN?\n++read eoi\n")
    assert host.wait(1.5) == b""
    now[0] = 3.0
    assert host.send(b"++read eoi\n") == IDENTITY
    # Had another message come first, it would have been lost: see -410.
    host.send(b"*IDN?\n*CLS\n")
    assert controller.instrument.status.standard_event == 0


def test_410_follows_unread_reply(host):
    host.send(b"*IDN?\n*OPT?\n")
    assert host.send(b"++read eoi\n") == b'"1D2"\n'
    assert host.send(b"SYST:ERR?\n++read eoi\n") == b'-410,"Query interrupted"\n'


def test_automatic_read_after_command_gives_420(host):
    assert host.send(b"++auto 1\n*OPT?\n") == b'"1D2"\n'
    host.send(b"*RST\n")
    host.wait(1.1)
    host.send(b"++auto 0\n")
    assert host.send(b"SYST:ERR?\n++read eoi\n") == b'-420,"Query unterminated"\n'


def test_ar488_reads_automatically_after_queries_only(arduino):
    assert arduino.send(b"++auto 2\n*RST\n*OPT?\n") == b'"1D2"\n'
    assert arduino.send(b"++auto 0\nSYST:ERR?\n++read eoi\n") == b'+0,"No error"\n'


def test_ways_to_end_a_read(host):
    assert host.send(b"*OPT?\n++read 68\n") == b'"1D'
    assert host.send(b"++read eoi\n") == b'2"\n'
    assert host.send(b"*OPT?\n++read\n") == b'"1D2"\n'
    # Without EOI as the end it hangs on the bus until the time-out, and the instrument complains.
    assert host.send(b"SYST:ERR?\n") == b""
    host.wait(1.1)
    assert host.send(b"++read eoi\n") == b'-420,"Query unterminated"\n'


def test_eoi_always_ends_ar488_read(arduino):
    assert arduino.send(b"*OPT?\n++read\nSYST:ERR?\n++read\n") == b'"1D2"\n+0,"No error"\n'


def test_a_character_marks_the_end(host):
    assert host.send(b"++eot_enable 1\n++eot_char 42\n*OPT?\n++read eoi\n") == b'"1D2"\n*'


def test_serial_poll_request_clear_and_trigger(host):
    host.send(b"*ESE 32;*SRE 32\nJUNK\n")
    assert host.send(b"++srq\n") == b"1\r\n"
    assert host.send(b"++spoll\n") == b"96\r\n"
    assert host.send(b"++srq\n++spoll 11\n") == b"0\r\n32\r\n"
    host.send(b"*CLS\n*IDN?\n++clr\n")
    assert host.send(b"*OPT?\n++read eoi\n") == b'"1D2"\n'
    host.send(b"++trg\n++ifc\n")
    assert host.send(b"SYST:ERR?\n++read eoi\n").startswith(b"-211,")
    host.send(b"++llo\n++loc\n")
    assert host.adapter.instrument.local_lockout
    assert not host.adapter.instrument.remote


def test_empty_address_gives_no_reply(host):
    host.send(b"++addr 5\n*IDN?\n")
    assert host.wait(3.0) == b""
    assert host.send(b"++read eoi\n") == b""
    assert host.wait(1.1) == b""
    assert host.send(b"++spoll\n") == b""
    assert host.wait(1.1) == b""
    assert host.send(b"++addr 11\n*OPT?\n++read eoi\n") == b'"1D2"\n'


def test_a_dead_instrument_answers_no_poll(bench):
    controller = bench("silence:phase=prepare")
    host = Host(FakeAdapter(controller.instrument))
    host.send(READY + b"*CLS\n")
    assert host.send(b"++spoll\n") == b""
    assert host.wait(2.0) == b""
    host.send(b"*IDN?\n")
    assert host.wait(1.5) == b""
    # The adapter itself is alive.
    assert host.send(b"++addr\n") == b"11\r\n"


def test_restart_ignores_input_and_resets_settings(host):
    host.send(b"++rst\n")
    assert host.send(b"++addr\n") == b""
    assert host.wait(4.9) == b""
    host.wait(0.2)
    assert host.send(b"++addr\n++auto\n++read_tmo_ms\n") == b"5\r\n1\r\n500\r\n"


def test_a_restart_by_fault(bench):
    controller = bench("adapter-reset:phase=prepare,seconds=0.5,skip=1")
    host = Host(FakeAdapter(controller.instrument, AR488))
    assert host.send(b"++addr 11\n++eoi 1\n++eos 3\n*CLS\n++addr\n") == b"11\r\n"
    host.wait(0.4)
    assert host.heard() == b""
    assert host.wait(0.3) == b"AR488 starting\r\n"
    assert host.send(b"++addr\n") == b"1\r\n"


def test_eeprom_writes(bench):
    for dialect, lines, writes in (
        (PROLOGIX_USB, b"++addr 11\n++auto 0\n", 2),
        (PROLOGIX_USB, b"++savecfg 0\n++addr 11\n++auto 0\n", 0),
        (AR488, b"++addr 11\n++auto 0\n", 0),
        (AR488, b"++savecfg 0\n++addr 11\n", 1),
    ):
        adapter = FakeAdapter(bench().instrument, dialect)
        Host(adapter).send(lines)
        assert adapter.eeprom_writes == writes


def test_an_ar488_cuts_long_lines(arduino):
    line = b";".join([b":FREQ:STEP 5"] * 20)
    arduino.send(line + b"\n")
    errors = arduino.send(b"SYST:ERR?\n++read eoi\n")
    assert errors.startswith(b"-1")


def test_prologix_passes_long_lines(host):
    line = b";".join([b":FREQ:STEP 5"] * 20)
    host.send(line + b"\n")
    assert host.send(b"SYST:ERR?\n++read eoi\n") == b'+0,"No error"\n'


def test_verbose_toggles_the_echo(arduino):
    assert arduino.send(b"++verbose\n") == b"Verbose: ON\r\n> "
    assert arduino.send(b"++addr\n") == b"++addr\r\n11\r\n> "
    assert b"Verbose: OFF" in arduino.send(b"++verbose\n")
    assert arduino.send(b"++addr\n") == b"11\r\n"


def test_a_serial_line_has_a_speed(bench):
    controller = bench()
    controller.write("INST:SEL SINE", "FORM REAL,64")
    host = Host(FakeAdapter(controller.instrument, AR488, paced=True))
    host.send(READY)
    host.wait(0.1)
    begin = host.now
    data = host.send(b"TRAC:X? TRAC1\n++read eoi\n")
    while len(data) < 3215:
        data += host.wait(0.05)
        assert host.now < begin + 2
    assert 0.15 < host.now - begin < 0.5
    assert struct.unpack(">d", data[6:14])[0] == pytest.approx(51.2)


def test_blocked_bus_times_out(bench):
    controller = bench()
    controller.sweep("ABOR;:INIT;*WAI")
    host = Host(FakeAdapter(controller.instrument))
    controller.write("ABOR;:INIT;*WAI")
    host.send(READY + b"FREQ:STEP 1" + b" " * 300 + b"\n")
    assert host.adapter.busy
    host.wait(1.5)
    assert host.send(b"++addr\n") == b"11\r\n"


def test_device_mode_sends_nothing(host):
    host.send(b"++mode 0\nJUNK\n++mode 1\n")
    assert host.send(b"SYST:ERR?\n++read eoi\n") == b'+0,"No error"\n'


@pytest.mark.parametrize(("eos", "answered"), [(3, False), (2, True), (1, False), (0, True)])
def test_late_eoi_ends_no_message(bench, eos, answered):
    """Firmware that is too late with EOI: only a line feed ends a message."""
    host = Host(FakeAdapter(bench().instrument, AR488_LATE_EOI))
    host.send(READY.replace(b"++savecfg 0\n", b"").replace(b"++eos 3", b"++eos %d" % eos))
    heard = host.send(b"*IDN?\n++read eoi\n") + host.wait(2.0)
    assert heard == (IDENTITY if answered else b"")


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        (b"++allspoll\n", b"\r\n"),
        (b"++spoll all\n", b"\r\n"),
        (b"++spoll 3 11\n", b"0\r\n"),
        (b"++fndl all\n", b"11\r\n"),
        (b"++fndl 3-12\n", b"11\r\n"),
        (b"++fndl 12-3\n", b"Invalid parameter\r\n"),
        (b"++fndl 5 11\n", b"11\r\n"),
        (b"++fndl 5 6\n", b"\r\n"),
        (b"++fndl 99\n", b"Invalid parameter\r\n"),
        (b"++fndl\n", b"Missing parameter\r\n"),
        (b"++id fwver\n", AR488.version.encode() + b"\r\n"),
        (b"++id name bench 3\n++id name\n", b"bench 3\r\n"),
        (b"++id serial 42\n++id serial\n", b"000000042\r\n"),
        (b"++id name a name of more than fifteen\n", b"Invalid parameter\r\n"),
        (b"++id\n", b"Unrecognized command\r\n"),
        (b"++id verstr my box\n++ver\n", b"my box\r\n"),
        (b"++id verstr box\n++ver real\n", AR488.version.encode() + b"\r\n"),
        (b"++flags\n++flags 8\n++flags 6\n++flags\n", b"0\r\nInvalid parameter\r\n6\r\n"),
        (b"++flags 6\n*IDN?\n++read eoi\n", b"Send^OK\r\n" + IDENTITY + b"Read^OK\r\n"),
    ],
)  # fmt: skip
def test_ar488_commands_are_unknown_to_prologix(arduino, line, answer):
    assert arduino.send(line) == answer
    prologix = Host(FakeAdapter(arduino.adapter.instrument, PROLOGIX_USB))
    if line.split()[0] != b"++spoll":
        assert prologix.send(line.split(b"\n")[0] + b"\n") == b"Unrecognized command\r\n"


def test_poll_of_all_finds_requesting_instrument(arduino):
    arduino.send(b"*SRE 32\n*ESE 32\nNONSENSE 1\n")
    assert arduino.send(b"++allspoll\n") == b"SRQ:11,96\r\n\r\n"
    assert arduino.send(b"++allspoll\n") == b"\r\n"
