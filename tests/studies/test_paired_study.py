import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from studies.compare import calibration_error, hit, mcnemar, score
from studies.drawn_sets import KINDS, draw_set, study_sets

HERE = Path(__file__).parent


def truth(name, effects=(), ratio=0.5):
    kind = name.partition("-")[0]
    return {"set": name, "kind": kind, "effects": dict.fromkeys(effects, {}), "ratio": ratio}


def answer(name, effects=(), probability=0.9, ratio=(0.5, 0.01), verdict=None):
    named = [{"effect": e, "parameters": {}, "probability": probability} for e in effects]
    return {
        "set": name,
        "verdict": verdict or ("explained" if effects else "consistent"),
        "causes": named,
        "rivals": [{"causes": [], "probability": probability}] if not effects else [],
        "contribution_ratio": {"extended": {"value": ratio[0], "std": ratio[1]}},
        "processor_s": 1.0,
    }


def by_name(records):
    return {one["set"]: one for one in records}


def test_every_part_of_study_has_all_kinds():
    sets = list(study_sets(1))
    assert {kind: sum(s.kind == kind for s in sets) for kind in KINDS} == KINDS
    assert len({s.name for s in sets}) == len(sets)
    assert {s.kind for s in sets[:8]} == set(KINDS)
    singles = [(s.unit, s.effects) for s in sets if s.kind == "single"]
    assert len(set(singles[:44])) == 44


def test_set_does_not_depend_on_total_number():
    few = {s.name: s for s in study_sets(1, {"pair": 3})}
    many = {s.name: s for s in study_sets(1)}
    assert all(many[name] == one for name, one in few.items())
    one = few["pair-002"]
    first, again = draw_set(one), draw_set(one)
    np.testing.assert_array_equal(first.response.gain, again.response.gain)
    assert first.truth() == again.truth()


def test_calibration_error_of_known_answers():
    """Ten answers at 0.9 with six right are off by 0.3; at 0.6 with six right by nothing."""
    right, wrong = (["a"], ["a"]), (["b"], ["a"])
    for belief, expected in ((0.9, 0.3), (0.6, 0.0)):
        answers = [((first, belief), true) for first, true in [right] * 6 + [wrong] * 4]
        assert calibration_error(answers) == pytest.approx(expected)


def test_mcnemar_counts_discordant_sets():
    """Five sets right by the second version alone: p = 2 / 2^5."""
    names = [f"single-{i:03d}" for i in range(8)]
    truths = by_name([truth(n, ["load-inertia"]) for n in names])
    one = by_name([answer(n, ["load-inertia"] if i < 3 else []) for i, n in enumerate(names)])
    other = by_name([answer(n, ["load-inertia"]) for n in names])
    row = next(line for line in mcnemar(truths, one, other).splitlines() if "single" in line)
    assert row == "| single | 3 | 0 | 5 | 0 | 0.062 |"


def test_hits_by_kind():
    assert hit(
        truth("withheld-000", ["load-inertia"]), answer("withheld-000", [], verdict="unexplained")
    )
    assert not hit(
        truth("withheld-000", ["load-inertia"]), answer("withheld-000", ["cable-stiffness"])
    )
    assert hit(truth("nothing-000"), answer("nothing-000"))
    assert not hit(truth("pair-000", ["a", "b"]), answer("pair-000", ["a"]))


def test_score_of_known_answers():
    truths = by_name([truth("single-000", ["a"]), truth("nothing-000"), truth("single-001", ["b"])])
    answers = by_name(
        [
            answer("single-000", ["a"], 0.99, (0.52, 0.02)),
            answer("nothing-000", [], 0.8, (0.60, 0.02)),
            answer("single-001", ["a"], 0.97),
        ]
    )
    found = score(truths, answers)
    assert found["single named, and nothing else"].startswith("1 of 2")
    assert found["right of answers at 0.95 or more"].startswith("1 of 2")
    assert found["ratio, 95 % interval holds"].startswith("1 of 2")
    assert float(found["ratio, median error"]) == pytest.approx(0.06)


@pytest.mark.slow
def test_drawn_study_can_be_interrupted(tmp_path):
    command = [sys.executable, str(HERE / "draw.py"), "3", str(tmp_path)]
    for count in ("1", "2"):
        subprocess.run([*command, f"nothing={count}"], check=True, capture_output=True)
    lines = (tmp_path / "truth.jsonl").read_text().splitlines()
    assert [json.loads(line)["set"] for line in lines] == ["nothing-000", "nothing-001"]
    tasks = (tmp_path / "tasks.jsonl").read_text()
    assert "effects" not in tasks
    assert "ratio" not in tasks
