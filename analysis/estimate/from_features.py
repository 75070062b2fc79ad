"""The paper's estimate: the error index over the contribution ratio, with error bars.

Owns equation (21) as a curve over the ratio, read from simulated sweeps by the
same extractor that reads the measurement, and the estimate that two
frequencies alone allow. It fits no whole response.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.ensemble.datasheet_spread import feature_spread
from analysis.ensemble.machine import Draws
from analysis.estimate.error_index import error_index
from analysis.observation.observation import Observation
from analysis.resonance import extract
from daq.errors import AnalysisError, InputError
from daq.frf import DB_PER_NEPER, FrequencyResponse
from daq.plan import SweepPlan
from sim.response import Servo, response_of_cycles, simulate_cycles
from sim.unit import Unit

__all__ = ["FeatureFit", "IndexCurve", "fit_features", "index_curve_of_response"]

PAPER_LEVEL_VPK = 2.5
"""The source level of the paper's sweeps."""

_LOWEST_HZ, _HIGHEST_HZ = 2.0, 2000.0
"""Features that are looked for in steps of 1 Hz."""

_READING_STD_HZ = 0.5
"""A frequency that comes without an error bar was read off a grid of 1 Hz."""

_RATIOS = np.linspace(0.0, 1.0, 101)
_WIDTH = 0.15


@dataclass(frozen=True, slots=True, eq=False)
class IndexCurve:
    """Error index over the contribution ratio; arrays (ratios,), Hz.

    `minimum_ratio` is where the curve is least.
    """

    ratios: NDArray[np.float64]
    hz: NDArray[np.float64]
    std_hz: NDArray[np.float64]

    @property
    def minimum_ratio(self) -> float:
        """Ratio of the least index."""
        return float(self.ratios[int(np.nanargmin(self.hz))])

    @property
    def minimum(self) -> tuple[float, float]:
        """The least index and its standard error, Hz."""
        least = int(np.nanargmin(self.hz))
        return float(self.hz[least]), float(self.std_hz[least])

    def to_json(self) -> dict[str, Any]:
        """The ``error_index`` part of ``estimate --json``."""
        return {
            "ratio": self.ratios.tolist(),
            "hz": self.hz.tolist(),
            "std_hz": self.std_hz.tolist(),
            "minimum_ratio": self.minimum_ratio,
        }

    def summary(self) -> str:
        """One line of text."""
        hz, std = self.minimum
        return (
            f"  error index (the paper's measure): least at ratio {self.minimum_ratio:.2f}, "
            f"{hz:.1f} +- {std:.1f} Hz"
        )


@dataclass(frozen=True, slots=True, eq=False)
class FeatureFit:
    """Posterior weights over ratios from two frequencies, and the index curve."""

    ratios: NDArray[np.float64]
    weight: NDArray[np.float64]
    curve: IndexCurve
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _FeatureCurve:
    """Simulated ARF and RF over the ratio: mean and spread of single sweeps, Hz."""

    arf: NDArray[np.float64]
    arf_std: NDArray[np.float64]
    rf: NDArray[np.float64]
    rf_std: NDArray[np.float64]


def index_curve_of_response(
    response: FrequencyResponse, observation: Observation, draws: Draws
) -> IndexCurve | None:
    """The error index of a measured response against the draws made for its fit.

    Taken at the source level nearest to the paper's. None where the
    measurement or the simulations show no pair of features. Of an observation
    of several responses it is the first.
    """
    level = min(response.levels_vpk, key=lambda v: abs(v - PAPER_LEVEL_VPK))
    (measured,) = extract(response.at_level(level))
    if measured.arf is None or measured.rf is None:
        return None
    rows = next(
        rows[observation.source_vpk[rows] == level]
        for plan, rows in observation.plans
        if level in plan.levels_vpk
    )
    plain = [i for i, m in enumerate(draws.machines) if not m.deviations and m.b_t_deg is None]
    picked = plain[:: max(len(plain) // _MOST_READ, 1)]
    if not picked:
        return None
    sweeps = []
    read = draws.channels(observation)
    for i in picked:
        channels = read[i][:, rows]
        sweeps.append(
            FrequencyResponse.from_arrays(
                observation.frequency_hz[rows],
                level,
                np.exp(channels[0] + 1j * channels[1]),
                unit=response.unit,
                gain_std_db=DB_PER_NEPER * np.exp(channels[2]),
            )
        )
    try:
        curve = _feature_curve(np.array([draws.machines[i].ratio for i in picked]), sweeps)
    except AnalysisError:
        return None
    return _index_curve(
        curve, (measured.arf.frequency_hz, measured.arf.std_hz),
        (measured.rf.frequency_hz, measured.rf.std_hz),
    )  # fmt: skip


def fit_features(
    arf_hz: float,
    rf_hz: float,
    unit: Unit,
    *,
    seed: int = 0,
    progress: Callable[[float, str], None] | None = None,
) -> FeatureFit:
    """Posterior of the ratio from an anti-resonance and a resonance at 2.5 V peak.

    The misfit that the best ratio leaves widens the posterior: a model that
    cannot meet both frequencies does not know the ratio as well as its scatter
    pretends.

    Raises
    ------
    InputError
        If the frequencies are not positive, not in order, or beyond what is looked for.
    AnalysisError
        If the simulated unit shows no such features near them.
    """
    if not (np.isfinite(arf_hz) and np.isfinite(rf_hz) and 0 < arf_hz < rf_hz):
        raise InputError(
            f"ARF {arf_hz:g} Hz and RF {rf_hz:g} Hz: both must be above 0, and ARF below RF"
        )
    if arf_hz < _LOWEST_HZ or rf_hz > _HIGHEST_HZ:
        raise InputError(
            f"ARF {arf_hz:g} Hz and RF {rf_hz:g} Hz: both must lie from {_LOWEST_HZ:g} to "
            f"{_HIGHEST_HZ:g} Hz, as they are looked for in steps of 1 Hz; give them in Hz"
        )
    band = np.arange(np.floor(0.75 * arf_hz), np.ceil(1.35 * rf_hz) + 1.0)
    plan = SweepPlan(
        tuple(band.tolist()), (PAPER_LEVEL_VPK,), settle_cycles=40, integrate_cycles=40,
        from_rest=True,
    )  # fmt: skip
    ratios = np.repeat(np.linspace(0.0, 1.0, 21), 3)
    servos = [Servo.of(unit, float(r), seed=seed + i) for i, r in enumerate(ratios)]
    if progress is not None:
        progress(0.05, "simulating sweeps over the ratio")
    runs = simulate_cycles(servos, plan)
    if progress is not None:
        progress(0.8, "reading the simulated sweeps")
    curve = _feature_curve(ratios, [response_of_cycles(c, plan, unit.name, {}) for c in runs])
    index = _index_curve(curve, (arf_hz, _READING_STD_HZ), (rf_hz, _READING_STD_HZ))

    share, _ = feature_spread(unit)
    arf_std = np.hypot(curve.arf_std, np.hypot(_READING_STD_HZ, share * arf_hz))
    rf_std = np.hypot(curve.rf_std, np.hypot(_READING_STD_HZ, share * rf_hz))
    chi2 = ((curve.arf - arf_hz) / arf_std) ** 2 + ((curve.rf - rf_hz) / rf_std) ** 2
    excess = max(float(np.nanmin(chi2)), 1.0)
    score = -0.5 * chi2 / excess - np.log(arf_std) - np.log(rf_std)
    weight = np.exp(score - np.nanmax(score))
    weight = np.where(np.isfinite(weight), weight, 0.0)
    warnings = []
    least, std = index.minimum
    if least > 2.0 * std and excess > _UNEXPLAINED:
        warnings.append(
            f"the best error index, {least:.1f} +- {std:.1f} Hz, is more than the error bars "
            "explain: the model lacks something, and the interval is widened for it"
        )
    if progress is not None:
        progress(1.0, "done")
    return FeatureFit(_RATIOS, weight / weight.sum(), index, tuple(warnings))


def _feature_curve(ratios: NDArray[np.float64], sweeps: list[FrequencyResponse]) -> _FeatureCurve:
    arf, rf = [], []
    for sweep in sweeps:
        (found,) = extract(sweep)
        arf.append(found.arf.frequency_hz if found.arf else np.nan)
        rf.append(found.rf.frequency_hz if found.rf else np.nan)
    arf_mean, arf_std = _smooth(ratios, np.array(arf))
    rf_mean, rf_std = _smooth(ratios, np.array(rf))
    return _FeatureCurve(arf_mean, arf_std, rf_mean, rf_std)


def _index_curve(
    curve: _FeatureCurve, arf: tuple[float, float], rf: tuple[float, float]
) -> IndexCurve:
    index = error_index(
        curve.arf, curve.rf, arf[0], rf[0], arf_s_std_hz=curve.arf_std,
        rf_s_std_hz=curve.rf_std, arf_e_std_hz=arf[1], rf_e_std_hz=rf[1],
    )  # fmt: skip
    return IndexCurve(_RATIOS, index.value_hz, index.std_hz)


def _smooth(
    ratios: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Local linear regression over the ratio, robust: centre and spread of single sweeps.

    Raises
    ------
    AnalysisError
        If too few sweeps show the feature.
    """
    seen = np.isfinite(values)
    if seen.sum() < _FEWEST_SWEEPS:
        raise AnalysisError("the simulated unit shows no such feature in this band")
    x, y = ratios[seen], values[seen]
    mean, std = np.empty_like(_RATIOS), np.empty_like(_RATIOS)
    for i, r in enumerate(_RATIOS):
        near = np.exp(-0.5 * ((x - r) / (0.5 * _WIDTH)) ** 2)
        trust = near.copy()
        basis = np.column_stack([np.ones_like(x), x - r])
        for _ in range(4):
            normal = (basis.T * trust) @ basis + 1e-9 * np.eye(2)
            line = np.linalg.solve(normal, (basis.T * trust) @ y)
            residual = y - basis @ line
            scale = max(1.4826 * _weighted_median(np.abs(residual), near), 0.1)
            trust = near / (1.0 + (residual / (2.0 * scale)) ** 2)
        mean[i], std[i] = line[0], scale
    return mean, std


def _weighted_median(values: NDArray[np.float64], weight: NDArray[np.float64]) -> float:
    order = np.argsort(values)
    share = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(share, 0.5 * share[-1])])


_FEWEST_SWEEPS = 8
_MOST_READ = 48
_UNEXPLAINED = 4.0
