"""The study of causes in no catalogue: each of them acts, and what is said of it is told."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent / "campaigns"))

from kept import Kept
from other_causes import CAUSES, Drawn, block, read

from sim.unit import load_unit

HZ = np.array([105.0, 150.0])


@pytest.mark.parametrize(
    "cause",
    [pytest.param(one, marks=[pytest.mark.long] * (n % 3 > 0)) for n, one in enumerate(CAUSES)],
)
def test_every_other_cause_exceeds_the_noise(cause):
    unit = load_unit("adss")
    drawn = CAUSES[cause].draw(unit, np.random.default_rng(3))

    def gains(one):
        # The last of three levels: a reading that drifts has not drifted at first.
        return read(unit, 0.4, one, HZ, (2.5, 4.0), np.random.default_rng(1)).gain

    changed = np.abs(gains(drawn) - gains(Drawn(0.0)))
    # Noise is the same to the last bit in both, and 0.2 mV/V without.
    assert changed.max() > 1e-3
    assert np.isfinite(changed).all()
    words = CAUSES[cause].words
    assert words(drawn.size) != words(2.0 * drawn.size)


def test_table_lists_named_causes_and_datasheet_errors(tmp_path):
    kept = Kept(str(tmp_path / "lines.jsonl"))
    common = {
        "seed": 1,
        "unit": "ADSS",
        "ratio": 0.5,
        "found_ratio": (0.45, 0.03),
        "held_out_sigma": (2.0, 1.01),
    }
    kept.add(
        common
        | {"number": 0, "cause": "gear-ratio", "size": 0.9, "verdict": "ambiguous"}
        | {
            "named": {"load-inertia": {"J_L": (3.025e-3, 1e-4)}},
            "rivals": [[], ["cable-stiffness"]],
        }
    )
    kept.add(
        common
        | {"number": 1, "cause": "delay", "size": 5e-4, "verdict": "consistent"}
        | {"named": {}, "rivals": []}
    )
    lines = block(Kept(str(tmp_path / "lines.jsonl")))
    assert lines[0] == "2 sets, seeds 1."
    assert lines[-2:] == [
        "| reading 0.0005 s late, ADSS | consistent | 1.01 | -0.050, 0.030 |",
        "| ratio of gear 1 at 90 % of its datasheet's, ADSS "
        "| ambiguous: load-inertia (+10 %), or nothing or cable-stiffness | 1.01 | -0.050, 0.030 |",
    ]
