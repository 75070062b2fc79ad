"""Reading a peak or a notch that no linear model describes.

Owns the local parabola in the logarithm of the gain and the extremum of the
grid, each with an error that holds for one draw of a scattering response. It
knows nothing of poles and zeros and does not choose which extremum counts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc

from analysis.resonance.extrema import Curve
from analysis.resonance.half_power import measure_half_power
from analysis.resonance.neighbour_noise import Vector

__all__ = ["PeakReading", "read_peak", "shape_error"]

WINDOWS = (0.5, 0.7, 1.0)
"""Half-windows of the parabola in half-power half-widths."""
LEAST_POINTS = 5
"""A parabola through fewer readings cannot be tested."""
LEAST_PROBABILITY = 0.01
"""A parabola whose chi-square is less likely than this does not fit."""
CLEAR_CURVATURE = 2.5
"""The curvature must exceed this many of its standard errors."""
SHAPE_STEPS = 0.2
"""Standard error, in steps of the sweep, of taking a nonlinear response for a smooth one
between its readings."""
SAME_DEPTH = 2.0
"""The vertex and the smoothed curve must agree in gain within this many standard errors."""
JUMP_DB = 3.0
"""A smaller step from one reading to the next is no cliff, dB."""
JUMP_SHARE = 0.5
"""Share of a step that the one on the other side lacks from which on it is called a jump."""
DRAWS = 200
"""Draws of the noise that say which readings could be the extremum."""


@dataclass(frozen=True, slots=True)
class PeakReading:
    """Frequency and gain of an extremum, each with one standard error; Hz and dB.

    `jump` says that the response leaps next to the extremum.
    """

    frequency_hz: float
    std_hz: float
    gain_db: float
    gain_std_db: float
    method: Literal["parabola", "grid"]
    jump: bool = False


def read_peak(curve: Curve, index: int, sign: int, first: int, last: int) -> PeakReading:
    """The extremum near a grid point: by parabola where one fits, else off the grid.

    Parameters
    ----------
    curve
        The smoothed level.
    index
        Grid point of the extremum of the smoothed curve.
    sign
        ``+1`` for a maximum, ``-1`` for a minimum.
    first, last
        Grid points between which the extremum may lie, both included; neither
        is an end of the band.
    """
    grid = _grid_extremum(curve, index, sign, first, last)
    fits = _parabolas(curve, index, sign, first, last)
    depth, error = curve.smooth_db[index], curve.std_db[index]
    shape = shape_error(curve.frequency_hz, index)
    best = grid
    for fit, probability in fits:
        # A vertex that the smoothed curve does not show is a few readings' luck.
        off = abs(fit.gain_db - depth) / np.hypot(fit.gain_std_db, error)
        if off > SAME_DEPTH or not probability > LEAST_PROBABILITY:
            continue
        # A wider window has less noise and more of the peak's skewness in it: how far
        # the window moves the vertex beyond chance counts as error, and so does the grid.
        moved = max(_moved(fit, other) for other in (fits[0][0], fits[-1][0], grid))
        std = float(np.sqrt(fit.std_hz**2 + moved**2 + shape**2))
        if std < best.std_hz:
            best = replace(fit, std_hz=std)
    return best


def shape_error(frequency_hz: Vector, index: int) -> float:
    """Standard error of an extremum for not knowing a nonlinear response between readings, Hz."""
    return float(SHAPE_STEPS * 0.5 * (frequency_hz[index + 1] - frequency_hz[index - 1]))


def _moved(one: PeakReading, other: PeakReading) -> float:
    """How far two readings of the same data differ beyond the difference of their variances, Hz."""
    moved = (one.frequency_hz - other.frequency_hz) ** 2
    return float(np.sqrt(max(0.0, moved - abs(one.std_hz**2 - other.std_hz**2))))


def _parabolas(
    curve: Curve, index: int, sign: int, first: int, last: int
) -> list[tuple[PeakReading, float]]:
    """Parabolas with a clear vertex, narrowest window first, each with its chi-square's chance."""
    f = curve.frequency_hz
    points = measure_half_power(f, curve.smooth_db, index, sign)
    sides = (f[index] - points.low_hz, points.high_hz - f[index], f[last] - f[first])
    reach = np.nanmin(sides)
    found = []
    for window in WINDOWS:
        rows = np.flatnonzero(np.abs(f - f[index]) <= window * reach * (1.0 + 1e-9))
        rows = rows[(rows >= first) & (rows <= last)]
        if rows.size >= LEAST_POINTS and rows[0] < index < rows[-1]:
            fit = _parabola(f[rows], curve.raw_db[rows], curve.noise_db[rows], sign)
            found += [fit] if fit is not None else []
    return found


def _parabola(
    f: Vector, gain: Vector, noise: Vector, sign: int
) -> tuple[PeakReading, float] | None:
    """Least-squares parabola and its chi-square's chance; None without a clear vertex inside."""
    centre, half = 0.5 * (f[0] + f[-1]), 0.5 * (f[-1] - f[0])
    u = (f - centre) / half
    basis = np.stack([np.ones_like(u), u, u * u], axis=1)
    weight = 1.0 / (noise**2 + np.median(noise**2))
    try:
        operator = np.linalg.solve(basis.T @ (weight[:, None] * basis), basis.T * weight)
    except np.linalg.LinAlgError:
        return None
    a = operator @ gain
    dof = u.size - 3
    misfit = float(np.sum(((gain - basis @ a) / noise) ** 2))
    covariance = (operator * noise**2) @ operator.T * max(1.0, misfit / dof)
    if -sign * a[2] < CLEAR_CURVATURE * np.sqrt(covariance[2, 2]):
        return None
    vertex = -a[1] / (2.0 * a[2])
    if abs(vertex) > 0.9:
        return None
    by_a = np.array([0.0, -1.0, -2.0 * vertex]) / (2.0 * a[2])
    at = np.array([1.0, vertex, vertex**2])
    reading = PeakReading(
        frequency_hz=float(centre + half * vertex),
        std_hz=float(half * np.sqrt(by_a @ covariance @ by_a)),
        gain_db=float(at @ a),
        gain_std_db=float(np.sqrt(at @ covariance @ at)),
        method="parabola",
    )
    return reading, float(gammaincc(dof / 2.0, misfit / 2.0))


def _grid_extremum(curve: Curve, index: int, sign: int, first: int, last: int) -> PeakReading:
    """The grid's extremum, spread over every point that could be it within its error."""
    g = sign * curve.smooth_db
    # Beyond the next valley (or hill) another feature begins.
    first = max(first, int(np.argmin(g[: index + 1])))
    last = min(last, index + int(np.argmin(g[index:])))
    rows = np.arange(first, last + 1)
    gain, std = curve.smooth_db[rows], curve.std_db[rows]
    # A fixed stream: the same data give the same answer.
    noise = np.random.default_rng(0).standard_normal((DRAWS, rows.size))
    winners = np.argmax(sign * gain + std * noise, axis=1)
    share = np.bincount(winners, minlength=rows.size) / DRAWS
    place, spread, jump = _within_cell(curve, g, rows)
    mean, level = float(share @ place), float(share @ gain)
    return PeakReading(
        frequency_hz=mean,
        std_hz=float(np.sqrt(share @ (spread**2 + (place - mean) ** 2))),
        gain_db=level,
        gain_std_db=float(np.sqrt(share @ (std**2 + (gain - level) ** 2))),
        method="grid",
        jump=bool(share @ jump > 0.5),
    )


def _within_cell(
    curve: Curve, g: Vector, rows: NDArray[np.intp]
) -> tuple[Vector, Vector, NDArray[np.bool_]]:
    """Where between readings a maximum lies if a given one is the highest; mean, spread, jump.

    A peak of one hump lies between the two neighbours of its highest reading, most
    likely near it: a triangular density. The more the response falls off a cliff
    on one side, the more it lies anywhere up to the reading on that side: a
    uniform one. Where the curve was smoothed it lies anywhere within half a step of
    the vertex of the parabola through the three.
    """
    f = curve.frequency_hz
    before, here, after = f[rows - 1], f[rows], f[rows + 1]
    left, right = np.maximum(g[rows] - g[[rows - 1, rows + 1]], 0.0)
    steep, total = np.maximum(left, right), np.where(left + right > 0.0, left + right, np.inf)
    far = np.where(right > left, after, before)
    cliff = np.where(steep > JUMP_DB, np.abs(right - left) / np.maximum(steep, JUMP_DB), 0.0)
    smoothed = curve.std_db[rows] < curve.noise_db[rows]
    lean = 0.5 * (left - right) / total
    vertex = here + lean * np.where(lean > 0.0, after - here, here - before)
    uniform, triangular = np.sqrt(1.0 / 12.0), np.sqrt(1.0 / 24.0)
    place = np.where(smoothed, vertex, here + 0.5 * cliff * (far - here))
    spread = np.where(
        smoothed,
        0.5 * (after - before) * uniform,
        cliff * np.abs(far - here) * uniform + (1.0 - cliff) * (after - before) * triangular,
    )
    return place, spread, cliff > JUMP_SHARE
