"""The usual mistakes in a response file: what undoes each, and what to tell a person.

Owns the table of them (phase in radians, swapped channels, ...). Whether a response looks like
one is `analysis.observation.input_check`'s part; nothing here judges or reads a file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from daq.frf import DB_PER_NEPER

__all__ = ["GAIN", "MISTAKES", "Curve", "Mistake", "quantities"]

Vector = NDArray[np.float64]

GAIN = 0.7
"""Neper by which the gain as a whole may be off by causes of the catalogue, which double it."""

_ANY_GAIN = 30.0

_MOST_LOG = 6.0
"""Neper of a gain that can be an amount of decibels: 400."""


@dataclass(frozen=True, slots=True)
class Curve:
    """One level: Hz, log gain in neper, phase in rad or None."""

    frequency_hz: Vector
    log_gain: Vector
    phase: Vector | None


@dataclass(frozen=True, slots=True)
class Mistake:
    """A mistake: how it is undone, how far the gain may then be off, and what to tell a person.

    `possible`: what its numbers must have in common for it to be looked for.
    `telltale`: what its numbers have in common and those of a true response hardly ever have.
    """

    undo: Callable[[Curve], Curve]
    words: str
    gain: float = GAIN
    needs_phase: bool = False
    telltale: Callable[[Curve], bool] | None = None
    possible: Callable[[Curve], bool] = lambda curve: True


def _turned(sign: float, radians: float = 0.0) -> Callable[[Curve], Curve]:
    def undo(curve: Curve) -> Curve:
        phase = None if curve.phase is None else sign * curve.phase + radians
        return Curve(curve.frequency_hz, curve.log_gain, phase)

    return undo


def _from_radians(curve: Curve) -> Curve:
    phase = None if curve.phase is None else np.degrees(curve.phase)
    return Curve(curve.frequency_hz, curve.log_gain, phase)


def _from_swapped(curve: Curve) -> Curve:
    phase = None if curve.phase is None else -curve.phase
    return Curve(curve.frequency_hz, -curve.log_gain, phase)


def _from_linear(curve: Curve) -> Curve:
    linear = np.maximum(curve.log_gain * DB_PER_NEPER, 1e-9)
    return Curve(curve.frequency_hz, np.log(linear), curve.phase)


def _from_decibels(curve: Curve) -> Curve:
    # An amount of decibels below 0, of which the logarithm was taken once more.
    decibels = np.exp(np.minimum(curve.log_gain, _MOST_LOG))
    return Curve(curve.frequency_hz, -decibels / DB_PER_NEPER, curve.phase)


def _is_like_decibels(curve: Curve) -> bool:
    """Whether gains are mostly above 1, as amounts of decibels are."""
    return bool(np.median(curve.log_gain) > 0.0)


def _is_within_pi(curve: Curve) -> bool:
    """Whether no phase in degrees is larger than any in radians."""
    return curve.phase is not None and bool(np.max(np.abs(np.degrees(curve.phase))) <= 3.1416)


def _is_like_linear(curve: Curve) -> bool:
    """Whether gains have no sign, are small, and some below 1, as linear gains are."""
    decibels = curve.log_gain * DB_PER_NEPER
    return bool(0.0 < np.min(decibels) < 1.0 and np.max(decibels) < 20.0)


def _slower(factor: float) -> Callable[[Curve], Curve]:
    def undo(curve: Curve) -> Curve:
        return Curve(curve.frequency_hz / factor, curve.log_gain, curve.phase)

    return undo


def _times_omega(power: int) -> Callable[[Curve], Curve]:
    def undo(curve: Curve) -> Curve:
        log_omega = np.log(2.0 * np.pi * curve.frequency_hz)
        phase = None if curve.phase is None else curve.phase + power * np.pi / 2.0
        return Curve(curve.frequency_hz, curve.log_gain + power * log_omega, phase)

    return undo


MISTAKES: Mapping[str, Mistake] = {
    "phase in radians": Mistake(
        _from_radians,
        "the phase is likely in radians; multiply phase_deg by 57.29578",
        needs_phase=True,
        telltale=_is_within_pi,
    ),
    "conjugate": Mistake(
        _turned(-1.0),
        "the sign of the phase is likely reversed (conjugate response); change the sign of "
        "phase_deg",
        needs_phase=True,
    ),
    "inverted": Mistake(
        _turned(1.0, np.pi),
        "one channel is likely inverted; add 180 to phase_deg, and see to the polarity of "
        "the tachometer",
        needs_phase=True,
    ),
    "swapped": Mistake(
        _from_swapped,
        "the channels are likely swapped (V_i/V_o in place of V_o/V_i); change the signs of "
        "gain_db and phase_deg",
    ),
    "linear gain": Mistake(
        _from_linear,
        "gain_db likely holds the gain itself, not decibels; give 20 log10 of it",
        telltale=_is_like_linear,
        possible=_is_like_linear,
    ),
    "decibels as gain": Mistake(
        _from_decibels,
        "the gain was likely in decibels already, below 0, and converted once more without its "
        "sign; give it as it was before: -10^(gain_db / 20)",
        possible=_is_like_decibels,
    ),
    "rad/s": Mistake(
        _slower(2.0 * np.pi),
        "frequencies are likely in rad/s; divide frequency_hz by 6.283185",
    ),
    "position": Mistake(
        _times_omega(1),
        "the output is likely {integral}, not {read}; multiply the gain by the angular "
        "frequency and add 90 to phase_deg",
        _ANY_GAIN,
        needs_phase=True,
    ),
    "acceleration": Mistake(
        _times_omega(-1),
        "the output is likely {derivative}, not {read}; divide the gain by the angular "
        "frequency and subtract 90 from phase_deg",
        _ANY_GAIN,
        needs_phase=True,
    ),
    "gain factor": Mistake(
        lambda curve: curve,
        "the gain as a whole is likely off by {factor}; see to the scales and probes of both "
        "channels",
        _ANY_GAIN,
    ),
}
"""Every mistake that is looked for, by its name: "position" and "acceleration" are those of a drive
that reads a velocity, and one integral or derivative of what another reads."""

_QUANTITIES = (
    "the integral of a position", "a position", "a velocity", "an acceleration",
    "the derivative of an acceleration",
)  # fmt: skip
_READ = {"position": 1, "speed": 2, "acceleration": 3}
_OF_CURRENT = {
    "integral": "the integral of a current", "read": "a current",
    "derivative": "the derivative of a current",
}  # fmt: skip


def quantities(reads: str) -> Mapping[str, str]:
    """What a sensor reads (``read``), its integral and its derivative, in words."""
    if reads == "current":
        return _OF_CURRENT
    at = _READ[reads]
    return dict(zip(("integral", "read", "derivative"), _QUANTITIES[at - 1 : at + 2], strict=True))
