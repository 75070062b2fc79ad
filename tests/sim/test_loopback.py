"""The simulated analyser inside this process, behind ``sim:``."""

from __future__ import annotations

import pytest
from instruments.known_device import known_answer

from daq.analyser import PointSettings
from daq.errors import BenchTimeout, ConfigurationError, LinkError, ProtocolError
from daq.hp35670a import HP35670A
from daq.transports.base import Deadline
from daq.transports.open import open_transport
from sim.analyser35670a import Analyser35670A, LinearPlant
from sim.faults import FaultBoard, parse_fault
from sim.loopback import Loopback, open_loopback, read_loopback_settings
from sim.unit import load_unit

IDENTITY = "HEWLETT-PACKARD,35670A,LASHSIM001,A.01.11"


def instrument(*faults: str) -> Analyser35670A:
    board = FaultBoard([parse_fault(text) for text in faults])
    return Analyser35670A(LinearPlant(known_answer), faults=board)


def test_loopback_reports_like_other_wires():
    soon = Deadline.after(0.2)
    wire = Loopback(instrument())
    wire.write("*IDN?", soon)
    assert wire.read(soon) == IDENTITY
    wire.write("*CLS", soon)
    with pytest.raises(BenchTimeout, match="CLS"):
        wire.read(Deadline.after(0.05))
    with pytest.raises(ProtocolError, match="bytes"):
        wire.write("X" * 200, soon)
    wire.write("*IDN?", soon)
    with pytest.raises(ProtocolError, match="block"):
        wire.read_block(soon)
    wire.close()
    with pytest.raises(LinkError, match="closed"):
        wire.write("*IDN?", soon)


@pytest.mark.parametrize(
    ("fault", "error"),
    [("truncated-block:phase=prepare", ProtocolError),
     ("wrong-length:phase=prepare", ProtocolError),
     ("dropped-connection:phase=prepare", LinkError), ("silence:phase=prepare", BenchTimeout)],
)  # fmt: skip
def test_faults_on_the_loopback(fault, error):
    wire = Loopback(instrument(fault))

    def read() -> bytes:
        wire.write("SYST:SET?", Deadline.after(0.1))
        return wire.read_block(Deadline.after(0.1))

    with pytest.raises(error):
        read()


def test_sim_address_accepts_its_options():
    wanted = read_loopback_settings(
        "?ratio=0.5&seed=3&noise=0&speed=realtime&options=1D2,UFF"
        "&fault=silence:point=4&effect=load-inertia:J_L=0.003"
    )
    assert (wanted.ratio, wanted.seed, wanted.noise_v, wanted.realtime) == (0.5, 3, 0.0, True)
    assert wanted.options == "1D2,UFF"
    assert wanted.faults[0].point == 4
    assert wanted.effects[0].id == "load-inertia"
    assert read_loopback_settings("") == read_loopback_settings("?")


@pytest.mark.parametrize(
    "rest", ["ratio=1", "?ratio=2", "?ratio=x", "?seed=1.5", "?speed=slow", "?colour=red", "?seed",
             "?seed=1&seed=2", "?noise=-1"],
)  # fmt: skip
def test_bad_settings_of_sim_are_refused(rest):
    with pytest.raises(ConfigurationError):
        read_loopback_settings(rest)


def test_sim_address_opens_simulated_gimbal():
    wire = open_transport("sim:?seed=1", {"sim": open_loopback(load_unit("adss"), 0.25)})
    analyser = HP35670A(wire)
    analyser.prepare(120.0, 160.0, PointSettings(2.5, 10, 10))
    (point,) = analyser.sweep([150.0])
    assert 0.01 < abs(point.gain) < 10
    assert str(analyser.make_safe()) == "confirmed-off"
