"""How fast the engine steps, beside a plain fine-step Runge-Kutta integration of the same servo.

Run it as a script from the root of a checkout: `python tests/benchmarks/engine_speed.py`. For
each unit and number of lanes it prints nanoseconds per lane and step, and simulated seconds per
second of one core. Times are processor times, the least of several repeats, because machines
are shared; the oracle's line is what an explicit scheme of the same accuracy costs. With
`--effects` it prints instead what a step takes of each effect of the catalogue, as a multiple of
the plain unit's, at 32 lanes, 10 us and single precision, as the runs of a diagnosis are stepped.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from oracle import rk4  # noqa: E402
from worlds.side_by_side import ADSS, EDSS, drive, half_plays  # noqa: E402

from analysis.ensemble.model import Hypothesis  # noqa: E402
from sim.catalogue import CATALOGUE  # noqa: E402
from sim.drivetrain import paper_drivetrain  # noqa: E402
from sim.engine.engine import LONGEST_STEP_S  # noqa: E402
from sim.engine.propagator import build_propagator, find_modes  # noqa: E402

CYCLES = 10
CASES = (("ADSS", ADSS, 0.25, 125.0), ("EDSS", EDSS, 0.5, 70.0))


def least(repeats: int, work: Callable[[], object]) -> float:
    """Least processor time of some repeats, s."""
    times = []
    for _ in range(repeats):
        begin = time.thread_time()
        work()
        times.append(time.thread_time() - begin)
    return min(times)


def print_effects(repeats: int) -> None:
    """What a step of each effect takes, amid its range."""
    print(f"{'effect':26}" + "".join(f"{name:>8}" for name, *_ in CASES))
    plain: dict[str, float] = {}
    for effect in ("", *CATALOGUE):
        shares = []
        for name, unit, ratio, frequency in CASES:
            hypothesis = Hypothesis(unit, (effect,) if effect else ())
            place = np.array([ratio] + [0.6] * (hypothesis.d - 1))
            system = hypothesis.machine(place, 0, ()).servo(unit).system
            _, state = drive(system, np.zeros((len(system.states), 32)), frequency, CYCLES, 2.5)
            spent = least(
                repeats,
                lambda s=system, x=state, f=frequency: drive(
                    s, x, f, CYCLES, 2.5, step_s=1e-5, single=True
                ),
            )
            shares.append(spent / plain.setdefault(name, spent))
        print(f"{effect or 'none':26}" + "".join(f"{x:8.2f}" for x in shares))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lanes", type=int, nargs="+", default=[1, 8, 16, 32, 64, 256])
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--step-us", type=float, default=1e6 * LONGEST_STEP_S)
    parser.add_argument("--single", action="store_true", help="step in single precision")
    parser.add_argument("--effects", action="store_true", help="compare the effects instead")
    options = parser.parse_args()
    if options.effects:
        print_effects(options.repeats)
        return
    step_s = 1e-6 * options.step_us

    begin = time.perf_counter()
    system = paper_drivetrain(ADSS, 0.25).system()
    drive(system, np.zeros(len(system.states)), 1000.0, 1, amplitude=1.0)
    print(f"first call (compiles, or loads what was compiled): {time.perf_counter() - begin:.2f} s")
    modes = find_modes(system)
    cost = least(options.repeats, lambda: build_propagator(system, modes, 125.0, step_s))
    print(f"propagator of one frequency: {1e6 * cost:.0f} us")

    print(f"{'unit':6}{'lanes':>7}{'ns/lane/step':>14}{'simulated s/s':>15}")
    for name, unit, ratio, frequency in CASES:
        system = paper_drivetrain(unit, ratio).system()
        steps = CYCLES * int(np.ceil(1.0 / (frequency * step_s) - 1e-9))
        rng = np.random.default_rng(0)
        for lanes in options.lanes:
            state = np.zeros((len(system.states), lanes))
            state[system.states.index("th_L")] = 1e-5 * rng.standard_normal(lanes)
            _, state = drive(system, state, frequency, 10, amplitude=2.5, step_s=step_s)
            spent = least(
                options.repeats,
                lambda s=system, x=state, f=frequency: drive(
                    s, x, f, CYCLES, 2.5, step_s=step_s, single=options.single
                ),
            )
            simulated = lanes * CYCLES / frequency
            print(f"{name:6}{lanes:7d}{1e9 * spent / steps / lanes:14.1f}{simulated / spent:15.0f}")
        plays = half_plays(unit, ratio)
        spent = least(
            max(options.repeats // 3, 1),
            lambda u=unit, p=plays, f=frequency: rk4.simulate_cycles(
                u.parameters, *p, 2.5, f, CYCLES, 2e-6
            ),
        )
        simulated = CYCLES / frequency
        print(
            f"{name:6}{'RK4 2us':>7}{1e9 * spent / simulated * 2e-6:14.1f}{simulated / spent:15.0f}"
        )


if __name__ == "__main__":
    main()
