"""The backlash of both stages from what is believed of the ratio and of the total.

Owns equations (15) and (20) of the paper applied to a posterior, and how a posterior is told: a
mean, one standard deviation and the 95 % interval. It makes no posterior.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.ensemble.model import Hypothesis
from sim.unit import Unit

__all__ = [
    "Backlash",
    "Uncertain",
    "backlash_of_places",
    "backlash_of_sizes",
    "ratio_of",
    "summarise",
]

_REACH, _STEPS = 7.0, 211
"""Standard deviations on either side over which a normal distribution is laid out, and points."""

_REACH_OF_STAGE_3, _STEPS_OF_STAGE_3 = 3.0, 15
"""The same of what a unit says of its third stage."""


@dataclass(frozen=True, slots=True)
class Uncertain:
    """A value with one standard deviation and, where known, its 95 % interval."""

    value: float
    std: float
    interval95: tuple[float, float] | None = None

    def to_json(self) -> dict[str, Any]:
        """As JSON; the interval only where there is one."""
        content: dict[str, Any] = {"value": self.value, "std": self.std}
        if self.interval95 is not None:
            content["interval95"] = list(self.interval95)
        return content


@dataclass(frozen=True, slots=True)
class Backlash:
    """Contribution ratio, backlash of each stage (each at its gear) and in all (at the load).

    `b3_deg`: as the unit says, of a third stage; None where there is none.
    """

    contribution_ratio: Uncertain
    b1_deg: Uncertain
    b2_deg: Uncertain
    b_t_deg: Uncertain
    b3_deg: Uncertain | None = None

    def to_json(self) -> dict[str, Any]:
        """The numbers by the names that documents give them."""
        content = {
            "contribution_ratio": self.contribution_ratio.to_json(),
            "b1_deg": self.b1_deg.to_json(),
            "b2_deg": self.b2_deg.to_json(),
            "b_t_deg": self.b_t_deg.to_json(),
        }
        return content if self.b3_deg is None else content | {"b3_deg": self.b3_deg.to_json()}

    def lines(self, indent: str) -> list[str]:
        """The numbers in words for a person, a line each."""
        rows = [
            ("contribution ratio of stage 1", self.contribution_ratio, 3, ""),
            ("backlash of stage 1, b1", self.b1_deg, 4, "deg"),
            ("backlash of stage 2, b2", self.b2_deg, 4, "deg"),
            ("total backlash, b_t", self.b_t_deg, 4, "deg"),
        ]
        if self.b3_deg is not None:
            rows.insert(3, ("backlash of stage 3, b3, known", self.b3_deg, 4, "deg"))
        lines = []
        for name, number, digits, unit in rows:
            line = (
                f"{indent}{name:<31} {number.value:8.{digits}f} +- {number.std:.{digits}f} {unit}"
            )
            if number.interval95 is not None:
                low, high = number.interval95
                line += f"  (95 %: {low:.{digits}f} to {high:.{digits}f})"
            lines.append(line.rstrip())
        return lines


def backlash_of_places(
    unit: Unit,
    ratios: NDArray[np.float64],
    total_deg: NDArray[np.float64],
    weight: NDArray[np.float64],
) -> Backlash:
    """Equations (15) and (20) at every place of a posterior.

    Parameters
    ----------
    ratios, total_deg
        Contribution ratio and total backlash in degrees at each place, shape (n,).
    weight
        What is believed of each place, shape (n,), sum 1.
    """
    third = None
    if unit.stage3 is not None:
        steps, density = _normal(unit.tolerances["b3_deg"])
        weight = np.outer(weight, density).ravel()
        ratios, total_deg = (np.repeat(one, len(steps)) for one in (ratios, total_deg))
        third = np.minimum(unit.stage3.b3_deg * np.resize(steps, len(ratios)), total_deg)
    shared = total_deg if third is None else total_deg - third
    return Backlash(
        contribution_ratio=summarise(ratios, weight),
        b1_deg=summarise(ratios * shared * unit.output_ratio, weight),
        b2_deg=summarise((1.0 - ratios) * shared * unit.last_ratio, weight),
        b_t_deg=_known(summarise(total_deg, weight)),
        b3_deg=None if third is None else _known(summarise(third, weight)),
    )


def _normal(share: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Multiples (n,) of a value of that tolerance, and what is believed of each (n,)."""
    if not share:
        return np.ones(1), np.ones(1)
    steps = np.linspace(-_REACH_OF_STAGE_3, _REACH_OF_STAGE_3, _STEPS_OF_STAGE_3)
    density = np.exp(-0.5 * steps**2)
    return np.maximum(1.0 + share * steps, 0.0), density / density.sum()


def backlash_of_sizes(hypothesis: Hypothesis, found: ParameterPosterior) -> Backlash:
    """The backlash by a hypothesis whose ratio and sizes are known with their covariance.

    Where the total backlash is one of the sizes it is taken as found, with its correlation to the
    ratio; otherwise it is the unit's. Mean and standard deviation are those of the normal
    distribution that `found` states, so that the ratio is the one told with the sizes; the
    interval is cut where a ratio cannot be, at 0 and at 1.
    """
    unit = hypothesis.unit
    if unit.stages == 1:
        found = _with_known_ratio(found)
    steps = np.linspace(-_REACH, _REACH, _STEPS)
    density = np.exp(-0.5 * steps**2)
    std = float(np.sqrt(found.covariance[0, 0]))
    at = [i for i, (_, p) in enumerate(hypothesis.parameters, start=1) if p.name == "b_t_deg"]
    if not at:
        ratios, weight = found.mean[0] + std * steps, density
        total = np.full(ratios.shape, unit.backlash.b_t_deg)
    else:
        # The ratio first, then the total at each ratio.
        (size,) = at
        slope = float(found.covariance[size, 0]) / std if std else 0.0
        own = float(np.sqrt(max(found.covariance[size, size] - slope**2, 0.0)))
        first, second = (axis.ravel() for axis in np.meshgrid(steps, steps, indexing="ij"))
        ratios, weight = found.mean[0] + std * first, np.outer(density, density).ravel()
        low, high = hypothesis.logs[size - 1]
        total = np.exp(low + (high - low) * (found.mean[size] + slope * first + own * second))
    weight = weight / weight.sum()
    free = backlash_of_places(unit, ratios, total, weight)
    cut = backlash_of_places(unit, np.clip(ratios, 0.0, 1.0), total, weight)
    return Backlash(
        _within(free.contribution_ratio, cut.contribution_ratio),
        _within(free.b1_deg, cut.b1_deg),
        _within(free.b2_deg, cut.b2_deg),
        _within(free.b_t_deg, cut.b_t_deg),
        cut.b3_deg,
    )


def _within(number: Uncertain, inside: Uncertain) -> Uncertain:
    """A number with the interval of another."""
    return replace(number, interval95=inside.interval95)


def ratio_of(unit: Unit, found: ParameterPosterior) -> tuple[float, float]:
    """Contribution ratio and its standard deviation; that of a unit with one stage is 1."""
    if unit.stages == 1:
        return 1.0, 0.0
    return float(found.mean[0]), float(np.sqrt(found.covariance[0, 0]))


def _with_known_ratio(found: ParameterPosterior) -> ParameterPosterior:
    """The same of a unit with one stage, whose runs have no ratio to tell."""
    mean, covariance = found.mean.copy(), found.covariance.copy()
    mean[0] = 1.0
    covariance[0, :] = covariance[:, 0] = 0.0
    return replace(found, mean=mean, covariance=covariance)


def summarise(values: NDArray[np.float64], weight: NDArray[np.float64]) -> Uncertain:
    """Mean, standard deviation and central 95 % interval of weighted values, both shape (n,).

    A number that is the same everywhere is known, without the rounding of weights
    that add up to one but for the last digit.
    """
    if np.ptp(values) == 0.0:
        value = float(values[0])
        return Uncertain(value, 0.0, (value, value))
    mean = float(weight @ values)
    std = float(np.sqrt(weight @ (values - mean) ** 2))
    order = np.argsort(values, kind="stable")
    ranked, share = values[order], np.cumsum(weight[order]) - 0.5 * weight[order]
    low, high = np.interp([0.025, 0.975], share, ranked)
    return Uncertain(mean, std, (float(low), float(high)))


def _known(total: Uncertain) -> Uncertain:
    """A total that was taken from the unit's file has no interval to be told."""
    return total if total.std else replace(total, interval95=None)
