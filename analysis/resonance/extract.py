"""Anti-resonance (ARF), resonance (RF) and damping of a response, per source level.

Owns the order in which the ways of reading a feature are tried: one linear model of the
whole band, then one of each feature, a parabola, the grid; docs/resonance.md says why. The same
reader serves measured and simulated responses, so that its bias cancels. It
draws nothing and never alters a response.
"""

from __future__ import annotations

import math
from dataclasses import astuple

import numpy as np

from analysis.execution.progress import Progress
from analysis.resonance.extrema import ExtremumGuess, find_candidates
from analysis.resonance.half_power import measure_half_power
from analysis.resonance.linear_model.extrema import MOST_ZETA
from analysis.resonance.linear_model.pairs import model_features
from analysis.resonance.linear_model.reader import ModelReading, read_model
from analysis.resonance.local_peak import read_peak, shape_error
from analysis.resonance.model_choice import LinearReading, Start, read_both, read_one
from analysis.resonance.records import Feature, FeaturePair, LevelFeatures, Method, summary, to_json
from analysis.resonance.samples import MOST_POINTS, Samples, level_samples, refuse_levels
from daq.errors import AnalysisError
from daq.frf import FrequencyResponse

__all__ = [
    "Feature",
    "FeaturePair",
    "LevelFeatures",
    "Method",
    "extract",
    "summary",
    "to_json",
]

NOTABLE_SCATTER = 1.25
"""Residuals beyond this many stated errors are worth a flag."""
_MOST_ROWS, _LEAST_GROUPS = 60_000, 256
"""Points of all levels together that are read one by one, and of one level at least."""
_SAME_LEVEL = 1e-9
NAMES = {-1: "arf", 1: "rf"}
"""How flags call a feature, by the sign of its extremum."""


def extract(
    response: FrequencyResponse, progress: Progress | None = None
) -> tuple[LevelFeatures, ...]:
    """Read ARF, RF and damping at every source level.

    Parameters
    ----------
    response
        Measured or simulated. `gain_std_db` and `phase_std_deg` are used where
        given and estimated from the scatter where not; without phase the gain
        alone is read. Rows flagged as spoilt are left out. Of a level with more points
        than an analyser takes neighbours are averaged, and a flag says so.
    progress
        Told the share done after every level.

    Returns
    -------
    One record per level, in ascending level; rows that name no level come last
    as one level. A level whose data carry no feature has None and a flag.

    Raises
    ------
    InputError
        If there are more source levels than any sweep has.
    """
    # Readings may span any range that a float holds; what overflows on the way
    # comes out as not finite and is flagged, so the warnings would say it twice.
    with np.errstate(all="ignore"):
        levels = _levels(response)
        most = int(np.clip(_MOST_ROWS // max(len(levels), 1), _LEAST_GROUPS, MOST_POINTS))
        found = []
        for number, (level, part) in enumerate(levels, start=1):
            found.append(_read_level(level, part, most))
            if progress is not None:
                progress(number / len(levels), f"reading {level:g} V")
    return tuple(found)


def _levels(response: FrequencyResponse) -> list[tuple[float, FrequencyResponse]]:
    """The response at each level, its rows in ascending frequency; nameless rows last."""
    refuse_levels(response)
    nameless = ~np.isfinite(response.source_vpk)
    named = np.flatnonzero(~nameless)
    # By level, then frequency: each level is a stretch.
    order = named[np.lexsort((response.frequency_hz[named], response.source_vpk[named]))]
    level = response.source_vpk[order]
    found = []
    start = 0
    while start < len(level):
        reach = level[start] + _SAME_LEVEL * abs(level[start])
        end = int(np.searchsorted(level, reach, side="right"))
        part = order[start:end]
        part = part[np.argsort(response.frequency_hz[part], kind="stable")]
        found.append((float(level[start]), response.take(part)))
        start = end
    if nameless.any():
        found.append((math.nan, response.take(nameless)))
    return found


def _read_level(source_vpk: float, level: FrequencyResponse, most: int) -> LevelFeatures:
    try:
        samples = level_samples(level, most)
    except AnalysisError as error:
        return LevelFeatures(source_vpk, None, None, None, None, (f"level: {error}",))
    candidates = find_candidates(samples)
    flags = _level_flags(samples)
    reading = read_model(samples)
    if isinstance(reading, ModelReading):
        return model_features(source_vpk, reading, samples, candidates, flags)
    return _Reader(samples, candidates, flags).read(source_vpk)


def _level_flags(samples: Samples) -> list[str]:
    """What is special about the readings of a level."""
    flags = []
    if samples.grouped > 1:
        flags.append(f"level: read from means of {samples.grouped} neighbouring points")
    if not samples.noise_known:
        flags.append("level: no standard errors given; estimated from the scatter")
    if not np.isfinite(samples.phase_std).any():
        flags.append("level: no phase; read from the gain alone")
    return flags


class _Reader:
    """One level while it is being read: its candidates, and the flags gathered so far."""

    def __init__(
        self, samples: Samples, candidates: tuple[ExtremumGuess, ExtremumGuess], flags: list[str]
    ) -> None:
        self.samples = samples
        self.candidates = [c for c in candidates if c.index is not None]
        self.flags = [f"{NAMES[c.sign]}: {c.reason}" for c in candidates if c.index is None] + flags

    def read(self, source_vpk: float) -> LevelFeatures:
        """Both features by one linear model if it fits, else each on its own."""
        starts = {c.sign: self._start(c) for c in self.candidates}
        joint = None
        if len(starts) == 2:
            joint = read_both(self.samples, starts[-1], starts[1])
        covariance = 0.0
        features: dict[int, Feature] = {}
        if joint is not None:
            features = {sign: _linear_feature(joint, k) for k, sign in enumerate((-1, 1))}
            covariance = float(joint.frequency_covariance[0, 1])
            self._note_scatter("level", joint)
        else:
            for candidate in self.candidates:
                features[candidate.sign] = self._alone(candidate, starts[candidate.sign])
        return self._record(source_vpk, features, covariance)

    def _record(
        self, source_vpk: float, features: dict[int, Feature], covariance: float
    ) -> LevelFeatures:
        """Features that are finite, their difference, and the flags."""
        for sign, feature in list(features.items()):
            if not all(math.isfinite(x) for x in astuple(feature) if isinstance(x, float)):
                del features[sign]
                self.flags.append(f"{NAMES[sign]}: the readings span more than can be computed")
        arf, rf = features.get(-1), features.get(1)
        for sign, name in NAMES.items():
            read = features.get(sign)
            if read is not None and (read.damping_ratio or 0.0) > MOST_ZETA:
                kind = "minimum" if sign < 0 else "maximum"
                self.flags.append(
                    f"{name}: a {kind} of the gain with a damping ratio above 0.71 is "
                    f"no {'anti-' if sign < 0 else ''}resonance"
                )
        difference = std = None
        if arf is not None and rf is not None:
            difference = rf.frequency_hz - arf.frequency_hz
            std = math.sqrt(max(0.0, rf.std_hz**2 + arf.std_hz**2 - 2.0 * covariance))
        pairs = () if arf is None and rf is None else (FeaturePair(arf, rf),)
        return LevelFeatures(source_vpk, arf, rf, difference, std, tuple(self.flags), pairs)

    def _start(self, candidate: ExtremumGuess) -> Start:
        """Start values from the half-power points of the smoothed curve."""
        k, f = candidate.at, self.samples.frequency_hz
        points = measure_half_power(f, candidate.curve.smooth_db, k, candidate.sign)
        sides = [w for w in (f[k] - points.low_hz, points.high_hz - f[k]) if math.isfinite(w)]
        width = max(min(sides, default=0.1 * f[k]), (f[k + 1] - f[k - 1]) / 2.0)
        rows = np.flatnonzero(np.abs(f - f[k]) <= 1.5 * width)
        turn = np.unwrap(self.samples.phase[rows])
        side = -1 if candidate.sign < 0 and turn[-1] < turn[0] else 1
        return Start(candidate.sign, float(f[k]), float(width), side)

    def _bounds(self, candidate: ExtremumGuess) -> tuple[int, int]:
        """First and last grid point where a feature may lie: not at an edge, nor past the other."""
        first, last = 1, len(self.samples) - 2
        for other in self.candidates:
            if other.sign > candidate.sign:
                last = min(last, other.at - 1)
            elif other.sign < candidate.sign:
                first = max(first, other.at + 1)
        return first, last

    def _alone(self, candidate: ExtremumGuess, start: Start) -> Feature:
        """One feature by a linear model of its own, else by parabola or off the grid."""
        f, name = self.samples.frequency_hz, NAMES[candidate.sign]
        first, last = self._bounds(candidate)
        peak = read_peak(candidate.curve, candidate.at, candidate.sign, first, last)
        linear, why = read_one(self.samples, start, float(f[first - 1]), float(f[last + 1]))
        if linear is not None:
            linear = linear.beside(peak.frequency_hz, peak.std_hz)
            if len(linear.fit.samples) < len(self.samples):
                # No linear model describes the whole band, so this one is an approximation.
                linear = linear.approximate(shape_error(f, candidate.at))
            self._note_scatter(name, linear)
            return _linear_feature(linear, 0)
        read_off = "" if peak.method == "parabola" else " read off the grid"
        self.flags.append(f"{name}: nonlinear peak{read_off}; {why}")
        if peak.jump:
            self.flags.append(f"{name}: the response jumps there; a repeat may jump elsewhere")
        zeta, zeta_std = self._half_power(candidate)
        found = (
            "from half-power points" if zeta is not None else "unknown; a half-power point lacks"
        )
        self.flags.append(f"{name}: damping {found}")
        return Feature(
            frequency_hz=peak.frequency_hz,
            std_hz=peak.std_hz,
            gain_db=peak.gain_db,
            gain_std_db=peak.gain_std_db,
            damping_ratio=zeta,
            damping_std=zeta_std,
            method=peak.method,
        )

    def _half_power(self, candidate: ExtremumGuess) -> tuple[float | None, float | None]:
        curve = candidate.curve
        points = measure_half_power(
            curve.frequency_hz, curve.smooth_db, candidate.at, candidate.sign, curve.std_db
        )
        zeta = points.damping_ratio
        if not math.isfinite(zeta):
            return None, None
        # The extremum and both crossings lie anywhere between two readings.
        step = shape_error(curve.frequency_hz, candidate.at) / curve.frequency_hz[candidate.at]
        return zeta, math.hypot(points.damping_std, step)

    def _note_scatter(self, name: str, linear: LinearReading) -> None:
        if self.samples.noise_known and linear.inflation > NOTABLE_SCATTER:
            self.flags.append(f"{name}: scatter is {linear.inflation:.1f} times the stated errors")


def _linear_feature(linear: LinearReading, k: int) -> Feature:
    extremum, fit = linear.extrema[k], linear.fit
    by_theta = extremum.gain_gradient_db
    zeta = fit.pairs[k].zeta
    ln_zeta_variance = float(fit.covariance[2 * k + 1, 2 * k + 1])
    return Feature(
        frequency_hz=extremum.frequency_hz,
        std_hz=math.sqrt(linear.frequency_covariance[k, k]),
        gain_db=extremum.gain_db,
        gain_std_db=float(np.sqrt(by_theta @ fit.covariance @ by_theta)) * linear.inflation,
        damping_ratio=zeta,
        damping_std=zeta * math.sqrt(ln_zeta_variance) * linear.inflation,
        method="rational",
    )
