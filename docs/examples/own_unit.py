"""A drive of your own in a few lines: where will its features be, and does the split move them?"""

from analysis.resonance import extract, summary
from daq.plan import SweepPlan, spaced_frequencies
from sim.response import simulate
from sim.unit import unit_from_mapping

# SI units, degrees for backlash; `lashbench new-unit` writes the same as a commented file.
OMEGA = 2 * 3.14159 * 200.0
GIMBAL = {
    "schema": 1,
    "name": "MINE",
    "motor": {"L_a": 1.2e-3, "R_m": 2.6, "k_b": 0.046, "k_t": 0.046, "J_m": 1.4e-5,
              "B_m": 1.0e-4, "T_f_m": 0.015},
    "electronics": {"k_a": 3.0, "k_ts": 0.067, "filter_numerator": OMEGA**2,
                    "filter_denominator": [1.0, 1.4 * OMEGA, OMEGA**2]},
    "stage1": {"N_1": 6.0, "k_g1": 4.0e4, "J_g1": 3.0e-5, "k_s1": 60.0, "J_s1": 1.2e-7,
               "J_p2": 3.0e-7},
    "stage2": {"N": 8.0, "k_2": 1.5e5},
    "load": {"J_L": 6.0e-3, "T_f_L": 0.02},
    "backlash": {"b_t_deg": 0.12},
    "limits": {"source_vpk": 5.0, "source_offset_v": 1.0, "start_hz": 10.0, "stop_hz": 500.0},
}  # fmt: skip

unit = unit_from_mapping(GIMBAL, source="own_unit.py")
plan = SweepPlan(spaced_frequencies(80.0, 180.0, 26), levels_vpk=(2.5,))
for ratio in (0.1, 0.9):
    print(f"contribution ratio {ratio}")
    print("\n".join(summary(extract(simulate(unit, ratio, plan)))))
