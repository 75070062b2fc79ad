"""What real drives have and the paper's two do not, as sections of a unit file and as elements.

Owns damping, current-controlled amplifiers, clocks, encoders and couplings. It knows no effect.
"""

from sim.drive.sections import (
    CurrentAmplifier,
    Damping,
    LoadCoupling,
    MotorCoupling,
    Sampling,
    Sensor,
)
from sim.drive.sensors import Encoder, SampledTachometer

__all__ = [
    "CurrentAmplifier",
    "Damping",
    "Encoder",
    "LoadCoupling",
    "MotorCoupling",
    "SampledTachometer",
    "Sampling",
    "Sensor",
]
