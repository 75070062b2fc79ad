"""What the verb history tells of estimates and diagnoses: which numbers, and which warnings."""

import json
import sqlite3

import pytest
from instruments.measuring import measuring
from outputs.screen import DIAGNOSIS, ESTIMATE

from daq.store import Store
from sim.unit import load_unit
from tui.measurements.stored_answers import (
    keep_diagnosis,
    keep_estimate,
    kept_diagnosis,
    kept_estimate,
)

REFUTED = ESTIMATE | {"refuted": True, "warnings": ["the model leaves 3 standard deviations"]}
EXPLAINED = DIAGNOSIS | {
    "verdict": "explained",
    "b1_deg": {"value": 0.11, "std": 0.01},
    "b2_deg": {"value": 0.05, "std": 0.002},
    "warnings": ["few levels were held out"],
    "models": DIAGNOSIS["models"][:1],
}


def estimated(db, number, document):
    with Store(db, read_only=True) as store:
        measured = store.measurement(number)
    keep_estimate(db, measured, document)


def diagnosed(db, number, document, unit="adss"):
    with Store(db, read_only=True) as store:
        response = store.response(number)
    keep_diagnosis(db, number, [response], load_unit(unit), document)


def told(run, *words):
    code, out, _ = run("history", "--json", "--estimate", "none", *words)
    assert code == 0
    return json.loads(out)


def test_refuted_model_gives_no_number_or_trend(run, db):
    for _ in range(3):
        run(*measuring("--serial", "S"))
    for number, document in ((1, ESTIMATE), (2, REFUTED), (3, ESTIMATE)):
        estimated(db, number, document)
    document = told(run)
    first, second, _ = document["measurements"]
    assert first["contribution_ratio"]["value"] == 0.31
    assert (first["answer"]["state"], first["warnings"]) == ("not judged", [])
    assert second["contribution_ratio"] is second["b1_deg"] is second["b2_deg"] is None
    assert second["answer"]["state"] == "refuted"
    assert second["warnings"] == REFUTED["warnings"]
    # What the plain model said is there for whoever asks.
    assert second["estimate"]["contribution_ratio"]["value"] == 0.31
    assert {trend["measurements"] for trend in document["trends"]} == {2}
    code, out, _ = run("history", "--estimate", "none")
    assert code == 0
    assert out.count("0.310 +- 0.050") == 2
    assert "no model is accepted: plain model refuted; diagnose it first" in out
    assert "warning: the model leaves 3 standard deviations" in out
    assert max(map(len, out.splitlines())) <= 80


@pytest.mark.parametrize(
    ("diagnosis", "state", "ratio"),
    [
        (EXPLAINED, "accepted", 0.31),
        (EXPLAINED | {"verdict": "unexplained", "causes": []}, "refuted", None),
        (DIAGNOSIS, "open", None),
    ],
)
def test_diagnosis_decides_which_numbers_are_shown(run, db, diagnosis, state, ratio):
    run(*measuring("--serial", "S"))
    estimated(db, 1, REFUTED)
    diagnosed(db, 1, diagnosis)
    document = told(run)
    (row,) = document["measurements"]
    assert row["answer"]["state"] == state
    assert (row["contribution_ratio"] or {}).get("value") == ratio
    assert row["diagnosis"]["verdict"] == diagnosis["verdict"]
    assert row["warnings"][:1] == REFUTED["warnings"]
    if ratio:
        assert row["contribution_ratio"]["std"] == 0.04
        assert row["b1_deg"]["value"] == 0.11
        assert row["warnings"][1:] == ["few levels were held out"]
    assert bool(document["trends"]) == bool(ratio)
    out = run("history", "--estimate", "none")[1]
    assert f"diagnosed {diagnosis['verdict']}" in out
    assert ("load-inertia (0.55)" in out) == bool(diagnosis["causes"])


def test_several_models_left_widen_the_interval(run, db):
    """Two models left at 0.55 and 0.41: the trend knows the ratio as badly as both together."""
    first, second = DIAGNOSIS["models"]
    for serial in ("S", "S"):
        run(*measuring("--serial", serial))
    diagnosed(db, 1, EXPLAINED | {"models": [first, second]})
    document = told(run)
    row = document["measurements"][0]
    assert row["answer"]["state"] == "accepted"
    assert row["contribution_ratio"]["value"] == first["contribution_ratio"]["value"]
    (said,) = [text for text in row["warnings"] if "still open" in text]
    both = row["answer"]["over_models"]["contribution_ratio"]
    low, high = both["interval95"]
    assert f"is {low:.2f} to {high:.2f}" in said
    ends = [end for m in (first, second) for end in m["contribution_ratio"]["interval95"]]
    assert [low, high] == [min(ends), max(ends)]
    (trend,) = [t for t in document["trends"] if t["quantity"] == "contribution_ratio"]
    assert trend["mean"]["std"] == pytest.approx(both["std"])
    assert both["std"] > first["contribution_ratio"]["std"]
    assert "still open" in run("history", "--estimate", "none")[1]


@pytest.mark.parametrize("value", ["-5.0", "7.5", "1e300"])
def test_impossible_ratio_is_refused(run, db, value):
    run(*measuring("--serial", "S"))
    diagnosed(db, 1, EXPLAINED)
    with sqlite3.connect(db) as raw:
        for place in (
            "$.contribution_ratio.extended.value",
            "$.models[0].contribution_ratio.value",
        ):
            raw.execute(
                "UPDATE diagnoses SET summary = json_set(summary, ?, json(?))", (place, value)
            )
    raw.close()
    code, out, err = run("history", "--json", "--estimate", "none")
    assert (code, out) == (2, "")
    assert "cannot be read" in err


def test_remeasured_points_invalidate_answers_despite_clock(run, db):
    """The date of the answer does not count, not even one in the future."""
    run(*measuring("--serial", "S"))
    estimated(db, 1, ESTIMATE)
    diagnosed(db, 1, EXPLAINED)
    with sqlite3.connect(db) as raw:
        for table in ("estimates", "diagnoses"):
            raw.execute(f"UPDATE {table} SET made = '2099-01-01T00:00:00+00:00'")
    raw.close()
    assert told(run)["measurements"][0]["answer"]["state"] == "accepted"
    assert run(*measuring("--resume", 1, "--remeasure", "140:150"))[0] == 0
    (row,) = told(run)["measurements"]
    assert (row["answer"]["state"], row["estimate"], row["diagnosis"]) == ("none", None, None)
    with Store(db, read_only=True) as store:
        assert kept_estimate(store, 1, load_unit("adss")) is None
        assert kept_diagnosis(store, 1, load_unit("adss")) is None


def test_diagnosis_counts_for_its_unit_and_software(run, db, tmp_path):
    run(*measuring())
    diagnosed(db, 1, EXPLAINED)
    adss = load_unit("adss")
    renamed = adss.model_copy(update={"name": "gimbal"})
    other = adss.with_parameters(J_L=2 * adss.parameters["J_L"])
    with Store(db, read_only=True) as store:
        assert kept_diagnosis(store, 1, adss).to_json() == EXPLAINED
        # What it is called and what is allowed of it is no physics.
        assert kept_diagnosis(store, 1, renamed) is not None
        assert kept_diagnosis(store, 1, other) is None
    with sqlite3.connect(db) as raw:
        raw.execute("UPDATE diagnoses SET software = 'lashbench 0.0.1'")
    raw.close()
    with Store(db, read_only=True) as store:
        assert kept_diagnosis(store, 1, adss) is None
    # It is listed all the same: by whom it was made stands beside it.
    assert told(run)["measurements"][0]["diagnosis"]["software"] == "lashbench 0.0.1"


def test_diagnosis_with_other_unit_values_is_ignored(run, db):
    run(*measuring())
    diagnosed(db, 1, EXPLAINED, "edss")
    assert told(run)["measurements"][0]["diagnosis"] is None
    with Store(db, read_only=True) as store:
        assert kept_diagnosis(store, 1, load_unit("edss")) is not None


def test_estimate_of_earlier_edition_is_marked(run, db):
    run(*measuring())
    with Store(db) as store:
        store.add_estimate(1, "lashbench 0.0.1", ESTIMATE)
    (row,) = told(run)["measurements"]
    assert row["contribution_ratio"]["value"] == 0.31
    (warning,) = row["warnings"]
    assert "earlier edition of the inference (lashbench 0.0.1); --estimate all" in warning
    with Store(db, read_only=True) as store:
        assert store.lacking() == []
        assert store.lacking(edition="2") == [1]


def test_list_shows_newest_and_trend_uses_all(run, db):
    for number in (1, 2, 3):
        run(*measuring("--serial", "S"))
        estimated(db, number, ESTIMATE)
    run(*measuring("--serial", "T"))
    code, out, err = run("history", "--last", "2", "--estimate", "none")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines() if "complete" in line] == ["3", "4"]
    assert "the last 2 of 4 measurements; --last N lists more" in err
    # 0.05 over the root of three: all of them count.
    assert "contribution_ratio 0.31 +- 0.029" in out
    assert [row["id"] for row in told(run, "--last", "1")["measurements"]] == [4]
    assert [row["id"] for row in told(run, "--serial", "S")["measurements"]] == [1, 2, 3]
    assert run("history", "--last", "0")[0] == 2


def test_report_states_use_of_stored_diagnosis(run, db, tmp_path):
    run(*measuring())
    estimated(db, 1, ESTIMATE)
    diagnosed(db, 1, EXPLAINED)
    for words in ([], ["--no-diagnose"]):
        out = tmp_path / "r.html"
        code, _, err = run("report", 1, "--unit", "adss", "--out", out, *words)
        assert code == 0
        assert "the diagnosis is from the history, made 20" in err
        text = out.read_text()
        assert "few levels were held out" in text
        assert "The diagnosis is from the history" in text
