"""Simulated frequency responses: a servo taken through a sweep plan, as a bench would.

Owns what lies between a drivetrain and a `FrequencyResponse`: levels and
frequencies in order, the state carried on or put to rest, and the
error bar of every point. It judges nothing.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from itertools import chain, count

import numpy as np
from numpy.typing import NDArray

from daq.errors import AnalysisError
from daq.excitation.plan import ExcitedPlan
from daq.frf import GAIN_STD_COMPONENTS, GAIN_STD_IS, FrequencyResponse, error_words
from daq.plan import SweepPlan
from sim.effects import EffectSetting
from sim.engine.effort import spend
from sim.engine.engine import HARMONICS, LONGEST_STEP_S, Motion, Stretch, carry
from sim.engine.freely import dealt_out, goes_freely, step_freely
from sim.engine.stepping import Asking, shared_out, step_together
from sim.engine.system import Law, PiecewiseLinearSystem
from sim.excitation.simulate import cycles_by_signal
from sim.reading import PERIODIC_SCATTER, response_of_cycles, scatter_of_cycles
from sim.servo import START_SPREAD, Servo, groups_alike, parameters_of, states_at_start
from sim.unit import Unit

__all__ = [
    "DwellRecord",
    "PERIODIC_SCATTER",
    "START_SPREAD",
    "response_of_cycles",
    "scatter_of_cycles",
    "Servo",
    "SteppedServo",
    "simulate",
    "simulate_cycles",
]

_Begun = tuple[NDArray[np.float64], NDArray[np.float64]]
_Swept = tuple[NDArray[np.complex128], float]

_DEAR = 2.2
"""Steps of a shaft that hardens take so many times as long as others, which are within a third of
each other (`tests/benchmarks/engine_speed.py --effects`)."""


def simulate(
    unit: Unit,
    ratio: float,
    plan: SweepPlan,
    *,
    effects: Sequence[EffectSetting] = (),
    seed: int = 0,
    longest_step_s: float = LONGEST_STEP_S,
    progress: Callable[[float], None] | None = None,
) -> FrequencyResponse:
    """Simulate a sweep of one unit.

    Parameters
    ----------
    unit, ratio, effects
        The machine: its parameters, contribution ratio 0 to 1, and what is
        added to the paper model.
    plan
        Levels, frequencies, direction, cycles. The state carries on from point
        to point within a level unless ``plan.from_rest``; each level starts anew.
    seed
        Draws where in its play each mesh rests at the start. The same seed
        gives the same response to the last bit on one machine.
    progress
        Told the share done after each point, from the thread that simulated it.

    Returns
    -------
    FrequencyResponse
        Rows in the order of the levels given, frequencies ascending. Error bars are one
        standard error of the mean over the integrated cycles.

    Raises
    ------
    ConfigurationError
        If the ratio or an effect is not allowed.
    AnalysisError
        If the motion grew without bound.
    """
    servo = Servo.of(unit, ratio, effects, seed)
    done, parts = count(1), len(plan.frequencies_hz)
    if isinstance(plan, ExcitedPlan):
        parts = plan.parts

    def point_done() -> None:
        if progress is not None:
            progress(next(done) / parts)

    (cycles,) = simulate_cycles([servo], plan, longest_step_s=longest_step_s, point_done=point_done)
    provenance = {
        "kind": "simulated",
        GAIN_STD_COMPONENTS: 1,
        GAIN_STD_IS: error_words(plan.integrate_cycles),
        "software": f"lashbench {_version()}",
        "contribution_ratio": float(ratio),
        "effects": [{"id": e.id, **e.values} for e in effects],
        "parameters": unit.parameters,
        "seed": int(seed),
        "longest_step_s": float(longest_step_s),
        "dc_offset_v": plan.dc_offset_v,
    }
    if isinstance(plan, ExcitedPlan):
        provenance |= plan.signal.stated()
        if plan.signal.kind == "noise":
            provenance[GAIN_STD_IS] = "error bar"
            del provenance[GAIN_STD_COMPONENTS]
    return response_of_cycles(cycles, plan, unit.name, provenance)


def simulate_cycles(
    servos: Sequence[Servo],
    plan: SweepPlan,
    *,
    longest_step_s: float = LONGEST_STEP_S,
    shorter_steps_s: Sequence[float] = (),
    single: bool = False,
    workers: int | None = None,
    point_done: Callable[[], None] = lambda: None,
) -> list[NDArray[np.complex128]]:
    """Fourier coefficients of every integrated cycle, for many servos at once.

    Parameters
    ----------
    shorter_steps_s
        Longest steps that are tried in turn where a motion grows without bound, at that frequency
        and the one before; servos that share their linear part with it go along, all others
        keep theirs.
    single
        Step in single precision, at half of the cost (`sim.engine.engine.advance`).
    point_done
        Called after each frequency of each group, from the thread that simulated it.

    Returns
    -------
    list of ndarray
        One per servo, (levels, points, cycles, 4): V_o's coefficients over the
        source level, harmonics 0 to 3, points in ascending frequency.

    Raises
    ------
    AnalysisError
        If a motion grew without bound, at the last of the steps.
    """
    if isinstance(plan, ExcitedPlan):
        return cycles_by_signal(
            servos, plan, longest_step_s=longest_step_s, shorter_steps_s=shorter_steps_s,
            single=single, workers=workers, part_done=lambda share: point_done(),
        )  # fmt: skip
    levels, workers = len(plan.levels_vpk), workers or _cores()
    points = np.asarray(plan.frequencies_hz)
    # Points that start from rest do not depend on each other: sharing those out among the cores
    # leaves the lanes full.
    groups = list(groups_alike(servos, levels, 1 if plan.from_rest else workers))
    lanes = levels * max(map(len, groups), default=1)
    freely = goes_freely(lanes, len(groups) * (len(points) if plan.from_rest else 1), single)
    shares = [slice(None)]
    if plan.from_rest and freely:
        shares = [slice(i, i + 1) for i in range(len(points))]
    elif plan.from_rest and len(groups) < workers:
        shares = _shares(plan, workers)
    steps_s = longest_step_s, *shorter_steps_s

    @cache
    def begun(number: int) -> _Begun:
        group = [servos[i] for i in groups[number]]
        return parameters_of(group, levels), states_at_start(group, levels)

    def swept(number: int, share: slice) -> Asking[_Swept]:
        group, begin = [servos[i] for i in groups[number]], begun(number)
        part = replace(plan, frequencies_hz=tuple(points[share].tolist()))
        # What grows at every step may have begun further back than it was gone through again from.
        for at in range(len(shorter_steps_s)):
            with suppress(AnalysisError):
                return (yield from _sweep(group, part, steps_s[at:], single, point_done, begin))
        return (yield from _sweep(group, part, steps_s[-1:], single, point_done, begin))

    tasks = [(number, share) for share in shares for number in range(len(groups))]
    lots = shared_out([0] * len(tasks), workers, lanes, single)
    if freely:
        lots = dealt_out(len(tasks), workers)

    def stepped(lot: Sequence[int]) -> list[_Swept]:
        askers = [swept(*tasks[i]) for i in lot]
        return step_freely(askers) if freely else step_together(askers)

    with ThreadPoolExecutor(workers) as pool:
        done = dict(zip(chain(*lots), chain(*pool.map(stepped, lots)), strict=True))
    spend(len(servos) * plan.duration_s, sum(d[1] for d in done.values()) * longest_step_s)
    shape = (levels, len(points), plan.integrate_cycles, HARMONICS)
    results = [np.empty(shape, dtype=complex) for _ in servos]
    for i, (number, share) in enumerate(tasks):
        for position, index in enumerate(groups[number]):
            results[index][:, share] = done[i][0][position]
    return results


@dataclass(frozen=True, slots=True)
class DwellRecord:
    """What one dwell at one frequency showed at the analyser's two inputs.

    `source_cycles` (cycles,): complex amplitude of channel 1 in each cycle, V.
    `output_cycles` (cycles, 4): Fourier coefficients of V_o in V; column 0 is
    the mean, columns 1 to 3 the complex amplitudes of those harmonics.
    Peaks are the largest magnitudes seen, V.
    """

    source_cycles: NDArray[np.complex128]
    output_cycles: NDArray[np.complex128]
    source_peak_v: float
    output_peak_v: float


class SteppedServo:
    """A servo on the bench: driven dwell by dwell, its state carried on in between."""

    def __init__(
        self,
        unit: Unit,
        ratio: float,
        effects: Sequence[EffectSetting] = (),
        seed: int = 0,
        longest_step_s: float = LONGEST_STEP_S,
    ) -> None:
        self._servo = Servo.of(unit, ratio, effects, seed)
        self._longest_step_s = longest_step_s
        self.rest()

    def rest(self) -> None:
        """Let the motion die and the meshes settle where the seed puts them."""
        self._state = states_at_start([self._servo], levels=1)

    def dwell(
        self,
        frequency_hz: float,
        source_vpk: float,
        offset_v: float = 0.0,
        settle_cycles: int = 20,
        integrate_cycles: int = 30,
    ) -> DwellRecord:
        """Drive at one frequency, source_vpk sin(2 pi f t) + offset_v, and record the cycles.

        Raises
        ------
        AnalysisError
            If the motion grew without bound.
        """
        one = np.ones(1)
        stretch = Stretch(
            frequency_hz, source_vpk * one, 0.0 * one, offset_v * one, settle_cycles,
            integrate_cycles,
        )  # fmt: skip
        system = self._servo.system
        parameters = parameters_of([self._servo], 1)
        carried = carry(system, parameters, self._state, [stretch], [self._longest_step_s])
        ((motion,),) = step_together([carried])
        self._state = motion.state
        return DwellRecord(
            source_cycles=np.full(integrate_cycles, source_vpk, dtype=complex),
            output_cycles=motion.coefficients[..., 0],
            source_peak_v=source_vpk + abs(offset_v),
            output_peak_v=float(motion.peak[0]),
        )


def _sweep(
    servos: Sequence[Servo],
    plan: SweepPlan,
    steps_s: Sequence[float],
    single: bool,
    point_done: Callable[[], None],
    begun: _Begun,
) -> Asking[_Swept]:
    """(servos, levels, points, cycles, 4) of servos that share their linear part.

    And how many steps of a plain unit take as long as theirs.

    `steps_s`: longest steps, each taken where the one before lets a motion grow without bound.
    `begun`: parameters of their laws and states at the start.
    """
    levels = np.asarray(plan.levels_vpk, dtype=float)
    amplitude = np.tile(levels, len(servos))
    zero = np.zeros_like(amplitude)
    visited = plan.visited_hz
    stretches = [
        Stretch(f, amplitude, zero, zero + plan.dc_offset_v, plan.settle_cycles,
                plan.integrate_cycles)
        for f in visited
    ]  # fmt: skip
    system = servos[0].system
    parameters, start = begun

    def carried(some: Sequence[Stretch]) -> Asking[list[Motion]]:
        return carry(system, parameters, start, some, steps_s, single, point_done)

    motions: list[Motion] = []
    for some in [[s] for s in stretches] if plan.from_rest else [stretches]:
        motions += yield from carried(some)
    steps = sum(s.duration_s / m.step_s for s, m in zip(stretches, motions, strict=True))
    steps *= _worth(system) * len(amplitude)
    kept = np.array([motion.coefficients / amplitude for motion in motions])
    if plan.direction == "down":
        kept = kept[::-1]
    lanes = kept.reshape(*kept.shape[:3], len(servos), len(levels))
    return np.ascontiguousarray(lanes.transpose(3, 4, 0, 1, 2)), steps


def _shares(plan: SweepPlan, workers: int) -> list[slice]:
    """Points in turn to each worker: low frequencies take longer than high ones."""
    count = min(workers, len(plan.frequencies_hz))
    return [slice(first, None, count) for first in range(count)]


def _worth(system: PiecewiseLinearSystem) -> float:
    """How many times as long as a plain unit's its steps take to simulate."""
    hardens = any(law.law is Law.CUBIC for law in system.nonlinearities)
    return _DEAR if hardens else 1.0


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _version() -> str:
    try:
        return version("lashbench")
    except PackageNotFoundError:
        return "unknown"
