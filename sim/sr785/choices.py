"""What the simulated SR785 chose where its manual is silent or contradicts itself.

Owns every such choice, in one place, so that each can be switched. No code that uses an
instrument may rely on one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["NOISE_REFERENCE_CYCLES", "Choices"]

NOISE_REFERENCE_CYCLES = 30
"""Integrate cycles for which `Choices.noise_v` is stated."""


@dataclass(frozen=True, slots=True)
class Choices:
    """Everything that is open; the defaults are the unkind readings. Times are its own seconds."""

    model: Literal["SR785", "SR780"] = "SR785"
    serial: str = "SIM00785"
    version: str = "105"
    seed: int = 0
    """Of all noise; the same seed gives the same readings on any wire and at any speed."""
    noise_v: float = 0.5e-3
    """Noise of the device's output: standard deviation of each component of a reading averaged
    over 30 cycles, V; it falls with the square root of the cycles."""
    converter_noise: float = 1e-5
    """Noise of the converter: per component and cycle, relative to the input range."""

    outx: int = 0
    """Where replies go after power-on: 0 GPIB, 1 RS-232."""
    level_units: tuple[str, ...] = ("mV", "V", "dBVpk")
    """Units of source levels in the order of their index; clients list others."""
    level_reply: str | None = None
    """Unit in which levels are always answered; None for the unit last sent."""
    sweep_obeys_switch: bool = True
    """Whether ``SRCO 0`` keeps a sweep from driving."""
    data_survive_change: bool = True
    """Whether a display's swept data survive a change of its ``MEAS``, as the manual suggests."""
    change_resets_view: bool = True
    """Whether a change of ``MEAS`` sets the display's ``VIEW`` back to log magnitude."""
    start_clears: bool = True
    """Whether ``STRT`` removes the data of the sweep before at once."""
    narrowest: float = 1e-6
    """Smallest span of a sweep relative to its start; a stop too near is refused."""
    progress_is_frequency: bool = False
    """Whether ``SSFR?`` tells the present frequency; else the number of the point."""
    digits: int = 7
    """Significant digits of reals in ASCII."""
    unmeasured: float = -3.4028234663852886e38
    """What a bin holds that was not measured; 0 was seen as well."""

    command_s: float = 0.002
    """Execution of one command; IFC is low meanwhile."""
    reset_s: float = 12.0
    """``*RST``; nothing is answered meanwhile."""
    point_overhead_s: float = 0.05
    ranging_step_s: float = 0.05
    """One step of 2 dB of an input range."""
    transfer_patience_s: float = 1.0
    """Pause of the reader after which a transfer of a trace is given up."""
