"""The verbs measure, history and export as scripts use them, on the simulated bench."""

import io
import json
import math
import os
import signal
import sqlite3
import threading
import time

import numpy as np
import pytest

from daq.analyser import SourceState
from daq.configs import config_path
from daq.formats import read_response
from daq.frf import PointFlag
from daq.session_events import PointStored
from daq.store import Store
from tui import cli
from tui.bench import drives_hardware

SHORT = ["--level", "2.5", "--start", "130", "--stop", "170", "--points", "5"]
QUICK = ["--settle-cycles", "3", "--integrate-cycles", "4"]
STATES = {"confirmed-off", "unconfirmed", "unknown"}


@pytest.fixture
def db(tmp_path):
    return tmp_path / "bench.db"


@pytest.fixture
def run(db, capsys):
    """Run a verb on the history; exit code, stdout and stderr."""

    def call(verb, *words, history=True):
        place = ["--db", str(db)] if history else []
        code = cli.main([verb, *map(str, words), *place])
        out, err = capsys.readouterr()
        return code, out, err

    return call


def measuring(*words, url="sim:?ratio=0.3&seed=1", unit="adss", plan=SHORT):
    return ["measure", "--unit", unit, "--instrument", url, *plan, *QUICK, *words]


def test_a_measurement_tells_what_the_contract_says(run, db):
    code, out, err = run(*measuring("--json"))
    assert code == 0
    document = json.loads(out)
    assert document["id"] == 1
    assert document["points"] == 5
    assert document["flagged"] == 0
    assert document["source_state"] == "confirmed-off"
    assert document["elapsed_s"] > 0
    for check in ("limits", "identity", "options", "source", "trial point", "input range 1"):
        assert f"pass  {check}:" in err
    assert "SIMULATED" in err
    assert "\x1b" not in err
    with Store(db) as store:
        found = store.measurement(1)
    assert found.header.address == "sim:?ratio=0.3&seed=1"
    assert 'name = "ADSS"' in found.header.configurations["unit"]
    assert 'name = "default"' in found.header.configurations["bench"]
    assert found.header.software.startswith("lashbench ")


def test_without_json_a_line_for_a_person(run):
    code, out, _ = run(*measuring("--quiet"))
    assert code == 0
    assert out.startswith("measurement 1: complete, 5 points, 0 flagged; source confirmed-off")


def test_remarks_are_kept(run, db):
    run(*measuring("--serial", "SN 7", "--operator", "A. B.", "--notes", "warm, ünd"))
    with Store(db) as store:
        header = store.measurement(1).header
    assert (header.serial, header.operator, header.notes) == ("SN 7", "A. B.", "warm, ünd")


def test_several_levels_and_directions(run, db):
    plan = ["--level", "1.5", "--level", "2.5", "--start", "100", "--stop", "200"]
    plan += ["--points", "4", "--spacing", "log", "--direction", "down"]
    assert run(*measuring(plan=plan))[0] == 0
    with Store(db) as store:
        points, response = store.points(1), store.response(1)
    np.testing.assert_allclose(
        [p.requested_hz for p in points], 2 * list(np.geomspace(100, 200, 4)[::-1])
    )
    assert [p.source_vpk for p in points] == [1.5] * 4 + [2.5] * 4
    assert response.direction == "down"


def test_a_recipe_gives_the_plan_and_options_override_it(run, db):
    words = ["measure", "--unit", "adss", "--instrument", "sim:", "--recipe", "adss"]
    assert run(*words, "--points", "3", *QUICK)[0] == 0
    with Store(db) as store:
        plan = store.measurement(1).header.plan
    assert plan.levels_vpk == (2.5,)
    assert plan.frequencies_hz == (100.0, 140.0, 180.0)
    assert plan.settle_cycles == 3


def test_a_recipe_limits_what_the_bench_would_allow(run, db):
    words = ["measure", "--unit", "adss", "--instrument", "sim:", "--recipe", "adss"]
    code, out, err = run(*words, "--level", "4")
    assert (code, out) == (5, "")
    assert "source level 4 V peak is above the 3 V peak of recipe ADSS" in err
    assert not db.exists()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (["--level", "5.5"], "of bench default; source level 5.5 V peak is above"),
        (["--start", "5"], "below the 10 Hz of unit ADSS"),
        (["--stop", "600"], "above the 500 Hz of unit ADSS"),
        (["--offset", "1.5"], "source offset 1.5 V is above the 1 V of unit ADSS"),
        (["--integrate-cycles", "1000000"], "duration"),
    ],
)
def test_a_limit_ends_it_with_5_before_anything_is_touched(run, db, changes, said):
    plan = ["--level", "2", "--start", "130", "--stop", "170", "--points", "5"]
    words = ["measure", "--unit", "adss", "--instrument", "TCPIP::127.0.0.1::9::SOCKET", "--yes"]
    for name, value in zip(changes[::2], changes[1::2], strict=True):
        plan = [w for i, w in enumerate(plan) if name not in (w, plan[i - 1] if i else "")]
        plan += [name, value]
    code, out, err = run(*words, *plan)
    assert (code, out) == (5, "")
    assert said in err
    assert "nothing was sent" in err
    assert not db.exists()


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (measuring(url="nonsense:"), 2, "use one of: sim:"),
        (measuring(url="sim:?colour=red"), 2, "unknown key 'colour'"),
        (measuring(unit="other"), 2, "unit 'other' was not found"),
        (measuring("--bench", "other"), 2, "bench 'other' was not found"),
        (measuring("--recipe", "other"), 2, "recipe 'other' was not found"),
        (measuring(plan=["--level", "2"]), 2, "--start, --stop, --points is missing"),
        (measuring("--remeasure", "1:2"), 2, "--remeasure needs --resume"),
        (measuring("--remeasure", "x"), 2, "is not LOW:HIGH"),
        (measuring("--run-in", "-1"), 2, "run-in of -1 points"),
        (measuring("--resume", "7"), 2, "there is no history"),
        (measuring("--points", "x"), 2, "points"),
        (measuring("--transcript", "/nowhere/t"), 2, "transcript cannot be written"),
        (measuring("--yes", url="prologix-tcp:127.0.0.1:9"), 3, "no connection"),
        (measuring("--yes", url="prologix:/dev/none"), 3, "cannot be opened"),
        (measuring(url="replay:/nowhere"), 2, "cannot be read as a transcript"),
        (measuring(url="sim:?options=AY6"), 1, "swept sine needs 1D2"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(run, words, code, said):
    got, _, err = run(*words)
    errors = [line for line in err.splitlines() if line.startswith("error:")]
    assert got == code
    assert len(errors) == 1
    assert said in errors[0]


def test_hardware_is_not_driven_without_a_word(run, db, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n"))
    code, out, err = run(*measuring(url="TCPIP::127.0.0.1::9::SOCKET"))
    assert (code, out) == (2, "")
    assert "give --yes; nothing was sent" in err
    assert not db.exists()


@pytest.mark.parametrize(
    ("url", "is_hardware"),
    [
        ("sim:", False),
        ("sim:?ratio=0.2", False),
        ("replay:sim:", False),
        ("prologix:/dev/ttyUSB0", True),
        ("GPIB0::11::INSTR", True),
        ("TCPIP::h::1::SOCKET", True),
        ("prologix-tcp:h:1", True),
    ],
)
def test_what_counts_as_hardware(url, is_hardware):
    assert drives_hardware(url) is is_hardware


def test_a_dry_run_touches_nothing(run, db):
    code, out, _ = run(*measuring("--dry-run", "--json", url="prologix:/dev/none"))
    document = json.loads(out)
    assert code == 0
    assert document["points"] == 5
    assert document["duration_s"] == pytest.approx(
        7 * sum(1 / f for f in (130, 140, 150, 160, 170))
    )
    assert document["limits"]["source_vpk"] == 5.0
    code, out, _ = run(*measuring("--dry-run", url="prologix:/dev/none"))
    assert "5 points: 5 from 130 to 170 Hz, up, at 2.5 V peak" in out
    assert not db.exists()


def test_adaptive_adds_points_within_its_budget(run, db):
    words = ["measure", "--unit", "adss", "--instrument", "sim:?ratio=0.3"]
    words += ["--level", "2.5", "--start", "100", "--stop", "180", "--points", "15"]
    assert run(*words, *QUICK, "--adaptive")[0] == 0
    with Store(db) as store:
        points = store.points(1)
        assert json.loads(store.measurement(1).header.configurations["refinement"]) == {
            "target_std_hz": 0.5,
            "budget_points": 30,
        }
    assert 15 < len(points) <= 30
    assert len({p.requested_hz for p in points}) == len(points)


# ---------------------------------------------------------------- ends that were asked for


def at_point(monkeypatch, number, act):
    """Do something as soon as a point is told."""
    from tui.commands import measure

    whole = measure._tell

    def tell(event, console):
        whole(event, console)
        if isinstance(event, PointStored) and event.done == number:
            act()

    monkeypatch.setattr(measure, "_tell", tell)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR2])
def test_a_signal_ends_it_safe_and_it_can_be_resumed(run, db, monkeypatch, number):
    with monkeypatch.context() as patch:
        at_point(patch, 2, lambda: signal.raise_signal(number))
        code, out, err = run(*measuring("--json"))
    assert code == 130
    document = json.loads(out)
    assert (document["points"], document["source_state"]) == (2, "confirmed-off")
    assert document["state"] == "interrupted"
    assert "--resume 1" not in out
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    code, out, _ = run(*measuring("--json", "--resume", "1"))
    assert code == 0
    assert json.loads(out)["points"] == 5
    with Store(db) as store:
        assert store.measurement(1).state == "complete"


def test_ctrl_backslash_aborts_for_good(run, monkeypatch):
    with monkeypatch.context() as patch:
        at_point(patch, 2, lambda: signal.raise_signal(signal.SIGQUIT))
        code, out, _ = run(*measuring("--json"))
    assert code == 130
    assert json.loads(out)["state"] == "aborted"
    code, _, err = run(*measuring("--resume", "1"))
    assert code == 2
    assert "was aborted" in err


def test_ctrl_z_does_not_halt_a_program_that_drives(run, monkeypatch):
    at_point(monkeypatch, 2, lambda: signal.raise_signal(signal.SIGTSTP))
    assert run(*measuring())[0] == 0


def test_a_pause_by_signal_and_on(run, monkeypatch, db):
    def hold():
        signal.raise_signal(signal.SIGUSR1)
        threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGUSR1)).start()

    at_point(monkeypatch, 2, hold)
    code, _, err = run(*measuring())
    assert code == 0
    assert "paused; source confirmed-off" in err
    assert "going on" in err
    with Store(db) as store:
        assert [e.kind for e in store.events(1)].count("pause") == 1


def test_key_presses_during_safe_off_do_not_skip_it(run, db, monkeypatch):
    from daq.hp35670a import HP35670A

    whole, begun = HP35670A.make_safe, []

    def pressed(self):
        begun.append("safe")
        for _ in range(3):
            signal.raise_signal(signal.SIGINT)
        return whole(self)

    def first():
        monkeypatch.setattr(HP35670A, "make_safe", pressed)
        signal.raise_signal(signal.SIGINT)

    at_point(monkeypatch, 2, first)
    code, out, _ = run(*measuring("--json"))
    assert code == 130
    assert begun == ["safe"]
    assert json.loads(out)["source_state"] == "confirmed-off"
    with Store(db) as store:
        assert store.measurement(1).source_state is SourceState.CONFIRMED_OFF


def test_a_listener_who_leaves_does_not_end_it(run, db, monkeypatch):
    def broken():
        raise BrokenPipeError

    at_point(monkeypatch, 3, broken)
    assert run(*measuring())[0] == 0
    with Store(db) as store:
        assert store.measurement(1).state == "complete"


# ---------------------------------------------------------------- resume


def stopped(run, monkeypatch, points=2):
    with monkeypatch.context() as patch:
        at_point(patch, points, lambda: signal.raise_signal(signal.SIGINT))
        assert run(*measuring("--serial", "S"))[0] == 130


def test_resume_needs_no_plan_and_refuses_another_one(run, monkeypatch):
    stopped(run, monkeypatch)
    bare = ["measure", "--unit", "adss", "--instrument", "sim:?ratio=0.3", "--resume", "1"]
    code, _, err = run(*bare, "--points", "6")
    assert code == 2
    assert "points 6 was given and it has 5" in err
    code, _, err = run(*bare, "--level", "1", "--direction", "down")
    assert code == 2
    assert "levels_vpk (1.0,) was given and it has (2.5,)" in err
    assert "direction 'down' was given and it has 'up'" in err
    code, _, err = run(*bare[:2], "edss", *bare[3:])
    assert code == 2
    assert "unit 'EDSS' was given and it has 'ADSS'" in err
    assert run(*bare, "--serial", "T")[0] == 2
    assert run(*bare)[0] == 0


def test_resuming_a_complete_measurement_is_no_fault(run):
    assert run(*measuring())[0] == 0
    code, out, _ = run(*measuring("--resume", "1", "--json"))
    assert code == 0
    assert json.loads(out)["points"] == 5


def test_a_long_point_is_ended_at_once_and_retaken(run, db, tmp_path, monkeypatch):
    monkeypatch.setattr("daq.hp35670a.calibrate", lambda dialogue: None)
    bench = tmp_path / "bench.toml"
    text = config_path("benches", "default").read_text()
    bench.write_text(text + "channel1_range_vpk = 20.0\nchannel2_range_vpk = 20.0\n")
    words = ["measure", "--unit", "adss", "--instrument", "sim:?ratio=0.3&speed=realtime"]
    words += ["--bench", str(bench)]
    words += ["--level", "2.5", "--start", "10", "--stop", "12", "--points", "3"]
    words += ["--settle-cycles", "1", "--integrate-cycles", "5"]
    pressed = []

    def later():
        pressed.append(time.monotonic() + 0.2)
        threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()

    with monkeypatch.context() as patch:
        at_point(patch, 1, later)
        code, out, _ = run(*words, "--json")
    # The point in hand would have taken 0.5 s more; safe-off itself waits for the ramp.
    assert code == 130
    assert time.monotonic() - pressed[0] < 2.0
    document = json.loads(out)
    assert (document["points"], document["source_state"]) == (1, "confirmed-off")
    assert run(*words[:4], "sim:?ratio=0.3", "--resume", "1")[0] == 0
    with Store(db) as store:
        flags = [p.point.flags & PointFlag.RETAKEN for p in store.points(1)]
    assert flags == [0, PointFlag.RETAKEN, 0]


def test_a_band_is_measured_again(run, db):
    run(*measuring())
    code, _, _ = run(*measuring("--resume", "1", "--remeasure", "145:165"))
    assert code == 0
    with Store(db) as store:
        every = store.points(1, superseded=True)
        assert len(store.points(1)) == 5
    assert [p.requested_hz for p in every if p.superseded_by] == [150.0, 160.0]


# ---------------------------------------------------------------- transcripts


def test_a_transcript_runs_the_session_again_without_an_instrument(run, db, tmp_path):
    tape = tmp_path / "tape.jsonl"
    assert run(*measuring("--transcript", str(tape)))[0] == 0
    assert run(*measuring(url=f"replay:{tape}"))[0] == 0
    with Store(db) as store:
        first, second = ([p.point for p in store.points(i)] for i in (1, 2))
    assert first == second
    # Another plan departs from it, and where is said.
    other = ["--level", "2.5", "--start", "131", "--stop", "170", "--points", "5"]
    code, out, err = run(*measuring("--json", url=f"replay:{tape}", plan=other))
    assert code == 3
    assert "it departs here" in err
    assert f"{tape}, line " in err
    assert json.loads(out)["source_state"] in STATES - {"confirmed-off"}


# ---------------------------------------------------------------- history and export


def test_an_empty_history_and_one_that_is_not_there(run, db):
    assert run("history")[0] == 2
    Store(db, create=True).close()
    code, out, _ = run("history", "--json")
    assert code == 0
    assert json.loads(out)["measurements"] == []
    assert "no measurements" in run("history")[1]


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


def test_values_that_do_not_agree_are_not_passed_off_as_one(run, db):
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


def test_missing_estimates_are_made_once_and_kept(run, db, monkeypatch):
    from analysis import estimate as module
    from daq.errors import AnalysisError

    run(*measuring())
    run(*measuring())
    calls = []

    class Result:
        def to_json(self):
            number = {"value": 0.3, "std": 0.1}
            return {"contribution_ratio": number, "b1_deg": number, "b2_deg": number}

    def estimate(response, unit, progress=None, **_):
        calls.append((unit.name, len(response)))
        if len(calls) == 2:
            raise AnalysisError("no resonance in it")
        return Result()

    monkeypatch.setattr(module, "estimate_response", estimate)
    code, out, err = run("history", "--json")
    rows = json.loads(out)["measurements"]
    assert code == 0
    assert rows[0]["contribution_ratio"]["value"] == 0.3
    assert rows[1]["contribution_ratio"] is None
    assert "measurement 2 gives no estimate: no resonance in it" in err
    again = run("history", "--json")[1]
    assert json.loads(again) == json.loads(out)
    assert calls == [("ADSS", 5), ("ADSS", 5)]


@pytest.mark.parametrize("suffix", [".csv", ".h5", ".uff", ".mat"])
def test_export_gives_back_what_was_stored(run, db, tmp_path, suffix):
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
def test_what_cannot_be_exported(run, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    run(*measuring())
    code, _, err = run("export", *words)
    assert code == 2
    assert said in err


@pytest.mark.parametrize("band", [(110, 175, 40), (115, 165, 26), (33, 47, 3), (100.1, 180.3, 7)])
@pytest.mark.parametrize("direction", ["up", "down"])
def test_no_end_of_a_band_is_lost(run, db, band, direction):
    start, stop, points = band
    plan = ["--level", "2.5", "--start", start, "--stop", stop, "--points", points]
    code, _, _ = run(*measuring("--direction", direction, plan=plan))
    assert code == 0
    with Store(db, read_only=True) as store:
        response = store.response(1)
    assert len(response) == points
    assert np.all(np.isfinite(response.gain_db))
