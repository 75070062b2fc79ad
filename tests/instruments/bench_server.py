"""A simulated analyser on real wires, in a thread of the test or in a process of its own."""

import json
import subprocess
import sys
import threading
from contextlib import contextmanager
from typing import Any

from sim.analyser35670a import Analyser35670A, Choices
from sim.faults import FaultBoard, parse_fault
from sim.instrument.plant import LinearPlant
from sim.models import Bench, model_of
from sim.response import SteppedServo
from sim.serve import Server
from sim.unit import load_unit

WIRES = ("tcp", "prologix_tcp", "prologix_pty")


GATEWAYS = ("vxi11", "hislip")
SERIAL = ("serial_pty",)
"""What an instrument with RS-232 has beside."""


def url(name: str, place: str, driver: str = "") -> str:
    """The instrument address of what `serve` names, for the driver of that scheme."""
    lead = f"{driver}:" if driver else ""
    if name == "tcp":
        host, port = place.rsplit(":", 1)
        return f"{lead}TCPIP::{host}::{port}::SOCKET"
    if name == "serial_pty":
        return f"{lead}serial:{place}"
    if name in GATEWAYS:
        host, port = place.rsplit(":", 1)
        device = f"{host},{port}::inst0" if name == "vxi11" else f"{host}::hislip0,{port}"
        return f"{lead}TCPIP::{device}::INSTR"
    scheme = "prologix-tcp" if name == "prologix_tcp" else "prologix"
    # Another driver's instrument has another address, which is its driver's preset.
    return f"{lead}{scheme}:{place}" + ("" if driver else "?addr=11")


def wires_of(driver: str) -> tuple[str, ...]:
    """Every wire over which the instrument of a driver is served."""
    return WIRES + (SERIAL if model_of(driver).has_serial else ())


def simulated(driver: str, plant, faults=(), **bench) -> Any:
    """The instrument of a driver, noiseless unless told otherwise, in front of a device."""
    model = model_of(driver)
    settings = {"noise_v": 0.0, "converter_noise": 0.0} | bench
    return model.build(plant, Bench(**settings, faults=[model.parse_fault(one) for one in faults]))


def linear_analyser(gain, faults=(), **choices) -> Analyser35670A:
    """A noiseless instrument in front of a device with a known answer."""
    settings = {"noise_v": 0.0, "converter_noise": 0.0} | choices
    board = FaultBoard([parse_fault(fault) for fault in faults])
    return Analyser35670A(LinearPlant(gain), Choices(**settings), board)


def gimbal_analyser(ratio=0.3, seed=0, faults=(), unit="adss") -> Analyser35670A:
    """What `serve` serves."""
    board = FaultBoard([parse_fault(fault) for fault in faults])
    plant = SteppedServo(load_unit(unit), ratio, seed=seed)
    return Analyser35670A(plant, Choices(seed=seed), board)


@contextmanager
def served(instrument, wire: str = "tcp", driver: str = "", realtime: bool = False, **options):
    """Serve in a thread, as fast as can be or by the clock; yields the instrument's address."""
    ports = {
        "tcp": {"tcp": 0},
        "prologix_tcp": {"prologix_tcp": 0},
        "vxi11": {"vxi11": 0},
        "hislip": {"hislip": 0},
        "serial_pty": {"serial_pty": instrument},
    }
    wires = ports.get(wire, {"prologix_pty": True})
    with Server(instrument, realtime=realtime, **wires, **options) as server:
        thread = threading.Thread(target=server.run)
        thread.start()
        try:
            yield url(wire, server.addresses[wire], driver)
        finally:
            server.stop()
            thread.join()


@contextmanager
def serving(*words: str):
    """``lashbench serve`` in a process of its own; yields the addresses by wire."""
    command = [sys.executable, "-m", "tui.cli", "serve", *words]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        try:
            places = json.loads(process.stdout.readline())
            yield {name: url(name, place) for name, place in places.items()}
        finally:
            process.terminate()
            process.wait(60)  # a starved machine takes its time
