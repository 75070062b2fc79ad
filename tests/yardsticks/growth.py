"""How the cost of simulating grows with what is simulated.

Owns the four sizes that a user can turn up (points, levels, ratios, causes),
each alone from today's to a hundred times that, and their picture. Dwells are
cut short so that the largest fits into seconds; cost per dwell is what matters.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from yardsticks.page import DOCS

from daq.plan import SweepPlan
from sim.catalogue import CATALOGUE
from sim.response import Servo, simulate_cycles
from sim.unit import load_unit

__all__ = ["Curve", "draw_growth", "measure_growth"]

FACTORS = (1, 3, 10, 30, 100)
STEP_S = 1e-5


@dataclass(frozen=True, slots=True)
class Curve:
    """Processor seconds (n,) at sizes (n,), and the exponent of a power law through them."""

    name: str
    sizes: np.ndarray
    cost_s: np.ndarray

    @property
    def exponent(self) -> float:
        """1 for linear growth."""
        return float(np.polyfit(np.log(self.sizes), np.log(self.cost_s), 1)[0])

    def summary(self) -> str:
        """One line."""
        size, cost = self.sizes, self.cost_s
        return (
            f"{self.name}: from {size[0]} to {size[-1]}, {cost[0]:.2f} to {cost[-1]:.1f} processor "
            f"seconds: {cost[-1] / cost[0]:.0f} times the cost for {size[-1] / size[0]:.0f} times "
            f"the size (exponent {self.exponent:.2f})"
        )


def _plan(points: int = 5, levels: int = 3) -> SweepPlan:
    return SweepPlan(
        tuple(np.linspace(110.0, 160.0, points).tolist()),
        tuple(np.linspace(1.5, 4.0, levels).tolist()),
        settle_cycles=1,
        integrate_cycles=1,
    )


def _servos(count: int) -> list[Servo]:
    unit = load_unit("adss")
    return [Servo.of(unit, r, seed=i) for i, r in enumerate(np.linspace(0.0, 1.0, count))]


def _causes(count: int) -> list[Servo]:
    """As many hypotheses, each another linear system, eight machines of each."""
    unit = load_unit("adss")
    servos = []
    for number in range(count):
        known = unit.load.J_L * (1.0 + 1e-4 * (number + 1))
        changed = unit.with_parameters(J_L=known)
        servos += [Servo.of(changed, r, seed=i) for i, r in enumerate(np.linspace(0.1, 0.9, 8))]
    return servos


def _cost(work: Callable[[], object]) -> float:
    began = time.process_time()
    work()
    return time.process_time() - began


def measure_growth() -> list[Curve]:
    """All four curves."""
    few, many = _servos(8), len(CATALOGUE)
    _cost(lambda: simulate_cycles(few, _plan(), longest_step_s=STEP_S))

    def curve(name: str, base: int, cost: Callable[[int], float]) -> Curve:
        sizes = np.array([base * factor for factor in FACTORS])
        # Small sizes are short: the least of several.
        return Curve(
            name,
            sizes,
            np.array([
                min(cost(size) for _ in range(3 if size < 30 * base else 1)) for size in sizes
            ]),
        )  # fmt: skip

    def run(servos: list[Servo], plan: SweepPlan) -> float:
        return _cost(lambda: simulate_cycles(servos, plan, longest_step_s=STEP_S))

    return [
        curve("points", 61, lambda n: run(few, _plan(points=n, levels=1))),
        curve("levels", 3, lambda n: run(few, _plan(levels=n))),
        curve("ratios", 33, lambda n: run(_servos(n), _plan())),
        curve("causes", many, lambda n: run(_causes(n), _plan(points=2, levels=1))),
    ]


def draw_growth(curves: list[Curve]) -> None:
    """Write docs/pictures/growth.png."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    axes = figure.add_subplot()
    for curve, marker in zip(curves, "osd^", strict=True):
        label = f"{curve.name}, today {curve.sizes[0]} (exponent {curve.exponent:.2f})"
        relative = curve.sizes / curve.sizes[0]
        axes.loglog(relative, curve.cost_s / curve.cost_s[0], marker=marker, label=label)
    line = np.array([1.0, 100.0])
    axes.loglog(line, line, color="0.6", linestyle="--", label="linear")
    axes.set_xlabel("size, in multiples of today's")
    axes.set_ylabel("processor time, in multiples of today's")
    axes.grid(visible=True, which="major", color="0.9")
    axes.legend(frameon=False)
    figure.savefig(DOCS / "pictures" / "growth.png", dpi=130)
