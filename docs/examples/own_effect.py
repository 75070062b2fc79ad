"""An effect of your own: a tight bearing on gear 1, beside the servo as the paper has it."""

from analysis.resonance import extract, summary
from daq.plan import SweepPlan, spaced_frequencies
from sim.drivetrain import Drivetrain, paper_drivetrain
from sim.elements import DryFriction
from sim.response import Servo, response_of_cycles, simulate_cycles
from sim.unit import load_unit


def with_tight_bearing(drivetrain: Drivetrain, T_f_g1: float) -> Drivetrain:
    """Dry friction T_f_g1, N.m, on gear 1."""
    return drivetrain.adding(gear1_friction=DryFriction("gear1_friction", "th_g1", T_f_g1))


unit, ratio = load_unit("adss"), 0.3
plan = SweepPlan(spaced_frequencies(100.0, 180.0, 21), levels_vpk=(2.5,))
plain = paper_drivetrain(unit, ratio)

for name, drivetrain in (
    ("as in the paper", plain),
    ("with a tight bearing", with_tight_bearing(plain, T_f_g1=0.15)),
):
    (cycles,) = simulate_cycles([Servo(drivetrain.system())], plan)
    response = response_of_cycles(cycles, plan, unit.name, {"kind": "simulated"})
    print(name)
    print("\n".join(summary(extract(response))))
