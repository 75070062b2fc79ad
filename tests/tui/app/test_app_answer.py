"""Whose numbers the bench screen shows: those of the model that is accepted, and no other."""

import pytest
from outputs.screen import DIAGNOSIS, ESTIMATE, Diagnosed, operated, run

from sim.unit import load_unit, unit_from_mapping

REFUTED = ESTIMATE | {
    "refuted": True,
    "warnings": ["the model leaves 5.4 standard deviations of the response unexplained"],
}
"""The estimate of a response that the plain model does not fit; by itself it points at stage 2."""

MODEL = DIAGNOSIS["models"][1]
EXPLAINED = DIAGNOSIS | {
    "verdict": "explained",
    "causes": [{"effect": "shaft-stiffness", "parameters": {}, "probability": 0.99}],
    "rivals": [{"causes": [], "probability": 0.004}],
    "contribution_ratio": {
        "baseline": {"value": 0.31, "std": 0.05},
        "extended": MODEL["contribution_ratio"],
    },
    **{name: MODEL[name] for name in ("b1_deg", "b2_deg", "b_t_deg")},
    "models": [MODEL],
    "next_measurement": None,
}


def limited(b1_deg=None, b2_deg=None):
    content = load_unit("adss").model_dump(by_alias=True)
    content["limits"] |= {"b1_deg": b1_deg, "b2_deg": b2_deg}
    return unit_from_mapping(content, "test")


def shown(tmp_path, step, estimate, diagnosis=None, unit=None):
    """The words of a step, with these results on the desk."""
    seen = []

    async def way():
        async with operated(tmp_path / "bench.db") as op:
            desk = op.app.desk
            desk.measurement = 1
            desk.unit, desk.results.estimate = unit or load_unit("adss"), estimate
            desk.results.diagnosis = None if diagnosis is None else Diagnosed(diagnosis)
            op.app.go(step)
            await op.sees(f"[{step} ")
            seen.append(op.app.screen.copy_text())

    run(way)
    return seen[0]


def test_refuted_plain_model_shows_no_numbers(tmp_path):
    """Neither advice nor stage nor number is shown."""
    text = shown(tmp_path, 5, REFUTED, unit=limited(0.3, 0.001))
    assert text.startswith("No advice before a diagnosis")
    assert "warning: the model leaves 5.4 standard deviations" in text
    for word in ("tage 1", "tage 2", "0.310", "0.2148", "PASS", "FAIL"):
        assert word not in text


@pytest.mark.parametrize("step", [5, 6])
def test_both_steps_follow_the_accepted_model(tmp_path, step):
    text = shown(tmp_path, step, REFUTED, EXPLAINED)
    assert "Adjust stage 1 first: 62 % of the backlash" in text
    assert "r = 0.620 +- 0.040  (95 %: 0.540 to 0.700); extended by shaft-stiffness" in text
    assert "b1 = 0.4297 +- 0.0280 deg" in text
    assert "0.31" not in text


@pytest.mark.parametrize("step", [pytest.param(5, marks=pytest.mark.long), 6])
def test_tied_models_that_disagree_are_undecided(tmp_path, step):
    text = shown(tmp_path, step, ESTIMATE, DIAGNOSIS)
    assert "Undecided, adjust no stage yet: 23 to 70 %" in text
    assert "first:" not in text


def test_limits_decide_on_the_screen_as_well(tmp_path):
    text = shown(tmp_path, 6, REFUTED, EXPLAINED, limited(0.5, 0.01))
    assert "Adjust stage 2: stage 1 PASS; stage 2 FAIL." in text
    assert "Adjust stage 1" not in text


def test_probability_of_nothing_hidden_is_shown(tmp_path):
    plain = MODEL | {"causes": [], "probability": 0.62}
    consistent = EXPLAINED | {
        "verdict": "consistent",
        "causes": [],
        "models": [plain],
        "rivals": [{"causes": [], "probability": 0.62}, {"causes": ["x"], "probability": 0.3}],
        "residual": [{"band_hz": [100.0, 110.0], "source_vpk": 2.0, "quantity": "gain",
                      "mean": 0.4, "sigma": 6.9}],
    }  # fmt: skip
    text = shown(tmp_path, 6, ESTIMATE, consistent)
    assert "that nothing is hidden has probability 0.62: more likely than not" in text
    assert "x (probability 0.30) is not ruled out" in text
    assert "1 band departs from the plain model, by up to 6.9 sigma" in text
    assert "no further cause is needed" not in text


MEASURED = {
    "k_s1": {"datasheet": 22.8, "datasheet_std": 3.42, "value": 19.61, "std": 0.524,
             "determined": True},
    "J_L": {"datasheet": 2.75e-3, "datasheet_std": 1.375e-4, "value": 2.7495e-3, "std": 1.8e-5,
            "determined": True},
    "B_m": {"datasheet": 0.0, "datasheet_std": 0.0, "value": 0.0, "std": 0.0,
            "determined": False},
    "J_g1": {"datasheet": 2.34e-5, "datasheet_std": 2.34e-6, "value": 2.34e-5, "std": 2.33e-6,
             "determined": False},
}  # fmt: skip


def test_measured_datasheet_values_fit_the_screen(tmp_path):
    """In 80 by 24 characters, each row whole; what is zero has no share."""
    seen = []

    async def way():
        async with operated(tmp_path / "bench.db", (80, 24)) as op:
            op.app.desk.measurement, op.app.desk.unit = 1, load_unit("adss")
            op.app.desk.results.diagnosis = Diagnosed(EXPLAINED | {"datasheet": MEASURED})
            op.app.go(6)
            await op.sees("[6 ")
            await op.press("end")
            seen.append(await op.sees("not determined by this sweep: J_g1"))

    run(way)
    for row in (
        "                   measured            datasheet              off by",
        "k_s1 N\u00b7m/rad          19.61 +- 2.3 %        22.8 +- 15 %     -14.0 %",
        "J_L kg\u00b7m\u00b2           0.00275 +- 0.65 %    0.00275 +- 5 %       +0.0 %",
    ):
        assert row in seen[0]
    assert "B_m" not in seen[0]


def test_undecided_diagnosis_shows_no_measured_values(tmp_path):
    text = shown(tmp_path, 6, ESTIMATE, DIAGNOSIS | {"datasheet": {}})
    assert "Datasheet values by this sweep" not in text
    assert "not determined" not in text
