"""The verbs history and export."""

import json
import math
import re
import sqlite3
from contextlib import closing

import numpy as np
import pytest
from instruments.measuring import measuring, stopped

from daq.configs import config_path
from daq.errors import AnalysisError, LinkError
from daq.formats import read_response
from daq.store import Store
from tui.computations import Computations
from tui.measurements.stored_answers import keep_estimate
from tui.text.layout import columns_of


def test_empty_and_missing_history_are_told_apart(run, db):
    assert run("history")[0] == 2
    Store(db, create=True).close()
    code, out, _ = run("history", "--json")
    assert code == 0
    assert json.loads(out)["measurements"] == []
    (line,) = run("history")[1].splitlines()
    # What it names can be typed as it stands.
    assert line == "no measurements; lashbench measure --help says how to make one"


def test_history_lists_states_and_units(run, monkeypatch):
    stopped(run, monkeypatch)
    run(
        *measuring(
            unit="edss", plan=["--level", "2", "--start", "40", "--stop", "60", "--points", "3"]
        )
    )
    code, out, _ = run("history", "--json", "--estimate", "none")
    assert code == 0
    rows = json.loads(out)["measurements"]
    assert [(r["id"], r["unit"], r["serial"], r["state"], r["points"]) for r in rows] == [
        (1, "ADSS", "S", "interrupted", 2),
        (2, "EDSS", "", "complete", 3),
    ]
    assert rows[0]["contribution_ratio"] is None
    assert rows[0]["started"] < rows[1]["started"]
    for unit in ("adss", "ADSS"):
        _, out, _ = run("history", "--json", "--unit", unit)
        assert [r["id"] for r in json.loads(out)["measurements"]] == [1]
    code, _, err = run("history", "--unit", "zzz")
    assert code == 2
    assert "units in this history: adss, edss" in err


def estimated(store, measurement, ratio, std=0.05):
    number = {"value": ratio, "std": std}
    store.add_estimate(
        measurement,
        "t",
        {"contribution_ratio": number | {"interval95": [0, 1]}, "b1_deg": number, "b2_deg": number},
    )


def test_history_shows_the_trend_with_error_bars(run, db):
    for _ in range(3):
        run(*measuring("--serial", "S"))
    with Store(db) as store:
        for measurement, ratio in ((1, 0.30), (2, 0.40), (3, 0.55)):
            estimated(store, measurement, ratio)
    code, out, _ = run("history", "--json")
    document = json.loads(out)
    assert code == 0
    assert [r["contribution_ratio"]["value"] for r in document["measurements"]] == [0.3, 0.4, 0.55]
    (trend,) = [t for t in document["trends"] if t["quantity"] == "contribution_ratio"]
    assert (trend["unit"], trend["serial"], trend["measurements"]) == ("ADSS", "S", 3)
    assert trend["mean"]["value"] == pytest.approx(1.25 / 3)
    assert trend["mean"]["std"] == pytest.approx(0.05 / math.sqrt(3))
    assert trend["per_day"] is None
    _, out, _ = run("history")
    assert "0.300 +- 0.050" in out
    bars = [line for line in out.splitlines() if "-o-" in line]
    assert len(bars) == 3
    assert [bar.index("o") for bar in bars] == sorted(bar.index("o") for bar in bars)
    # Seconds apart, no slope per month is claimed; weeks apart it is.
    assert "in 30 days" not in out
    with sqlite3.connect(db) as raw:
        for day in (1, 8, 15):
            raw.execute(
                "UPDATE measurements SET started = ? WHERE id = ?",
                (f"2026-11-{day:02d}T12:00:00+00:00", (day + 6) // 7),
            )
    raw.close()
    _, out, _ = run("history")
    # A line through 0.30, 0.40, 0.55 a week apart rises by 0.125 a week.
    assert "+0.536 +- 0.15 in 30 days" in out
    assert "differ by more than their errors" not in out


def test_alarm_tells_when_limit_is_reached(run, db, tmp_path):
    for _ in range(3):
        run(*measuring("--serial", "S"))
    with Store(db) as store:
        for measurement, ratio in ((1, 0.30), (2, 0.40), (3, 0.55)):
            estimated(store, measurement, ratio)
    with closing(sqlite3.connect(db)) as raw:
        for day in (1, 8, 15):
            raw.execute(
                "UPDATE measurements SET started = ? WHERE id = ?",
                (f"2026-11-{day:02d}T12:00:00+00:00", (day + 6) // 7),
            )
        raw.commit()
    limits = tmp_path / "limits.toml"

    def judged(bounds, *options):
        limits.write_text(f'schema = 1\nname = "line"\n[acceptance]\nr = [{bounds}]\n')
        return run("history", "--judge", str(limits), "--estimate", "none", *options)[1]

    # 0.417 at the 8th, and 0.125 a week: 0.70 is reached 15.9 days later.
    (trend, *_) = json.loads(judged("{ upper = 0.7 }", "--json"))["trends"]
    assert trend["alarm"] == {"limit": 0.7, "date": "2026-11-24", "reached": False}
    assert "ALARM: at this rate it reaches the limit 0.7 on 2026-11-24" in flowed(
        judged("{ upper = 0.7 }")
    )
    assert "passed the limit 0.45 on 2026-11-10" in flowed(judged("{ upper = 0.45 }"))
    assert "ALARM" not in judged("{ lower = 0.1 }")


def flowed(text):
    return " ".join(text.split())


def test_history_filters_by_day_and_state(run, db, monkeypatch):
    stopped(run, monkeypatch)
    run(*measuring())
    with closing(sqlite3.connect(db)) as raw:
        raw.execute(
            "UPDATE measurements SET started = ? WHERE id = 1",
            ("2026-10-31T23:59:59.000000+00:00",),
        )
        raw.commit()

    def listed(*options):
        _, out, _ = run("history", "--json", "--estimate", "none", *options)
        return [row["id"] for row in json.loads(out)["measurements"]]

    assert listed() == [1, 2]
    assert listed("--since", "2026-11-01") == [2]
    assert listed("--since", "2026-11-01T00:59:59+01:00") == [1, 2]
    assert listed("--state", "interrupted") == [1]
    assert listed("--state", "interrupted", "--since", "2026-11-01") == []
    assert "no such measurements" in run("history", "--state", "aborted")[1]
    code, _, err = run("history", "--since", "yesterday")
    assert (code, err.count("\n")) == (2, 1)
    assert "--since yesterday: give a day such as 2026-11-01" in err


def test_disagreeing_values_are_not_combined_silently(run, db):
    for _ in range(2):
        run(*measuring("--serial", "S"))
    with Store(db) as store:
        for measurement, ratio in ((1, 0.20), (2, 0.60)):
            estimated(store, measurement, ratio)
    document = json.loads(run("history", "--json")[1])
    (trend,) = [t for t in document["trends"] if t["quantity"] == "contribution_ratio"]
    assert trend["per_day"] is None
    assert trend["chi2"] == pytest.approx(2 * (0.2 / 0.05) ** 2)
    assert "differ by more than their errors" in run("history")[1]


LONG = "Seeker gimbal of the second prototype, batch 2026-11, reworked"


@pytest.mark.parametrize("serial", ["SN 7", "2026-11-" + 60 * "0" + "17 B", "歯車装置 七号機"])
def test_lines_fit_terminal_without_loss(run, db, tmp_path, serial):
    own = tmp_path / "own.toml"
    text = config_path("units", "adss").read_text(encoding="utf-8")
    own.write_text(re.sub("(?m)^name = .*", f'name = "{LONG}"', text), encoding="utf-8")
    for unit in ("adss", "adss", str(own)):
        run(*measuring("--serial", serial, unit=unit))
    with Store(db) as store:
        for measurement, ratio in ((1, 0.2), (2, 0.6), (3, 0.4)):
            estimated(store, measurement, ratio, std=0.0512)
    # Weeks apart, with all that can be said of a trend.
    with sqlite3.connect(db) as raw:
        raw.execute("UPDATE measurements SET started = '2026-01-01T12:00:00+00:00' WHERE id = 1")
    raw.close()
    code, out, _ = run("history")
    assert code == 0
    assert max(map(columns_of, out.splitlines())) <= 80
    # What wraps goes on in the same column or after two blanks; nothing is left out.
    squeezed = re.sub(r"\s", "", out)
    for word in (f"backlash of {LONG} {serial};", f"backlash of ADSS {serial};", "in 30 days"):
        assert re.sub(r"\s", "", word) in squeezed
    for said in ("5/5", "complete", "(SIMULATED)", "0.600 +- 0.051", "0.6000 +- 0.0512"):
        assert said in out


def test_long_numbers_shorten_the_bar(run, db):
    run(*measuring())
    long, ratio = {"value": 123.4, "std": 123.4}, {"value": 0.5, "std": 0.1, "interval95": [0, 1]}
    with Store(db) as store:
        store.add_estimate(1, "t", {"contribution_ratio": ratio, "b1_deg": long, "b2_deg": long})
    out = run("history")[1]
    assert "--o--" not in out
    assert "-o-" in out
    assert max(map(len, out.splitlines())) == 80
    assert out.count("123.4000 +- 123.4000") == 2


class Result:
    """An estimate of 0.3."""

    def to_json(self):
        number = {"value": 0.3, "std": 0.1}
        return {"contribution_ratio": number, "b1_deg": number, "b2_deg": number}


def ratios(run, *words, **options):
    code, out, _ = run("history", "--json", *words, **options)
    assert code == 0
    ratios = [row["contribution_ratio"] for row in json.loads(out)["measurements"]]
    return [None if ratio is None else ratio["value"] for ratio in ratios]


def test_missing_estimates_are_made_once(run, db):
    run(*measuring())
    run(*measuring())
    calls = []

    def estimate(response, unit, progress=None, **_):
        calls.append((unit.name, len(response)))
        if len(calls) == 2:
            raise AnalysisError("no resonance in it")
        return Result()

    compute = Computations(estimate_response=estimate)
    code, out, err = run("history", "--json", compute=compute)
    rows = json.loads(out)["measurements"]
    assert code == 0
    assert rows[0]["contribution_ratio"]["value"] == 0.3
    assert rows[1]["contribution_ratio"] is None
    assert "measurement 2 gives no estimate: no resonance in it" in err
    again = run("history", "--json", compute=compute)[1]
    assert json.loads(again) == json.loads(out)
    assert calls == [("ADSS", 5), ("ADSS", 5)]
    # What failed is tried once more where all is asked for.
    assert ratios(run, "--estimate", "all", compute=compute) == [0.3, 0.3]
    assert len(calls) == 3


def test_remeasured_points_invalidate_the_estimate(run, db):
    compute = Computations(estimate_response=lambda *_, **__: Result())
    run(*measuring())
    with Store(db) as store:
        estimated(store, 1, 0.9)
    assert ratios(run, "--estimate", "none", compute=compute) == [0.9]
    run(*measuring("--resume", 1, "--remeasure", "40:200"))
    assert ratios(run, "--estimate", "none", compute=compute) == [None]
    assert ratios(run, compute=compute) == [0.3]


@pytest.mark.parametrize("failed", [False, True])
def test_resumed_measurement_invalidates_its_earlier_estimate(run, db, monkeypatch, failed):
    compute = Computations(estimate_response=lambda *_, **__: Result())
    stopped(run, monkeypatch)
    with Store(db) as store:
        if failed:
            store.add_estimate(1, "t", {"failed": "too few points"})
        else:
            estimated(store, 1, 0.9)
    assert ratios(run, compute=compute) == [None if failed else 0.9]
    run(*measuring("--resume", 1))
    assert ratios(run, compute=compute) == [0.3]


def test_points_replaced_during_estimate_discard_it(run, db):
    run(*measuring())
    with Store(db, read_only=True) as store:
        before = store.measurement(1)
    run(*measuring("--resume", 1, "--remeasure", "40:200"))
    keep_estimate(db, before, Result().to_json())
    assert ratios(run, "--estimate", "none") == [None]
    with Store(db, read_only=True) as store:
        again = store.measurement(1)
    keep_estimate(db, again, Result().to_json())
    assert ratios(run, "--estimate", "none") == [0.3]


def test_lost_cluster_stores_no_failed_estimate(run, db):
    def lost(*_, **__):
        raise LinkError("the Dask scheduler was lost")

    run(*measuring())
    compute = Computations(estimate_response=lost)
    assert run("history", compute=compute)[0] == 3
    with Store(db, read_only=True) as store:
        assert store.latest_estimates() == {}


@pytest.mark.parametrize("suffix", [".csv", ".h5", ".uff", ".mat"])
def test_export_returns_stored_response(run, db, tmp_path, suffix):
    run(*measuring("--notes", "n", "--serial", "7"))
    out = tmp_path / f"x{suffix}"
    assert run("export", 1, "--out", out)[0] == 0
    read = read_response(out)
    with Store(db) as store:
        stored = store.response(1)
    np.testing.assert_allclose(read.gain, stored.gain, rtol=1e-14)
    np.testing.assert_array_equal(read.frequency_hz, stored.frequency_hz)
    np.testing.assert_allclose(read.gain_std_db, stored.gain_std_db, rtol=1e-14)
    np.testing.assert_array_equal(read.flags, stored.flags)
    assert read.unit == "ADSS"
    assert read.provenance["kind"] == "simulated"
    assert read.provenance["notes"] == "n"
    assert read.provenance["points"]["taken"] == stored.provenance["points"]["taken"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((9, "--out", "x.csv"), "measurement 9 is not in"),
        ((1, "--out", "x.xyz"), "cannot write files that end in '.xyz'"),
        ((1, "--out", "/nowhere/x.csv"), "there is no directory /nowhere"),
        (("one", "--out", "x.csv"), "not a whole number"),
    ],
)
def test_impossible_export_is_refused(run, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    run(*measuring())
    code, _, err = run("export", *words)
    assert code == 2
    assert said in err
