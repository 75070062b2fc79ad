"""The result of commissioning: what each parameter of a drive is, and how well it is known.

Owns the checks before the identification, the result as JSON and in words, and the refusal of a
drive that its datasheet's parameters do not explain. It writes no file.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.commissioning.coordinates import RATIO, Coordinates
from analysis.commissioning.identification import Identified, identify
from analysis.commissioning.next_sweep import NextSweep, propose_next_sweep
from analysis.execution.executor import Executor
from analysis.execution.progress import Progress
from analysis.observation.joint import check_together
from analysis.observation.observation import Observation, observe
from analysis.observation.rounding import settled
from analysis.observation.stated_error import error_doubts
from analysis.observation.thinning import thin_responses
from daq.errors import AnalysisError, InputError
from daq.frf import FrequencyResponse
from sim.engine.effort import counting
from sim.unit import Unit

__all__ = ["Commissioned", "Parameter", "commission_drive", "sweep_identity"]

DETERMINED = 0.7
"""A parameter counts as determined where its posterior is so much narrower than its prior."""

_FEWEST = 15
"""Frequencies without which parameters are fitted to noise."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter: `datasheet` and `value` in SI units, degrees for backlash.

    `believed`, `std` and `conditional` are standard deviations as shares of the value: by the
    datasheet, by the sweeps, and by the sweeps if all other parameters were known. Of the
    contribution ratio they are absolute, and `datasheet` is None.
    """

    symbol: str
    datasheet: float | None
    believed: float | None
    value: float
    std: float
    conditional: float

    @property
    def determined(self) -> bool:
        """Whether the sweeps tell it clearly better than the datasheet."""
        prior = 1.0 / np.sqrt(12.0) if self.believed is None else self.believed
        return self.std < DETERMINED * prior

    def to_json(self) -> dict[str, Any]:
        """Its entry in the document of ``commission --json``."""
        return {
            "datasheet": self.datasheet,
            "tolerance": self.believed,
            "value": self.value,
            "std_share" if self.datasheet is not None else "std": self.std,
            "std_share_others_known" if self.datasheet is not None else "std_others_known":
                self.conditional,
            "determined": self.determined,
        }  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Commissioned:
    """The parameters of a drive, identified from its sweeps.

    `covariance` (d, d) of the logarithms of the values, in the order of `parameters`; of the
    contribution ratio itself. `directions`: how many independent combinations the sweeps tell.
    """

    unit: Unit
    parameters: tuple[Parameter, ...]
    covariance: np.ndarray
    directions: int
    misfit: float
    sweeps: tuple[dict[str, Any], ...]
    next_sweep: NextSweep | None
    warnings: tuple[str, ...]
    elapsed_s: float
    simulated_s: float

    def to_json(self) -> dict[str, Any]:
        """The document of ``commission --json``."""
        return {
            "unit": self.unit.name,
            "parameters": {one.symbol: one.to_json() for one in self.parameters},
            "covariance": {
                "order": [one.symbol for one in self.parameters],
                "of": "natural logarithms of the values; the contribution ratio itself",
                "matrix": self.covariance.tolist(),
            },
            "determined_directions": self.directions,
            "residual_sigma": self.misfit,
            "sweeps": list(self.sweeps),
            "next_sweep": None if self.next_sweep is None else self.next_sweep.to_json(),
            "warnings": list(self.warnings),
            "elapsed_s": self.elapsed_s,
            "simulated_s": self.simulated_s,
        }

    def summary(self) -> list[str]:
        """Lines of text for a person."""
        lines = [
            f"{self.unit.name}: {len(self.parameters)} parameters, {self.directions} independent "
            "combinations of them determined",
            f"  {'parameter':<20}{'datasheet':>12}{'':8}{'identified':>12}{'':8}alone*",
        ]
        for one in self.parameters:
            known = "" if one.datasheet is None else f"{one.datasheet:.4g}"
            absolute = one.datasheet is None
            by = ["" if x is None else f"+-{x:.3f}" if absolute else f"+-{100 * x:.2g} %"
                  for x in (one.believed, one.std, one.conditional)]  # fmt: skip
            lines.append(
                f"  {one.symbol:<20}{known:>12}{by[0]:>8}{one.value:>12.4g}{by[1]:>8}{by[2]:>8}"
                + ("" if one.determined else "  as the datasheet says")
            )
        lines.append("  * error if all other parameters were known")
        if self.next_sweep is not None:
            lines += self.next_sweep.lines()
        return lines


def commission_drive(
    responses: Sequence[FrequencyResponse],
    unit: Unit,
    *,
    total_backlash_unknown: bool = False,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Commissioned:
    """Identify the parameters of a drive that is known to be good.

    Parameters
    ----------
    responses
        Its sweeps, at two source levels or more in all.
    unit
        Its datasheet, and how far that is believed.
    total_backlash_unknown
        Identify the total backlash, too.

    Raises
    ------
    AnalysisError
        If no parameters within their tolerance explain the sweeps, a response has no usable point,
        or a motion grew without bound.
    InputError
        If the responses are of different units or specimens, one is there twice, all values of the
        unit are exact, or they hold too few frequencies.
    """
    started = time.perf_counter()
    check_together(responses)
    kept, doubts = thin_responses(tuple(map(settled, responses)))
    coordinates = Coordinates.of(unit, total_backlash_unknown=total_backlash_unknown)
    if not set(coordinates.symbols) - {RATIO}:
        raise InputError(
            f"unit {unit.name}: all of its values are exact, so that there is nothing to identify; "
            "give --tolerance 8%, or [tolerance] in the unit file"
        )
    observation = observe(*kept)
    if (count := len(np.unique(observation.frequency_hz))) < _FEWEST:
        raise InputError(
            f"the sweeps hold {count} frequencies; identification needs {_FEWEST} or more"
        )
    with counting() as effort:
        found = identify(
            coordinates, observation, seed=seed, executor=executor,
            progress=None if progress is None
            else lambda share: progress(share, "simulating drives like this one"),
        )  # fmt: skip
    if found.unlike:
        raise AnalysisError(
            f"no values within tolerance explain these sweeps: what is left is {found.misfit:.2g} "
            f"times that of simulated {unit.name} drives; diagnose the drive first, or give a "
            "larger --tolerance"
        )
    return Commissioned(
        unit=unit,
        parameters=_parameters(coordinates, found),
        covariance=_covariance(coordinates, found),
        directions=_directions(found),
        misfit=found.misfit,
        sweeps=tuple(_sweep(one) for one in responses),
        next_sweep=propose_next_sweep(coordinates, found.posterior, observation),
        warnings=(*doubts, *error_doubts(tuple(kept)), *_warnings(observation)),
        elapsed_s=time.perf_counter() - started,
        simulated_s=effort.simulated_s,
    )


def sweep_identity(response: FrequencyResponse) -> str:
    """SHA-256 of what was measured: frequency, level, gain and phase to six digits."""
    columns = (response.frequency_hz, response.source_vpk, response.gain.real, response.gain.imag)
    rows = zip(*(column.tolist() for column in columns), strict=True)
    text = "\n".join(" ".join(f"{value:.5e}" for value in row) for row in rows)
    return hashlib.sha256(text.encode()).hexdigest()


def _sweep(response: FrequencyResponse) -> dict[str, Any]:
    serial = response.provenance.get("serial")
    return {
        "sha256": sweep_identity(response),
        "levels_vpk": [float(level) for level in response.levels_vpk],
        "start_hz": float(response.frequency_hz.min()),
        "stop_hz": float(response.frequency_hz.max()),
        "points": len(response),
        **({"serial": str(serial)} if serial else {}),
    }


def _parameters(coordinates: Coordinates, found: Identified) -> tuple[Parameter, ...]:
    known, values = coordinates.unit.parameters, coordinates.values(found.posterior.mean)
    slope = coordinates.slopes(found.posterior.mean)
    std = slope * found.posterior.std
    alone = slope / np.sqrt(np.diag(np.linalg.inv(found.posterior.covariance)))
    believed = coordinates.shares
    return tuple(
        Parameter(
            symbol,
            None if symbol == RATIO else known[symbol],
            None if symbol == RATIO else believed[i],
            values[symbol],
            float(std[i]),
            float(alone[i]),
        )
        for i, symbol in enumerate(coordinates.symbols)
    )


def _covariance(coordinates: Coordinates, found: Identified) -> np.ndarray:
    slope = coordinates.slopes(found.posterior.mean)
    return found.posterior.covariance * np.outer(slope, slope)


def _directions(found: Identified) -> int:
    """Directions in which the posterior is narrower than the prior, which is standard normal."""
    return int(np.count_nonzero(np.linalg.eigvalsh(found.posterior.covariance) < DETERMINED**2))


def _warnings(observation: Observation) -> list[str]:
    if len(observation.levels) > 1:
        return []
    return [
        "the sweeps hold one source level: friction and backlash are told apart by how the "
        "response changes with the level; measure at further levels"
    ]
