"""What the simulated analyser chose where the manual is silent, and what its bench is like.

Owns every such choice, in one place, so that each can be switched. A choice is
marked [S] in the manual of the simulator (docs/simulated-analyser.md). No code
that uses an instrument may rely on one.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["NOISE_REFERENCE_CYCLES", "Choices"]

NOISE_REFERENCE_CYCLES = 30
"""Integrate cycles for which `Choices.noise_v` is stated."""


@dataclass(frozen=True, slots=True)
class Choices:
    """Everything that the manuals leave open; the defaults are the unkind readings.

    Times are the instrument's own seconds.
    """

    identity: str = "HEWLETT-PACKARD,35670A,LASHSIM001,A.01.11"
    options: str = "1D2"
    """What ``*OPT?`` lists, comma between."""
    seed: int = 0
    """Of all noise; the same seed gives the same readings on any wire and at any speed."""
    noise_v: float = 0.5e-3
    """Noise of the device's output: standard deviation of each component of a reading averaged
    over 30 cycles, V; it falls with the square root of the cycles."""
    converter_noise: float = 1e-5
    """Noise of the converter: per component and cycle, relative to the input range."""
    source_ohm: float = 5.0
    """Output resistance of the source."""
    device_ohm: float = 1e6
    """Input resistance of the device under test."""

    output_in_sine: bool = False
    """Whether ``OUTP`` exists in swept sine; one chapter of the manual says no."""
    source_stays_on: bool = True
    """Whether the source drives on after the last point."""
    both_ends: bool = False
    """Whether the last measured point is the stop; the manual gives a step of span over points,
    which leaves it out."""
    hold_between: bool = True
    """Whether displayed points between measured ones repeat the nearest one; else they hold
    filler."""
    most_cycles: float = 234.0
    """Upper limit of ``SWE:DWEL`` in cycles, as printed."""
    unit_quoted: bool = False
    """Whether ``? UNIT`` is answered between quotes, as strings are."""
    long_fft_axis: bool = True
    """Whether the X axis of FFT mode goes on beyond the displayed lines, to half the block size:
    clients that were used with real ones cut it to the length of the data."""
    condition_reads_clear: bool = False
    """Whether reading a condition register clears it, as one chapter says of three of them."""

    point_overhead_s: float = 0.5
    """What a point costs besides settling, ranging and integrating."""
    ranging_step_s: float = 0.1
    """One step of 2 dB."""
    feed_s: float = 0.05
    """A change of measurement data, coordinates or units."""
    reset_s: float = 0.5
    """``*RST`` and ``SYST:PRES``."""
    calibration_s: float = 8.0
    self_test_s: float = 10.0
    calibrations_s: tuple[float, ...] = (300.0, 900.0, 1800.0, 3600.0)
    """When autocalibration runs in the first hour after power-on."""
    calibration_interval_s: float = 8400.0
    """And how often after that."""
