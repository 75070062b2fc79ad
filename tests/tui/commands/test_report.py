"""The verb report: files and stored measurements, with and without a diagnosis."""

import html
import json
import re
import shlex
import threading
from dataclasses import replace

import pytest
from outputs import report_makings as makings

from analysis.diagnosis.experiment_design import NextMeasurement
from daq.configs import config_path, sample_path
from daq.errors import AnalysisError
from daq.plan import SweepPlan
from daq.store import Store
from sim.unit import load_unit
from tui import cli
from tui.computations import Computations
from tui.measurements.stored_answers import keep_estimate, kept_estimate

SAMPLE = str(sample_path("adss-sweep"))
QUICK = ["--level", "2.5", "--start", "130", "--stop", "170", "--points", "5"]
QUICK += ["--settle-cycles", "3", "--integrate-cycles", "4"]


class Quick:
    """An estimate that is known."""

    def to_json(self):
        return makings.ESTIMATE


class Calls(dict):
    """What was asked of computations that take no time."""

    compute = None


@pytest.fixture
def calls():
    """What was estimated and diagnosed, by doubles that take no time."""
    made = Calls(estimate=[], diagnose=[])

    def estimate(response, unit, *, cache, progress):
        made["estimate"].append((response, unit))
        return Quick()

    def diagnose(response, unit, *, cache, progress):
        made["diagnose"].append((response, unit))
        raise AnalysisError("this response is too short")

    made.compute = Computations(estimate_response=estimate, diagnose_response=diagnose)
    return made


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A history with one short measurement."""
    db = tmp_path_factory.mktemp("bench") / "bench.db"
    words = ["measure", "--unit", "adss", "--instrument", "sim:?ratio=0.3&seed=1", *QUICK]
    words += ["--operator", "A. B.", "--serial", "SN 7", "--db", str(db), "--quiet"]
    assert cli.main(words) == 0
    return db


def data_of(path):
    text = path.read_text(encoding="utf-8")
    (block,) = re.findall(r'id="lashbench-report">(.*?)</script>', text, re.DOTALL)
    return json.loads(block)


def test_a_report_on_a_file(calls, tmp_path, capsys):
    out = tmp_path / "r.html"
    assert (
        cli.main(
            ["report", SAMPLE, "--unit", "adss", "--out", str(out), "--no-diagnose"], calls.compute
        )
        == 0
    )
    shown, told = capsys.readouterr()
    assert shown == ""
    assert f"wrote {out}" in told
    data = data_of(out)
    assert data["origin"]["name"] == "adss-sweep.csv"
    assert data["estimate"]["b1_deg"] == makings.ESTIMATE["b1_deg"]
    assert data["remarks"]["diagnosis"].endswith("left out on request.")
    assert calls["diagnose"] == []


def test_report_is_written_without_possible_diagnosis(calls, tmp_path, capsys):
    out = tmp_path / "r.html"
    assert cli.main(["report", SAMPLE, "--unit", "adss", "--out", str(out)], calls.compute) == 0
    assert len(calls["diagnose"]) == 1
    assert "No diagnosis could be made: this response is too short." in out.read_text()


@pytest.fixture(scope="module")
def found():
    with pytest.MonkeyPatch.context() as patch:
        return makings.diagnosis(patch, ("load-inertia",), [("load-inertia",)])


def test_report_contains_the_diagnosis(found, calls, tmp_path):
    calls.compute = replace(calls.compute, diagnose_response=lambda *_, **__: found)
    out = tmp_path / "r.html"
    assert cli.main(["report", SAMPLE, "--unit", "adss", "--out", str(out)], calls.compute) == 0
    assert data_of(out)["diagnosis"]["verdict"] == "explained"


def test_printed_command_names_unit_by_its_path(found, calls, tmp_path, capsys):
    plan = SweepPlan((100.0, 120.0), (1.0,), settle_cycles=3, integrate_cycles=4)
    # The name of the unit is that of one that comes with lashbench, and would pass for it.
    proposal = NextMeasurement("ADSS", plan, ("a", "b"), 3.0)
    proposing = replace(found, next_measurement=proposal)
    calls.compute = replace(calls.compute, diagnose_response=lambda *_, **__: proposing)
    own = tmp_path / "my gimbal's.toml"
    own.write_text(config_path("units", "adss").read_text(encoding="utf-8"), encoding="utf-8")
    out = tmp_path / "r.html"
    assert cli.main(["report", SAMPLE, "--unit", str(own), "--out", str(out)], calls.compute) == 0
    command = data_of(out)["diagnosis"]["next_measurement"]["plan"]["command"]
    (shown,) = re.findall(r"<code>(lashbench .*?)</code>", out.read_text())
    assert html.unescape(shown) == command
    words = shlex.split(command)
    assert words[words.index("--unit") + 1] == str(own)
    words[words.index("URL")] = "sim:"
    assert cli.main([*words[1:], "--dry-run"], calls.compute) == 0
    assert "2 points" in capsys.readouterr().out


def test_a_report_on_a_stored_measurement(calls, bench, tmp_path):
    out = tmp_path / "r.html"
    words = ["report", "1", "--unit", "adss", "--out", str(out), "--no-diagnose"]
    assert cli.main([*words, "--db", str(bench)], calls.compute) == 0
    text, data = out.read_text(), data_of(out)
    assert data["origin"]["name"] == "measurement 1 of bench.db"
    assert data["origin"]["source_state"] == "confirmed-off"
    assert data["measurement"]["operator"] == "A. B."
    assert data["instrument"]["model"] == "35670A"
    assert set(data["provenance"]["configurations"]) == {"unit", "bench"}
    assert "SIMULATED" in text
    assert "has changed" not in text
    with Store(bench, read_only=True) as store:
        assert len(data["response"]["frequency_hz"]) == len(store.response(1))


def test_other_unit_than_measured_is_reported_first(calls, bench, tmp_path, capsys):
    words = ["report", "1", "--db", str(bench), "--unit", "edss", "--no-diagnose"]
    assert cli.main([*words, "--out", str(tmp_path / "r.html")], calls.compute) == 0
    assert "warning: the response is of unit ADSS, not of EDSS" in capsys.readouterr().err


def test_default_history_is_the_users_own(calls, bench, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    (tmp_path / "lashbench").mkdir()
    (tmp_path / "lashbench" / "lashbench.db").write_bytes(bench.read_bytes())
    out = tmp_path / "r.html"
    assert (
        cli.main(
            ["report", "1", "--unit", "adss", "--out", str(out), "--no-diagnose"], calls.compute
        )
        == 0
    )
    assert data_of(out)["origin"]["name"] == "measurement 1 of lashbench.db"


def test_stored_estimate_is_used_while_valid(calls, bench, tmp_path):
    db, out = tmp_path / "copy.db", tmp_path / "r.html"
    db.write_bytes(bench.read_bytes())
    adss, edss = load_unit("adss"), load_unit("edss")
    with Store(db) as store:
        store.add_estimate(1, "test", {"failed": "no"})
        assert kept_estimate(store, 1, adss) is None
        kept = makings.ESTIMATE | {"warnings": ["from the history"]}
        keep_estimate(db, store.measurement(1), kept)
        assert kept_estimate(store, 1, adss) == kept
        assert kept_estimate(store, 1, edss) is None
    words = ["report", "1", "--db", str(db), "--out", str(out), "--no-diagnose", "--unit"]
    assert cli.main([*words, "adss"], calls.compute) == 0
    assert calls["estimate"] == []
    assert "from the history" in out.read_text()
    assert cli.main([*words, "edss"], calls.compute) == 0
    assert len(calls["estimate"]) == 1
    assert "it was taken for EDSS" in out.read_text()
    with Store(db) as store:
        # What is of an edition of the inference that nobody knows is none of today.
        store.add_estimate(1, "test", kept)
        assert kept_estimate(store, 1, adss) is None


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere.csv", "--out", "r.html"], "nowhere.csv"),
        ([SAMPLE, "--out", "r.odt"], "ends in .html"),
        ([SAMPLE, "--out", "no/r.html"], "there is no directory"),
        (["7", "--out", "r.html", "--db", "BENCH"], "measurement 7 is not in"),
        (["7", "--out", "r.html", "--db", "gone.db"], "gone.db"),
        (["9" * 30, "--out", "r.html", "--db", "BENCH"], "cannot read files"),
    ],
)
def test_unreportable_input_exits_2_without_file(
    calls, bench, tmp_path, monkeypatch, capsys, words, said
):
    monkeypatch.chdir(tmp_path)
    words = [str(bench) if word == "BENCH" else word for word in words]
    assert cli.main(["report", *words, "--unit", "adss", "--no-diagnose"], calls.compute) == 2
    assert said in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_the_bench_screen_writes_the_same_report(found, bench, tmp_path):
    from tui.app.state.analyses import Analyses, Task

    task = Task(lambda message: None, bench, 1, load_unit("adss"), threading.Event())
    Analyses().report(task, found, tmp_path / "r.html")
    data = data_of(tmp_path / "r.html")
    assert data["origin"]["name"] == "measurement 1 of bench.db"
    assert data["diagnosis"]["verdict"] == "explained"
    Analyses().report(task, None, tmp_path / "r.html")
    assert data_of(tmp_path / "r.html")["diagnosis"] is None


def test_existing_file_named_by_digits_is_read(calls, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "5").write_text("x")
    assert cli.main(["report", "5", "--unit", "adss", "--out", "r.html"], calls.compute) == 2
    assert "cannot read files" in capsys.readouterr().err
