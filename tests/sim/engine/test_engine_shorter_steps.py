"""Where a motion grows without bound at one step, it is gone through again at a shorter one."""

import numpy as np
import pytest
from worlds.asked_steps import growing
from worlds.side_by_side import EDSS, law_parameters

from daq.errors import AnalysisError
from sim.effects import drivetrain_with, parse_effect
from sim.engine.engine import Stretch, advance, carry
from sim.engine.propagator import build_propagator, find_modes
from sim.engine.stepping import step_together

LONG, SHORT, SHORTEST = 1e-5, 5e-6, 2.5e-6
FREQUENCIES = (70.0, 72.0, 74.0, 76.0, 78.0, 80.0, 82.0, 84.0, 86.0, 88.0, 90.0)


def stretches(amplitude=2.5, frequencies=FREQUENCIES):
    one = np.ones(2)
    return [Stretch(f, amplitude * one, 0.0 * one, 0.0 * one, 2, 3) for f in frequencies]


def machine(hardening):
    effect = parse_effect(f"shaft-hardening:h={hardening}")
    system = drivetrain_with(EDSS, 0.6, [effect]).system()
    return system, law_parameters(system, 2), np.zeros((len(system.states), 2))


def carried(*how):
    (motions,) = step_together([carry(*how)])
    return motions


def taken(steps, grows):
    """What is stepped how long, and told done, where `grows(frequency, step)` grows."""
    seen, told = [], []
    system, parameters, state = machine(1e4)
    modes = find_modes(system)
    # Steps a cycle tell frequency and step: no two of them have as many.
    which = {
        build_propagator(system, modes, f, step).steps_per_cycle: (f, step)
        for f in FREQUENCIES
        for step in steps
    }
    assert len(which) == len(FREQUENCIES) * len(steps)

    def grows_at(asked):
        seen.append(which[asked.steps])
        return grows(*seen[-1])

    done = lambda: told.append(len(seen))  # noqa: E731
    asking = carry(system, parameters, state, stretches(), steps, True, done)
    (motions,) = step_together([growing(asking, grows_at)])
    assert len(told) == len(motions) == len(FREQUENCIES)
    return seen, motions


def test_failed_stretch_and_previous_are_repeated():
    seen, motions = taken((LONG, SHORT), lambda f, step: f == 76.0 and step == LONG)
    again = [(74.0, SHORT), (76.0, SHORT)]
    long = [(f, LONG) for f in FREQUENCIES]
    assert seen == [*long[:4], *again, *long[4:]]
    # As long as they agree in their steps, they agree to the last bit.
    system, parameters, state = machine(1e4)
    plain = list(advance(system, parameters, state, stretches(), LONG, True))
    same = [
        np.array_equal(a.coefficients, b.coefficients) for a, b in zip(motions, plain, strict=1)
    ]
    assert same == [True, True, *[False] * 9]


def test_first_stretch_is_repeated_alone():
    seen, _ = taken((LONG, SHORT), lambda f, step: f == 70.0 and step == LONG)
    assert seen[:3] == [(70.0, LONG), (70.0, SHORT), (72.0, LONG)]


def test_third_step_follows_failed_second():
    seen, _ = taken((LONG, SHORT, SHORTEST), lambda f, step: f == 76.0 and step > SHORTEST)
    assert seen.count((76.0, SHORTEST)) == 1
    assert [f for f, step in seen if step == SHORTEST] == [74.0, 76.0]


def test_repeated_growth_keeps_shorter_step():
    seen, _ = taken((LONG, SHORT), lambda f, step: step == LONG)
    # More than a tenth of eleven is two; from then on nothing is tried in vain.
    assert [f for f, step in seen if step == LONG] == [70.0, 72.0]
    assert [f for f, step in seen if step == SHORT] == [70.0, 70.0, *FREQUENCIES[1:]]


def test_growth_at_every_step_is_an_error():
    with pytest.raises(AnalysisError, match="at 76 Hz grew without bound"):
        taken((LONG, SHORT), lambda f, step: f == 76.0)


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.long) for n in (1, 2))])
def test_shaft_hardening_beyond_step_stays_finite(seed):
    system, parameters, _ = machine(2e7)
    start = np.zeros((len(system.states), 2))
    start[system.states.index("th_L")] = 1e-5 * np.random.default_rng(seed).standard_normal(2)
    driven = stretches(4.0, (40.0, 60.0, 80.0))
    with pytest.raises(AnalysisError, match="without bound"):
        carried(system, parameters, start, driven, [LONG], True)
    motions = carried(system, parameters, start, driven, [LONG, SHORT, SHORTEST / 2], True)
    assert all(np.all(np.isfinite(motion.coefficients)) for motion in motions)
