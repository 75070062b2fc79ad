"""The response that a model of the unit gives to the sweep of another response.

Owns which sweep that is: levels, frequencies, direction, cycles and offset as swept. It fits
nothing and draws nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from daq.frf import FrequencyResponse
    from sim.effects import EffectSetting
    from sim.unit import Unit

__all__ = ["predicted"]


def predicted(
    response: FrequencyResponse,
    unit: Unit,
    ratio: float,
    effects: Sequence[EffectSetting] = (),
    *,
    progress: Callable[[float], None] | None = None,
) -> tuple[FrequencyResponse, ...]:
    """Simulate the sweep of a response, one simulated response for each grid of frequencies in it.

    Parameters
    ----------
    response
        What was swept; readings that are spoilt or overloaded are left out.
    unit, ratio, effects
        The machine, as for `sim.response.simulate`.
    progress
        Told the share done.

    Raises
    ------
    AnalysisError
        If the response has no usable point or no source level, or the motion grew without bound.
    InputError
        If the sweep cannot be simulated: a repeated frequency, or hours of motion.
    ConfigurationError
        If the ratio or an effect is not allowed.
    """
    from analysis.observation.observation import observe
    from sim.response import simulate

    plans = [plan for plan, _ in observe(response).plans]
    made = []
    for number, plan in enumerate(plans):

        def told(share: float, done: int = number) -> None:
            if progress is not None:
                progress((done + min(share, 1.0)) / len(plans))

        made.append(simulate(unit, ratio, plan, effects=effects, progress=told))
    return tuple(made)
