"""What real drives have and the paper's two do not, as sections of a unit file and as elements.

Owns damping, current-controlled amplifiers, clocks, sensors, couplings and controllers. It knows
no effect.
"""

from sim.drive.controller import Controller
from sim.drive.sections import (
    CurrentAmplifier,
    Damping,
    LoadCoupling,
    Loop,
    MotorCoupling,
    Sampling,
    Sensor,
)
from sim.drive.sensors import AnalogueSensor, Encoder, SampledTachometer

__all__ = [
    "AnalogueSensor",
    "Controller",
    "CurrentAmplifier",
    "Damping",
    "Encoder",
    "LoadCoupling",
    "Loop",
    "MotorCoupling",
    "SampledTachometer",
    "Sampling",
    "Sensor",
]
