"""The verb serve: one line when it is ready, and an end on a signal."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys

import pytest

IDENTITY = "HEWLETT-PACKARD,35670A,LASHSIM001,A.01.11"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_serve_prints_ready_and_ends_on_signal(number):
    process = subprocess.Popen(
        [sys.executable, "-m", "tui.cli", "serve", "--unit", "adss", "--ratio", "0.25",
         "--tcp", "0", "--prologix-tcp", "0", "--prologix-pty", "--speed", "fast",
         "--fault", "slow-reply:seconds=0.1", "--seed", "3"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert process.stdout is not None
        addresses = json.loads(process.stdout.readline())
        assert set(addresses) == {"tcp", "prologix_tcp", "prologix_pty"}
        host, port = addresses["tcp"].split(":")
        with (
            socket.create_connection((host, int(port)), timeout=30.0) as wire,
            wire.makefile("rb") as lines,
        ):
            wire.sendall(b"*IDN?\n")
            assert lines.readline() == IDENTITY.encode() + b"\n"
        assert os.path.exists(addresses["prologix_pty"])
        process.send_signal(number)
        rest, _notes = process.communicate(timeout=60)
        assert process.returncode == 0
        assert rest == ""
        assert not os.path.lexists(addresses["prologix_pty"])
    finally:
        process.kill()
        process.wait()


def test_instrument_without_rs232_is_refused_on_it(capsys):
    from tui.cli import main

    assert main(["serve", "--unit", "adss", "--ratio", "0.25", "--serial-pty"]) == 2
    assert "model 35670A cannot be measured with over RS-232" in capsys.readouterr().err


def test_sr785_is_served_on_its_serial_port():
    process = subprocess.Popen(
        [sys.executable, "-m", "tui.cli", "serve", "--model", "SR785", "--unit", "adss",
         "--ratio", "0.25", "--tcp", "0", "--serial-pty", "--speed", "fast"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert process.stdout is not None
        addresses = json.loads(process.stdout.readline())
        assert set(addresses) == {"tcp", "serial_pty"}
        with open(addresses["serial_pty"], "r+b", buffering=0) as line:
            line.write(b"OUTX 1\r*IDN?\r")
            heard = b""
            while not heard.endswith(b"\r"):
                heard += line.read(1) or b""
        assert heard.startswith(b"Stanford_Research_Systems,SR785,")
        process.terminate()
        _, notes = process.communicate(timeout=60)
        assert process.returncode == 0
        assert "serving a simulated SR785" in notes
    finally:
        process.kill()
        process.wait()


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        ([], 2, "--tcp"),
        (["--tcp", "70000"], 2, "70000"),
        (["--tcp", "0", "--model", "SR786"], 2, "35670A, SAMPLED, SR785"),
        (["--tcp", "0", "--model", "SR785", "--options", "1D2"], 2, "lists no options"),
        (["--tcp", "0", "--model", "sr785", "--fault", "hardware-error"], 2, "outx-elsewhere"),
        (["--tcp", "0", "--fault", "nonsense"], 2, "nonsense"),
        (["--tcp", "0", "--effect", "nonsense"], 2, "nonsense"),
        (["--tcp", "0", "--noise", "-1"], 2, "noise"),
        (["--tcp", "0", "--speed", "warp"], 2, "warp"),
        (["--tcp", "0", "--ratio", "2"], 2, "ratio"),
        (["--tcp", "0", "--unit", "nobody"], 2, "nobody"),
    ],
)
def test_the_verb_refuses_in_one_line(words, code, says, capsys):
    from tui.cli import main

    given = dict(zip(words[::2], words[1::2], strict=True))
    base = {"--unit": "adss", "--ratio": "0.25"} | given
    assert main(["serve", *(word for pair in base.items() for word in pair)]) == code
    captured = capsys.readouterr()
    assert says in captured.err
    assert len(captured.err.strip().splitlines()) == 1
    assert captured.out == ""
