"""An effect of one's own: gear 1 turns against dry friction."""

from sim.catalogue import Effect, EffectParameter
from sim.elements import DryFriction

tight_bearing = Effect(
    "gear1-coulomb-friction",
    (EffectParameter("T_f_g1", "N.m", lambda unit: (0.005, 0.5)),),
    "plant",
    "Gear 1 turns against dry friction.",
    "a tight or dirty bearing of gear 1",
    "take gear 1 out of mesh and turn it by hand",
    on_drivetrain=lambda drivetrain, unit, values: drivetrain.adding(
        gear1_friction=DryFriction("gear1_friction", "th_g1", values["T_f_g1"])
    ),
)
