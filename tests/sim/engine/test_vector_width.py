"""What is computed does not depend on how wide the vectors are that a machine computes with."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]

# The laws that a servo may have, in lanes that fill two wide vectors but for a few.
PROGRAM = """
import hashlib
from sim.engine import machine_code
machine_code.has_wide_vectors = lambda: {wide}
import numpy as np
from daq.plan import SweepPlan
from sim.effects import parse_effect
from sim.engine.lanes import VECTOR_BYTES
from sim.response import Servo, simulate_cycles
from sim.unit import load_unit
EFFECTS = (
    ("shaft-hardening:h=10000",),
    ("load-stribeck-friction:T_s_L=0.02,omega_s=0.05", "amplifier-saturation:V_sat=6"),
)
plan = SweepPlan((90.0, 110.0), (1.5, 2.5, 4.0), settle_cycles=1, integrate_cycles=2)
found = hashlib.sha256()
for name, texts in zip(("adss", "edss"), EFFECTS):
    effects = tuple(map(parse_effect, texts))
    servos = [Servo.of(load_unit(name), 0.4, effects, seed) for seed in range(10)]
    for cycles in simulate_cycles(servos, plan, longest_step_s=1e-5, single=True):
        assert np.all(np.isfinite(cycles))
        found.update(cycles.tobytes())
print(VECTOR_BYTES, found.hexdigest())
"""


def stepped(wide):
    """Bytes of a vector, and what stands for all coefficients and states."""
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(wide=wide)],
        env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    return run.stdout.split()


def test_wide_and_narrow_vectors_are_bit_equal():
    (wide, one), (narrow, other) = stepped(True), stepped(False)
    assert (wide, narrow) == ("64", "32")
    assert one == other
