"""Where an anti-resonance and a resonance may be: smoothed curves, their valley and their hill.

Owns the smoothing, the choice of the one valley and the one hill that count,
and the verdict that there is none. It gives grid points, never a feature's
final frequency.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.resonance.neighbour_noise import Vector, neighbour_residual, running
from analysis.resonance.samples import Samples
from daq.frf import DB_PER_NEPER

__all__ = ["ExtremumGuess", "Curve", "find_candidates", "smooth_curve"]

TARGETS_DB = {-1: 0.5, 1: 1.0}
"""Standard error that smoothing brings each point to, by sign of the feature. A resonance
is sharp and quiet, an anti-resonance wide and noisy, for noise that does not
depend on the gain is the larger share of a small one."""
REACHES = (2, 3, 4, 5, 6, 8)
"""Neighbours on each side that may take part in smoothing."""
SIGNIFICANT = 5.0
"""Height over its standard error from which on a difference is one: the range of a few
hundred readings of pure noise stays below."""
SIGNIFICANT_WIDE = 3.5
"""The same after the widest smoothing, which leaves far fewer independent readings."""
LEAST_POINTS = 5
"""Fewer readings than this show no extremum with ground on both sides."""
GREATEST_EXCESS = 3.0
"""A scatter further above the stated errors is the response's own shape."""


@dataclass(frozen=True, slots=True)
class Curve:
    """A level's gain in dB, smoothed no more than its noise asks for; shapes (points,).

    Parameters
    ----------
    frequency_hz
        Hz, ascending.
    raw_db, noise_db
        The readings, and the standard error that their neighbourhood shows, dB:
        never below what is stated.
    smooth_db, std_db
        The smoothed gain and its standard error, dB.
    """

    frequency_hz: Vector
    raw_db: Vector
    noise_db: Vector
    smooth_db: Vector
    std_db: Vector


@dataclass(frozen=True, slots=True)
class ExtremumGuess:
    """A valley (sign -1) or hill (sign +1) of a smoothed curve, or why there is none.

    `index` is the grid point of its bottom or top, None where there is none.
    """

    sign: int
    curve: Curve
    index: int | None
    reason: str = ""

    @property
    def at(self) -> int:
        """Index of a candidate that is there.

        Raises
        ------
        ValueError
            If it is not.
        """
        if self.index is None:
            raise ValueError(f"there is no candidate: {self.reason}")
        return self.index


def find_candidates(samples: Samples) -> tuple[ExtremumGuess, ExtremumGuess]:
    """The anti-resonance and the resonance above it, or why either is not there.

    The anti-resonance is the point that lies deepest below higher ground on both
    sides, so that a response that falls off towards the end of a wide band does
    not hide it; the resonance is the highest point above it.
    """
    low, high = (smooth_curve(samples, TARGETS_DB[sign]) for sign in (-1, 1))
    if len(samples) < LEAST_POINTS:
        why = f"usable points: {len(samples)}; {LEAST_POINTS} or more are needed"
        return ExtremumGuess(-1, low, None, why), ExtremumGuess(1, high, None, why)
    wide = smooth_curve(samples, 0.0)
    valley = _valley(low, wide)
    return valley, _hill(high, wide, valley.index)


def smooth_curve(samples: Samples, target_db: float) -> Curve:
    """Smooth by local parabolas, each point with no more neighbours than its noise asks for.

    Parameters
    ----------
    samples
        The level.
    target_db
        Standard error, dB, below which a point is smoothed no further.
    """
    gain, noise = samples.gain_db, _shown_noise(samples)
    smooth, std = gain.copy(), noise.copy()
    for reach in REACHES:
        rough = std > target_db
        if not rough.any() or gain.size < 2 * reach + 1:
            break
        value, error = _local_parabolas(samples.frequency_hz, gain, noise, reach)
        better = rough & (error < std)
        smooth[better], std[better] = value[better], error[better]
    return Curve(samples.frequency_hz, gain, noise, smooth, std)


def _shown_noise(samples: Samples) -> Vector:
    """Noise of each reading in dB; where readings scatter more than stated, that scatter.

    The cycles of a chattering gear train are not independent, so an error from
    their spread is too small.
    """
    noise = samples.std * DB_PER_NEPER
    if len(samples) < 8:
        return noise
    excess = np.abs(neighbour_residual(samples.frequency_hz, samples.gain_db)) / noise
    # 0.6745 is the median of |n| for a standard normal n.
    return noise * np.clip(running(excess, 15, np.median) / 0.6745, 1.0, GREATEST_EXCESS)


def _local_parabolas(
    frequency: Vector, gain: Vector, noise: Vector, reach: int
) -> tuple[Vector, Vector]:
    """Value and standard error at each reading of a parabola through its neighbours."""
    n = gain.size
    rows = np.arange(n)[:, None] + np.arange(-reach, reach + 1)[None, :]
    inside = (rows >= 0) & (rows < n)
    rows = rows.clip(0, n - 1)
    u = frequency[rows] - frequency[:, None]
    u /= np.abs(u).max(axis=1, keepdims=True) * (1.0 + 1.0 / reach)
    taper = np.where(inside, (1.0 - np.abs(u) ** 3) ** 3, 0.0)
    # Half of each weight is common: full inverse variances would follow the quiet
    # flanks and lift the noisy bottom of a valley.
    square = noise[rows] ** 2
    weight = taper / (square + np.median(square, axis=1, keepdims=True))
    basis = np.stack([np.ones_like(u), u, u * u], axis=2)
    normal = np.einsum("nk,nki,nkj->nij", weight, basis, basis)
    normal += 1e-12 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    first = np.linalg.solve(normal, np.broadcast_to(np.eye(3)[:, :1], (n, 3, 1)))[:, :, 0]
    share = weight * np.einsum("ni,nki->nk", first, basis)
    value = np.sum(share * gain[rows], axis=1)
    return value, np.sqrt(np.sum((share * noise[rows]) ** 2, axis=1))


def _valley(curve: Curve, wide: Curve) -> ExtremumGuess:
    g = curve.smooth_db
    left = np.maximum.accumulate(g)
    right = np.maximum.accumulate(g[::-1])[::-1]
    k = int(np.argmax(np.minimum(left, right) - g))
    if _rises_both_ways(curve, wide, k) == (True, True) and not _edge(k, g.size):
        return ExtremumGuess(-1, curve, k)
    reasons = {
        (False, False): "no minimum stands out of the scatter",
        (False, True): "the gain is lowest at the lower edge of the band",
        (True, False): "the gain is lowest at the upper edge of the band",
        (True, True): "the minimum touches the edge of the band",
    }
    return ExtremumGuess(-1, curve, None, reasons[_rises_both_ways(curve, wide, int(np.argmin(g)))])


def _rises_both_ways(curve: Curve, wide: Curve, k: int) -> tuple[bool, bool]:
    """Whether the gain is clearly higher somewhere below and somewhere above a point."""
    return (
        _stands_out(curve, wide, k, slice(0, k), -1),
        _stands_out(curve, wide, k, slice(k + 1, None), -1),
    )


def _hill(curve: Curve, wide: Curve, bottom: int | None) -> ExtremumGuess:
    g = curve.smooth_db
    start = 0 if bottom is None else bottom
    k = start + int(np.argmax(g[start:]))
    edge = _edge(k, g.size)
    if edge:
        return ExtremumGuess(1, curve, None, f"the gain is highest at the {edge} edge of the band")
    if not _stands_out(curve, wide, k, slice(k + 1, None), 1):
        why = "the gain does not fall again clearly before the upper edge of the band"
        return ExtremumGuess(1, curve, None, why)
    if not _stands_out(curve, wide, k, slice(start, k), 1):
        return ExtremumGuess(1, curve, None, "no maximum stands out of the scatter")
    return ExtremumGuess(1, curve, k)


def _edge(k: int, points: int) -> str:
    """Which edge of the band a grid point touches: there with the point next to it, or none."""
    if k <= 1:
        return "lower"
    return "upper" if k >= points - 2 else ""


def _stands_out(curve: Curve, wide: Curve, k: int, side: slice, sign: int) -> bool:
    """Whether a point differs clearly from some point on one side, on either curve."""
    return any(
        bool(
            np.any(
                sign * (c.smooth_db[k] - c.smooth_db[side])
                > limit * np.hypot(c.std_db[side], c.std_db[k])
            )
        )
        for c, limit in ((curve, SIGNIFICANT), (wide, SIGNIFICANT_WIDE))
    )
