"""The instrument modes, and how far the value of a setting reaches.

Owns their names alone.
"""

from __future__ import annotations

from enum import Enum, StrEnum

__all__ = ["ALL_MODES", "MODE_CONFLICT", "OTHER_MODES", "SINE_ONLY", "Mode", "Scope"]


class Mode(StrEnum):
    """Instrument modes, in the order of ``INST:NSEL``."""

    FFT = "FFT"
    OCTAVE = "OCT"
    ORDER = "ORD"
    SINE = "SINE"
    HISTOGRAM = "HIST"
    CORRELATION = "CORR"


ALL_MODES = frozenset(Mode)
SINE_ONLY = frozenset({Mode.SINE})
OTHER_MODES = ALL_MODES - SINE_ONLY
MODE_CONFLICT = (-221, "Measurement mode incompatible with command.")


class Scope(Enum):
    """How far a value reaches."""

    MODE = "each instrument mode has its own"
    SHARED = "one for all modes"
    KEPT = "one for all modes, touched by no reset"
