"""What a report says: numbers, words, verdicts, advice, doubts."""

import re
from dataclasses import replace

import numpy as np
import pytest
from outputs import report_makings as makings

from analysis.observation.joint import sweep_lines
from sim.catalogue import CATALOGUE
from sim.unit import unit_from_mapping


def with_limits(b1_deg, b2_deg):
    document = makings.ADSS.model_dump(by_alias=True)
    document["limits"] |= {"b1_deg": b1_deg, "b2_deg": b2_deg}
    return unit_from_mapping(document, "test")


def test_report_states_measurement_and_method(report):
    _, page = report()
    for words in (
        "Backlash report: ADSS SN 7", "Operator A. B.", "Notes warm", "HP 35670A, serial 1",
        "48 points, 100 to 180 Hz, up", "1.5, 4 V peak", "20 cycles settled, 30 averaged",
        "Begun 2026-01-02T03:04:05+00:00", "Report made 2026-01-02T03:04:05+00:00",
    ):  # fmt: skip
        assert words in page.text
    assert "SIMULATED" not in page.text


def test_report_states_closed_loop(report):
    """The response is then of the loop, not of the drive alone."""
    document = makings.ADSS.model_dump(by_alias=True)
    document["loop"] = {"controls": "speed", "K_p": 0.5, "T_i_s": 0.1}
    _, page = report(unit=unit_from_mapping(document, "test"))
    assert "Loop speed, K_p 0.5, T_i 0.1 s; the source is its reference" in page.text


def test_features_and_estimate_have_words_and_numbers(report):
    _, page = report()
    assert "Adjust stage 2 first: 30 % of the backlash sits in stage 1" in page.text
    assert "backlash of stage 1, b1 0.2079 deg 0.0139 0.1800 to 0.2360" in page.text
    assert "the model leaves 2.0 standard deviations" in page.text
    rows = re.findall(r"129\.6\d+ ± 0\.0\d+ ", page.text)
    assert len(rows) == 2


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        (
            (0.3, 0.1),
            [
                "Leave stage 1 and stage 2 as they are",
                "limit 0.3000 deg: leave it",
                "Stage 2: PASS",
            ],
        ),
        (
            (0.1, 0.04),
            ["Adjust stage 1 and stage 2: stage 1 FAIL", "replace the gear pair", "Stage 2: FAIL"],
        ),
        ((0.21, 0.1), ["Undecided: stage 1 UNDECIDED; stage 2 PASS", "deg: measure again"]),
    ],
)
def test_limits_decide_headline_and_table_alike(report, limits, said):
    _, page = report(unit=with_limits(*limits))
    for words in said:
        assert words in page.text
    # By the ratio alone it would be stage 2.
    assert "Adjust stage 2 first" not in page.text


WARNED = "the model leaves 5.4 standard deviations of the response unexplained; run diagnose "
REFUTED = makings.ESTIMATE | {
    "contribution_ratio": {"value": 0.9, "std": 0.02, "interval95": [0.86, 0.94]},
    "b1_deg": {"value": 0.6237, "std": 0.0139, "interval95": [0.596, 0.651]},
    "warnings": [WARNED + "before trusting the ratio"],
}


@pytest.mark.parametrize("limits", [(None, None), (0.3, 0.001)])
def test_refuted_plain_model_gives_no_advice(report, limits):
    """Nor is a stage named before a diagnosis."""
    _, page = report(unit=with_limits(*limits), estimate=REFUTED)
    assert "No advice before a diagnosis" in page.text
    assert WARNED in page.text
    for word in ("Adjust", "Leave stage", "Stage 1", "Stage 2", "0.6237", "0.900", "PASS", "FAIL"):
        assert word not in page.text
    # The copy for programs holds what was estimated, and that it is refuted.
    assert page.data["estimate"]["warnings"] == REFUTED["warnings"]


def test_numbers_are_those_of_accepted_model(report, explained):
    _, page = report(estimate=REFUTED, diagnosis=explained)
    document = explained.to_json()
    assert document["verdict"] == "explained"
    for name in ("b1_deg", "b2_deg"):
        low, high = document[name]["interval95"]
        assert f"{document[name]['value']:.4f} deg" in page.text
        assert f"{low:.4f} to {high:.4f}" in page.text
    ratio = document["contribution_ratio"]["extended"]
    assert f"ratio r of stage 1 {ratio['value']:.3f}" in page.text
    assert "Model: extended by load-inertia." in page.text
    # Neither the estimate's ratio nor the one that the diagnosis has for the plain model.
    assert "0.6237" not in page.text
    assert "0.900" not in page.text
    assert page.text.count("contribution ratio r of stage 1") == 1


def test_diagnosis_shows_causes_gain_and_pictures(report, explained):
    path, page = report(diagnosis=explained)
    document = explained.to_json()
    assert "Explained." in page.text
    assert "load-inertia in the mechanics J_L = " in page.text
    sigma = document["baseline"]["held_out_rms_sigma"]
    assert f"model of the unit alone {sigma:.2f}" in page.text
    assert f"leave {document['gain']['held_out_rms_ratio']:.2f} of the residual" in page.text
    assert "Departures left with the causes: none beyond chance" in page.text
    assert path.read_text().count("<svg") == 4
    assert page.data["diagnosis"]["causes"] == document["causes"]
    (cause,) = document["causes"]
    assert cause["check"] == CATALOGUE["load-inertia"].check
    assert f"To make sure of load-inertia: {cause['check']}." in page.text
    told = "\n".join(explained.summary())
    assert f"kg.m^2 (datasheet {makings.ADSS.load.J_L:.4g} kg.m^2)\n" in told
    assert f"    To make sure: {cause['check']}.\n" in told


def test_joint_sweeps_are_listed_with_their_departures(report, explained):
    (plan, rows), alone = explained.observation.plans[0], report(diagnosis=explained)[1]
    assert "Taken together" not in alone.text
    first, second = np.array_split(rows, 2)
    later = replace(plan, levels_vpk=(4.0,), dc_offset_v=0.5, direction="down")
    observation = replace(explained.observation, plans=((plan, first), (later, second)))
    departures = [replace(explained.departures[0], sweep=1)]
    together = replace(explained, observation=observation, departures=tuple(departures))
    _, page = report(diagnosis=together)
    lines = sweep_lines(together.to_json()["sweeps"])
    assert len(lines) == 2
    assert lines[1].endswith("Hz down at 4 V, offset 0.5 V")
    assert f"Taken together: {'; '.join(lines)}." in page.text
    low, high = departures[0].low_hz, departures[0].high_hz
    assert f"{low:g} to {high:g} 2 {departures[0].source_vpk:g} " in page.text
    assert "band / Hz sweep V peak quantity" in page.text
    assert f"  {lines[1]}" in together.summary()


@pytest.mark.parametrize(
    ("hidden", "judged", "verdict", "said"),
    [
        ((), [("load-inertia",)], "consistent", "that nothing is hidden has probability"),
        (("load-inertia",), [("shaft-stiffness",)], "unexplained", "no known cause explains"),
        (
            ("amplifier-gain",),
            [("amplifier-gain",), ("load-inertia",)],
            "explained",
            "put the measuring chain right",
        ),
    ],
)
def test_every_verdict_has_its_text(report, monkeypatch, hidden, judged, verdict, said):
    found = makings.diagnosis(monkeypatch, hidden, judged)
    assert found.to_json()["verdict"] == verdict
    _, page = report(diagnosis=found)
    assert said in page.text
    assert page.text.count("Departures left") == (verdict == "explained")
    unseen = page.text.count("this sweep cannot exclude")
    beside = page.text.count(
        "Sizes of further causes that this sweep cannot exclude, one cause at a time"
    )
    assert (unseen, beside) == (verdict != "unexplained", verdict == "explained")
    told = found.summary()
    for one in found.verdict.judged:
        name = " + ".join(one.effects) or "nothing hidden"
        (line,) = (text for text in told if text.startswith(f"    {one.probability:6.3f}  {name}"))
        assert line.endswith(f"  ({one.objection})") == one.refused
        assert not one.refused or verdict != "consistent" or one.effects


def test_tie_is_shown_with_its_resolving_sweep(report):
    class Told:
        def to_json(self):
            from outputs.screen import DIAGNOSIS

            plan = DIAGNOSIS["next_measurement"]["plan"] | {"command": "lashbench measure --x"}
            return DIAGNOSIS | {"next_measurement": DIAGNOSIS["next_measurement"] | {"plan": plan}}

    _, page = report(diagnosis=Told())
    assert "load-inertia may explain the response, and others are not ruled out" in page.text
    assert "Undecided, adjust no stage yet: 23 to 70 %" in page.text
    for name in ("load-inertia (probability 0.55)", "shaft-stiffness (probability 0.41)"):
        assert name in page.text
    assert (
        "Other sets judged: shaft-stiffness (0.41, needs a size outside its plausible range)"
        in page.text
    )
    assert "To tell load-inertia from shaft-stiffness (5.0 sigma expected)" in page.text
    assert "lashbench measure --x" in page.text


def test_missing_part_states_the_reason(report):
    remarks = {"estimate": "No estimate: too noisy.", "diagnosis": "Left out."}
    _, page = report(estimate=None, remarks=remarks)
    assert "No estimate: too noisy." in page.text
    assert "Left out." in page.text
    assert page.data["estimate"] is None


def test_doubts_stand_at_the_top(report):
    response = makings.response(unit="other", kind="simulated", state="interrupted")
    _, page = report(response)
    top = page.text[: page.text.index("Measurement Unit")]
    assert "SIMULATED" in top
    assert "names unit other; it was taken for ADSS" in top
    assert "The unit file has changed since this was measured" in top
    assert "not complete: interrupted" in top


def test_measured_unit_raises_no_doubt(report):
    from daq.configs import config_path

    text = config_path("units", "adss").read_text(encoding="utf-8")
    _, page = report(makings.response(configurations={"unit": text}))
    assert "has changed" not in page.text
