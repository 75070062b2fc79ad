"""Whether what is missing acts alike both ways: even and odd harmonics, measured and simulated.

Owns the comparison of a response's second and third harmonic with those of a model, where the
response holds them. What limits, rubs or has play alike both ways makes odd ones; what acts more
one way than the other, an uneven amplifier or a weight, makes even ones, too. It names no cause.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.fitted_model import FittedModel
from analysis.ensemble.datasheet_spread import spread_of
from analysis.ensemble.machine import safe_cycles
from analysis.observation.observation import Observation
from daq.frf import DB_PER_NEPER, FrequencyResponse
from daq.plan import SweepPlan
from sim.servo import Servo

__all__ = ["Harmonic", "compare_harmonics", "describe_harmonics"]

_RUNS = 12
"""Machines of the model, each off its datasheet by chance, that a harmonic is held against."""

_LEAST_STD = 0.05
"""Spread of a harmonic's logarithm that machines have at least: twelve may be alike by chance."""

_DIFFERS, _ABOVE_NOISE = 4.0, 3.0
"""Standard deviations from which a harmonic differs, of twelve machines' and of as many levels; and
how far above the reading's noise it must be to be told at all."""

_NOTHING = 1e-9
"""Share of the fundamental that counts as none."""

_NUMBERS = (2, 3)


@dataclass(frozen=True, slots=True)
class Harmonic:
    """One harmonic at one level: its share of the fundamental, measured and simulated.

    Geometric means over all frequencies. `sigma`: how far the measured one is from the
    simulated, in standard deviations of the machines' logarithms.
    """

    number: int
    source_vpk: float
    measured: float
    simulated: float
    sigma: float

    @property
    def parity(self) -> str:
        """Whether it is an even or an odd one."""
        return "odd" if self.number % 2 else "even"

    @property
    def differs(self) -> bool:
        """Whether it is not what the model makes."""
        return abs(self.sigma) > _DIFFERS

    def to_json(self) -> dict[str, Any]:
        """One entry of ``harmonics``."""
        return {
            "harmonic": self.number,
            "parity": self.parity,
            "source_vpk": self.source_vpk,
            "measured_share": self.measured,
            "simulated_share": self.simulated,
            "sigma": self.sigma,
        }


def compare_harmonics(
    responses: Sequence[FrequencyResponse],
    observation: Observation,
    candidate: FittedModel,
    rng: np.random.Generator,
) -> tuple[Harmonic, ...]:
    """The second and third harmonic at each level, where responses hold them above their noise.

    Parameters
    ----------
    responses
        What was measured.
    observation
        The same, as it was compared: it knows how each was swept, and the noise.
    candidate
        The model, at its best place.
    rng
        Draws machines and where they start.

    Raises
    ------
    AnalysisError
        If a motion grew without bound.
    """
    found: list[Harmonic] = []
    for plan, _ in observation.plans:
        measured = list(_measured(responses, plan))
        if not measured:
            continue
        cycles = np.stack(safe_cycles(list(_servos(candidate, rng)), plan))
        simulated = np.abs(cycles.mean(axis=3))
        for level, points, magnitudes in measured:
            shares = _shares(simulated[:, level, points])
            found += _compared(plan.levels_vpk[level], magnitudes, shares, observation.noise_v)
    return tuple(found)


def _compared(
    source_vpk: float,
    measured: NDArray[np.float64],
    shares: NDArray[np.float64],
    noise_v: float,
) -> Iterator[Harmonic]:
    """What was measured at a level (points, 3) against shares of machines (machines, 2)."""
    loudness = _mean(np.maximum(measured[:, 1:].T, _NOTHING))
    for number, loud, share, simulated in zip(
        _NUMBERS, loudness, _shares(measured), shares.T, strict=True
    ):
        if loud * source_vpk < _ABOVE_NOISE * noise_v:
            continue
        logs = np.log(np.maximum(simulated, _NOTHING))
        spread = max(float(logs.std(ddof=1)), _LEAST_STD) * np.sqrt(1.0 + 1.0 / len(logs))
        sigma = float(np.log(max(share, _NOTHING)) - logs.mean()) / spread
        yield Harmonic(
            number, float(source_vpk), float(share), float(np.exp(logs.mean())), float(sigma)
        )


def describe_harmonics(harmonics: Sequence[Harmonic]) -> str:
    """In words: which of them differ, where most, and what that says."""
    if not harmonics:
        return (
            "the response holds none above its noise; a second and a third one would say whether "
            "what is missing acts alike both ways"
        )
    told = [_told(parity, harmonics) for parity in ("even", "odd")]
    even, odd = (
        any(one.differs and one.parity == parity and one.sigma > 0 for one in harmonics)
        for parity in ("even", "odd")
    )
    says = ""
    if even:
        says = ": something acts more one way than the other"
    elif odd:
        says = ": something limits, rubs or gives alike both ways"
    return "; ".join(text for text in told if text) + says


def _told(parity: str, harmonics: Sequence[Harmonic]) -> str:
    some = [one for one in harmonics if one.parity == parity]
    if not some:
        return ""
    worst = max(some, key=lambda one: abs(one.sigma))
    if not worst.differs:
        return f"{parity} ones as simulated"
    db = DB_PER_NEPER * np.log(worst.measured / max(worst.simulated, _NOTHING))
    than = "stronger" if db > 0 else "weaker"
    return (
        f"{parity} ones {than} than simulated, most at {worst.source_vpk:.4g} V, by {abs(db):.0f} "
        f"dB ({100.0 * worst.measured:.2g} % of the fundamental, {abs(worst.sigma):.0f} sigma)"
    )


def _measured(
    responses: Sequence[FrequencyResponse], plan: SweepPlan
) -> Iterator[tuple[int, NDArray[np.intp], NDArray[np.float64]]]:
    """Which level of a plan, which points of it, and fundamental and harmonics (points, 3) there.

    Magnitudes over the source, where all three were read.
    """
    for response in responses:
        if (response.direction or "up") != plan.direction:
            continue
        if response.dc_offset_v != plan.dc_offset_v:
            continue
        read = np.abs(np.column_stack([response.gain, response.harmonic2, response.harmonic3]))
        known = np.isfinite(read).all(axis=1) & np.isin(response.frequency_hz, plan.frequencies_hz)
        for level, source_vpk in enumerate(plan.levels_vpk):
            rows = np.flatnonzero(known & (response.source_vpk == source_vpk))
            if len(rows):
                points = np.searchsorted(plan.frequencies_hz, response.frequency_hz[rows])
                yield level, points, read[rows]


def _servos(candidate: FittedModel, rng: np.random.Generator) -> Iterator[Servo]:
    """Machines at a candidate's best place, each off its datasheet by chance."""
    hypothesis, place = candidate.hypothesis, candidate.best.place
    spread = spread_of(hypothesis.unit)
    for _ in range(_RUNS):
        off = spread.draw(rng)
        yield hypothesis.machine(place, int(rng.integers(2**30)), off).servo(hypothesis.unit)


def _shares(magnitudes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shares (..., 2) of the fundamental, of magnitudes (..., points, at least 3 in its last)."""
    *_, fundamental, two, three = np.moveaxis(np.maximum(magnitudes, _NOTHING), -1, 0)
    return np.stack([_mean(two / fundamental), _mean(three / fundamental)], axis=-1)


def _mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Geometric mean over points (..., points): a resonance counts as one of them."""
    return np.asarray(np.exp(np.log(values).mean(axis=-1)))
