"""The option --judge: verdict, reasons and exit code of every verb that takes it."""

import json
import subprocess
import sys

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from analysis.acceptance import load_limits
from daq.configs import config_path, sample_path
from daq.errors import ConfigurationError
from daq.store import Store
from sim.unit import load_unit
from tui import cli
from tui.measurements.stored_answers import keep_estimate

SAMPLE = str(sample_path("adss-sweep"))
PLAN = ["--level", "2.5", "--start", "110", "--stop", "175", "--points", "14"]
QUICK = ["--settle-cycles", "3", "--integrate-cycles", "4"]
PASS, FAIL, UNDECIDED = 0, 6, 7
ESTIMATE = {
    "contribution_ratio": {"value": 0.3, "std": 0.02},
    "b1_deg": {"value": 0.2, "std": 0.01},
    "b2_deg": {"value": 0.05, "std": 0.001},
    "b_t_deg": {"value": 0.066, "std": 0.002},
    "error_index": None,
    "refuted": False,
    "warnings": [],
}


@pytest.fixture
def limits(tmp_path):
    """Write a file of limits; its path."""

    def write(table, head='schema = 1\nname = "outgoing"\n'):
        path = tmp_path / "limits.toml"
        path.write_text(f"{head}[acceptance]\n{table}\n", encoding="utf-8")
        return str(path)

    return write


@pytest.fixture
def run(capsys):
    def call(*words):
        code = cli.main(list(map(str, words)))
        out, err = capsys.readouterr()
        return code, out, err

    return call


@pytest.mark.parametrize(
    ("table", "code"),
    [
        ("arf_hz = { lower = 120, upper = 150 }", PASS),
        ("arf_hz = { lower = 150 }", FAIL),
        ("arf_hz = { lower = 132 }", UNDECIDED),
        ("rf_hz = { lower = 154.5, level_vpk = 4 }", UNDECIDED),
        ("arf_damping = [{ upper = 0.02, level_vpk = 4 }, { upper = 1, level_vpk = 1.5 }]", PASS),
        *(
            pytest.param(*one, marks=pytest.mark.long)
            for one in (
                ("arf_hz = { lower = 120 }\nb1_deg = { upper = 9 }", UNDECIDED),
                ("arf_hz = { lower = 150 }\nb1_deg = { upper = 9 }", FAIL),
                ("arf_hz = { lower = 132 }\ncoverage_factor = 0.05", FAIL),
            )
        ),
    ],
)  # fmt: skip
def test_extract_gives_verdict_by_exit_code(run, limits, table, code):
    found, text, _ = run("extract", SAMPLE, "--judge", limits(table))
    word = {PASS: "PASS", FAIL: "FAIL", UNDECIDED: "UNDECIDED"}[code]
    assert found == code
    assert f"{word} by limits outgoing" in text
    assert max(map(len, text[text.index(f"{word} by") :].splitlines())) <= 80


def test_json_has_verdict_beside_features(run, limits):
    code, out, _ = run("extract", SAMPLE, "--judge", limits("arf_hz = { lower = 150 }"), "--json")
    document = json.loads(out)
    assert (code, document["judgement"]["verdict"], len(document["levels"])) == (FAIL, "FAIL", 3)
    assert document["judgement"]["failed"] == ["ARF at 1.5 V", "ARF at 2.5 V", "ARF at 4 V"]
    assert document["judgement"]["rule"].startswith("ISO 14253-1")


def test_closed_reader_does_not_change_exit_code(limits):
    words = [sys.executable, "-m", "tui.cli", "extract", SAMPLE, "--judge"]
    with subprocess.Popen(
        [*words, limits("arf_hz = { lower = 150 }")], stdout=subprocess.PIPE
    ) as process:
        process.stdout.close()
        assert process.wait(300) == FAIL  # a starved machine takes its time


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("b1 = { upper = 1 }", "acceptance.b1: "),
        ("b1_deg = { upper = 'x' }", "acceptance.b1_deg.0.upper: "),
        ("b1_deg = { upper = nan }", "acceptance.b1_deg.0.upper: "),
        ("b1_deg = 0.4", "give a table, as in { upper = 0.4 }"),
        ("b1_deg = {}", "give lower, upper or both"),
        ("b1_deg = { lower = 2, upper = 1 }", "lower 2 is not below upper 1"),
        ("b1_deg = { upper = 1, level_vpk = 2 }", "leave out level_vpk"),
        ("r = { upper = 1.5 }", "r.upper 1.5 is not 0 to 1"),
        ("coverage_factor = 0\nr = { upper = 1 }", "acceptance.coverage_factor: "),
        ("causes_not_tolerated = ['rust']", "there is no effect 'rust'"),
        ("", "there is no limit"),
    ],
)
def test_wrong_file_error_names_file_and_key(run, limits, table, words):
    path = limits(table)
    code, out, err = run("extract", SAMPLE, "--judge", path)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert path in err
    assert words in err


def test_wrong_file_is_refused_before_driving(run, limits, tmp_path):
    db = tmp_path / "bench.db"
    for named in (limits("b1 = 1"), tmp_path / "none.toml", "adss"):
        code, _, err = run("measure", "--unit", "adss", "--instrument", "sim:", *PLAN, *QUICK,
                           "--db", db, "--judge", named)  # fmt: skip
        assert (code, err.count("\n"), db.exists()) == (2, 1, False)


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.dictionaries(
    st.sampled_from(["r", "b1_deg", "arf_hz", "coverage_factor", "causes_not_tolerated", "x"]),
    st.one_of(st.floats(), st.text("ab'", max_size=3), st.booleans(),
              st.dictionaries(st.sampled_from(["lower", "upper", "level_vpk", "y"]), st.floats())),
    max_size=3,
))  # fmt: skip
def test_any_table_is_taken_whole_or_refused(limits, table):
    def toml(value):
        if isinstance(value, dict):
            return "{" + ", ".join(f"{k} = {toml(v)}" for k, v in value.items()) + "}"
        return json.dumps(value) if isinstance(value, str | bool) else repr(value)

    path = limits("\n".join(f"{key} = {toml(value)}" for key, value in table.items()))
    try:
        found = load_limits(path)
    except ConfigurationError as error:
        assert path in str(error)  # noqa: PT017
        return
    assert {q for q, _ in found.acceptance.bounds()} == table.keys() - {"coverage_factor"}


def test_unit_file_judges_by_table_and_limits(run, tmp_path):
    path = tmp_path / "mine.toml"
    text = config_path("units", "adss").read_text(encoding="utf-8")
    path.write_text(text.replace("[limits]", "[limits]\nb1_deg = 0.4"), encoding="utf-8")
    assert [b.upper for q, b in load_limits(str(path)).acceptance.bounds()] == [0.4]
    path.write_text(f"{text}\n[acceptance]\narf_hz = {{ lower = 150 }}\n", encoding="utf-8")
    assert run("extract", SAMPLE, "--judge", path)[0] == FAIL
    # What a unit is accepted by does not change how it moves, nor any stored answer.
    assert load_unit(str(path)).physics == load_unit("adss").physics
    path.write_text(f"{text}\n[acceptance]\narf_hz = {{ lowest = 150 }}\n", encoding="utf-8")
    code, _, err = run("extract", SAMPLE, "--judge", path)
    assert (code, "acceptance.arf_hz.0.lowest" in err) == (2, True)


@pytest.fixture(scope="module")
def history(tmp_path_factory):
    """A history with a measurement whose estimate is known, and with one that is not complete."""
    db = tmp_path_factory.mktemp("judged") / "bench.db"
    words = ["measure", "--unit", "adss", "--instrument", "sim:?ratio=0.3&seed=1", *PLAN, *QUICK]
    assert cli.main([*words, "--db", str(db), "--quiet"]) == 0
    with Store(db, read_only=True) as store:
        measured = store.measurement(1)
    keep_estimate(db, measured, ESTIMATE)
    return db


@pytest.mark.parametrize(
    ("table", "code"),
    [
        ("b1_deg = { upper = 0.3 }", PASS),
        ("b1_deg = { upper = 0.1 }", FAIL),
        ("b1_deg = { upper = 0.21 }", UNDECIDED),
        pytest.param(
            "b1_deg = { upper = 0.3 }\narf_hz = { upper = 50 }", FAIL, marks=pytest.mark.long
        ),
        pytest.param("causes_not_tolerated = ['load-inertia']", UNDECIDED, marks=pytest.mark.long),
    ],
)
def test_history_and_report_judge_stored_results(run, limits, history, tmp_path, table, code):
    path = limits(table)
    found, out, _ = run("history", "--db", history, "--estimate", "none", "--judge", path, "--json")
    (row,) = json.loads(out)["measurements"]
    word = {PASS: "PASS", FAIL: "FAIL", UNDECIDED: "UNDECIDED"}[code]
    assert (found, row["judgement"]["verdict"]) == (code, word)
    said, text, _ = run("history", "--db", history, "--estimate", "none", "--judge", path)
    assert (said, f"{word} #1" in text) == (code, True)
    page = tmp_path / "report.html"
    words = ["report", "1", "--unit", "adss", "--db", history, "--out", page, "--no-diagnose"]
    said, text, _ = run(*words, "--judge", path)
    assert (said, word in text, f">{word}<" in page.read_text(encoding="utf-8")) == (
        code, True, True,
    )  # fmt: skip
    assert run(*words)[0] == 0


def test_measure_judges_its_result(run, limits, tmp_path):
    words = ["measure", "--unit", "adss", "--instrument", "sim:?ratio=0.3&seed=1", *PLAN, *QUICK]
    words += ["--db", tmp_path / "bench.db", "--json"]
    for table, code in [("arf_hz = { lower = 100, upper = 200 }", PASS),
                        ("arf_hz = { upper = 100 }", FAIL)]:  # fmt: skip
        found, out, _ = run(*words, "--judge", limits(table))
        document = json.loads(out)
        assert (found, document["source_state"]) == (code, "confirmed-off")
        assert document["judgement"]["items"][0]["quantity"] == "arf_hz"


def test_estimate_judges_the_backlash(run, limits, tmp_path):
    path = tmp_path / "one.toml"
    text = config_path("templates", "one-stage").read_text(encoding="utf-8")
    path.write_text(text, encoding="utf-8")
    words = ["--unit", path, "--level", "2", "--start", "40", "--stop", "160", "--points", "12"]
    words += ["--settle-cycles", "3", "--integrate-cycles", "4", "--ratio", "1"]
    response = tmp_path / "one.csv"
    assert run("simulate", *words, "--out", response)[0] == 0
    found, out, _ = run("estimate", response, "--unit", path, "--json", "--judge",
                        limits("b1_deg = { lower = 300 }\nr = { lower = 0.5 }"))  # fmt: skip
    judged = {item["quantity"]: item for item in json.loads(out)["judgement"]["items"]}
    assert (found, judged["b1_deg"]["verdict"]) == (FAIL, "FAIL")
    # There is one stage: its share of all backlash was not measured.
    assert (judged["r"]["verdict"], "taken as known" in judged["r"]["reason"]) == (
        "UNDECIDED",
        True,
    )
