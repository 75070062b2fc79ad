"""Whether a response fits the plain model at other settings than it states: levels, direction, Hz.

Owns the question for settings that change the motion: source levels given as another measure of the
same voltage, and the direction of the sweep. Each is stated otherwise, a few of its rows are
simulated with the plain model, and what is left decides, by the rule of
`analysis.estimate.frequency_scale`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from analysis.ensemble.datasheet_spread import spread_of
from analysis.ensemble.machine import Machine
from analysis.ensemble.run_cache import run_families
from analysis.estimate.design import Axis, Families, wide_families
from analysis.estimate.frequency_scale import REFUTED, frequency_doubt, undoes
from analysis.estimate.posterior import match_runs, robust_rms
from analysis.execution.blas import on_one_core
from analysis.execution.executor import Executor
from analysis.execution.progress import Progress
from analysis.observation.observation import Observation, observe
from analysis.observation.rounding import settled
from analysis.observation.thinning import thin_responses
from daq.errors import LashbenchError
from daq.frf import FrequencyResponse
from sim.effects import EffectSetting
from sim.unit import Unit

__all__ = ["Doubt", "doubt_settings", "search_doubt"]

_POINTS, _LEVELS = 21, 3
"""Frequencies of a level, and levels, that are simulated at other settings."""

_FEWEST = 8
"""Frequencies without which nothing is said."""

_MEASURES: Mapping[float, str] = {
    0.5: "source levels look like peak-to-peak values: divide source_vpk by 2",
    1.0 / math.sqrt(2.0): "source levels look like peak values that were taken for rms and "
    "multiplied by 1.414: divide source_vpk by 1.414",
    math.sqrt(2.0): "source levels look like rms values: multiply source_vpk by 1.414",
    2.0: "source levels look like peak values that were taken for peak-to-peak and halved: "
    "multiply source_vpk by 2",
}
"""What stated levels can be, by the factor that makes peak values of them."""

_TURNED: Mapping[str, Literal["up", "down"]] = {"up": "down", "down": "up"}


@dataclass(frozen=True, slots=True)
class Doubt:
    """A setting that is likely stated wrongly.

    `words`: what and how to mend it. `rival`: causes of the catalogue that do as much; empty where
    the mistake alone explains the response.
    """

    words: str
    rival: str = ""

    @property
    def warning(self) -> str:
        """The sentence with what else explains the response."""
        return f"{self.words}; or {self.rival}" if self.rival else self.words


@dataclass(frozen=True, slots=True)
class _Bench:
    """Where machines are simulated, and what is free of them."""

    unit: Unit
    axes: tuple[Axis, ...]
    seed: int
    executor: Executor | None

    def families(self, seen: Observation) -> Families:
        return wide_families(self.axes, seen, spread_of(self.unit), self.seed)

    def left(
        self,
        responses: Sequence[FrequencyResponse],
        alter: Callable[[Machine], Machine] = lambda machine: machine,
    ) -> float:
        """Robust misfit, standard deviations, of the plain model or of altered machines."""
        seen = observe(*responses)
        machines = self.families(seen)
        altered = [tuple(map(alter, family)) for family in machines]
        draws = run_families(self.unit, altered, seen, executor=self.executor)
        plain = replace(draws, machines=tuple(one for family in machines for one in family))
        return robust_rms(match_runs(self.unit, seen, self.axes, plain, self.seed))


def doubt_settings(
    responses: Sequence[FrequencyResponse],
    unit: Unit,
    axes: Sequence[Axis],
    *,
    seed: int = 0,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Doubt | None:
    """Which setting is likely stated wrongly, of a response that the plain model does not fit.

    Parameters
    ----------
    responses
        Sweeps of one unit, settled.
    axes
        What is free of the plain model.
    """
    few = [_few(response) for response in responses]
    bench = _Bench(unit, tuple(axes), seed, executor)
    given = bench.left(few)
    if given < REFUTED:
        return None
    tried: list[tuple[float, float, str]] = []
    others: list[tuple[float, str]] = [(factor, words) for factor, words in _MEASURES.items()]
    if not any(one.from_rest for one in few):
        others.append((0.0, ""))
    for number, (factor, words) in enumerate(others):
        if progress is not None:
            progress(number / len(others), "trying other levels and the other direction")
        said, changed = (words, _louder(few, factor)) if factor else _turned(few)
        try:
            tried.append((bench.left(changed), factor, said))
        except LashbenchError:
            # A level beyond belief: not that, then.
            continue
    left, factor, said = min(tried, default=(given, 0.0, ""))
    if not undoes(left, given):
        return None
    words = (
        f"{said}; with that the model leaves {left:.1f} standard deviations in place of {given:.1f}"
    )
    return Doubt(words, _rival(bench, few, factor, given) if factor else "")


@on_one_core()
def search_doubt(
    responses: Sequence[FrequencyResponse],
    unit: Unit,
    axes: Sequence[Axis],
    *,
    cache: Path | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Doubt | None:
    """Which setting, frequencies among them, is likely stated wrongly: asked before any cause is.

    Parameters
    ----------
    cache
        Folder that keeps what is simulated of the sweep as stated; an estimate uses the same.
    """
    responses, _ = thin_responses(tuple(map(settled, responses)))
    seen, bench = observe(*responses), _Bench(unit, tuple(axes), 0, executor)
    if len(np.unique(seen.frequency_hz)) < _FEWEST:
        return None
    draws = run_families(unit, bench.families(seen), seen, cache=cache, executor=executor)
    said = frequency_doubt(
        seen, draws, lambda rows, runs: robust_rms(match_runs(unit, rows, bench.axes, runs))
    )
    if said:
        return Doubt(said)
    if robust_rms(match_runs(unit, seen, bench.axes, draws)) < REFUTED:
        return None
    return doubt_settings(responses, unit, axes, executor=executor, progress=progress)


def _few(response: FrequencyResponse) -> FrequencyResponse:
    """Some levels, from lowest to highest, and some frequencies of each."""
    levels = np.unique(response.source_vpk)
    levels = levels[np.unique(np.linspace(0, len(levels) - 1, _LEVELS).round().astype(int))]
    rows = []
    for level in levels:
        of = np.flatnonzero(response.source_vpk == level)
        of = of[np.argsort(response.frequency_hz[of], kind="stable")]
        rows.append(of[np.unique(np.linspace(0, len(of) - 1, _POINTS).round().astype(int))])
    return response.take(np.sort(np.concatenate(rows)))


def _louder(responses: Sequence[FrequencyResponse], factor: float) -> list[FrequencyResponse]:
    return [replace(one, source_vpk=factor * one.source_vpk) for one in responses]


def _turned(responses: Sequence[FrequencyResponse]) -> tuple[str, list[FrequencyResponse]]:
    turned = [_TURNED[one.direction or "up"] for one in responses]
    stated = responses[0].direction or "up"
    words = f"the sweep direction looks like {turned[0]}, not {stated}: change it"
    changed = zip(responses, turned, strict=True)
    return words, [replace(one, direction=way) for one, way in changed]


def _rival(bench: _Bench, few: Sequence[FrequencyResponse], factor: float, given: float) -> str:
    """Motor friction that is off by one factor, alone or with the backlash, if it does as much.

    Friction, backlash and level together make no difference, so a level that is off by a factor
    is friction and backlash that are off by the inverse of it.
    """
    unit = bench.unit
    dry = EffectSetting("motor-coulomb-friction", {"T_f_m": unit.motor.T_f_m / factor})

    def rubbing(machine: Machine) -> Machine:
        return replace(machine, effects=(*machine.effects, dry))

    def looser(machine: Machine) -> Machine:
        total = unit.backlash.b_t_deg if machine.b_t_deg is None else machine.b_t_deg
        return replace(rubbing(machine), b_t_deg=total / factor)

    times = f"{1.0 / factor:.3g} times its datasheet value"
    if undoes(bench.left(few, rubbing), given):
        return f"motor friction {times} explains as much"
    if undoes(bench.left(few, looser), given):
        return f"motor friction and backlash, each {times}, explain as much"
    return ""
