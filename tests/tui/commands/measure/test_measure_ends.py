"""Ends of a measurement that were asked for, going on with it, and running it again."""

import json
import os
import re
import shlex
import signal
import sqlite3
import threading
import time

import pytest
from instruments.measuring import STATES, at_point, measuring, stopped

from daq.analyser import SourceState
from daq.configs import config_path
from daq.frf import PointFlag
from daq.store import Store


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGUSR2])
def test_signal_ends_safely_and_can_resume(run, db, monkeypatch, number):
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


def test_printed_resume_command_works(run, db, monkeypatch):
    with monkeypatch.context() as patch:
        at_point(patch, 2, lambda: signal.raise_signal(signal.SIGTERM))
        _, _, err = run(*measuring())
    (line,) = (line for line in err.splitlines() if line.startswith("go on with: lashbench "))
    assert run(*shlex.split(line)[4:], history=False)[0] == 0
    with Store(db) as store:
        assert store.measurement(1).state == "complete"


def test_resume_uses_its_unit_bench_and_recipe(run, db, monkeypatch, tmp_path):
    """Files of one's own are found by their paths, and their limits hold to the end."""
    own = {}
    for kind, name in (("units", "adss"), ("benches", "default"), ("recipes", "adss")):
        own[kind] = tmp_path / f"my {kind}.toml"
        own[kind].write_text(config_path(kind, name).read_text(encoding="utf-8"))
    files = ["--bench", str(own["benches"]), "--recipe", str(own["recipes"])]
    with monkeypatch.context() as patch:
        at_point(patch, 2, lambda: signal.raise_signal(signal.SIGTERM))
        _, _, err = run(*measuring(*files, unit=str(own["units"])))
    (line,) = (line for line in err.splitlines() if line.startswith("go on with: lashbench "))
    words = shlex.split(line)[4:]
    assert [words[words.index(option) + 1] for option in ("--unit", "--bench", "--recipe")] == [
        str(own[kind]) for kind in ("units", "benches", "recipes")
    ]
    text = own["benches"].read_text()
    own["benches"].write_text(re.sub(r"(?m)^source_vpk = .*", "source_vpk = 0.1", text))
    assert run(*words, history=False)[0] == 5
    own["benches"].write_text(text)
    assert run(*words, history=False)[0] == 0
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


def test_ctrl_z_does_not_stop_driving_program(run, monkeypatch):
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


def test_keys_do_not_skip_safe_off(run, db, monkeypatch):
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


def test_closed_listener_does_not_end_measurement(run, db, monkeypatch):
    def broken():
        raise BrokenPipeError

    at_point(monkeypatch, 3, broken)
    assert run(*measuring())[0] == 0
    with Store(db) as store:
        assert store.measurement(1).state == "complete"


def test_resume_needs_and_accepts_no_other_plan(run, monkeypatch):
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


def test_resuming_with_other_unit_values_is_refused(run, db, monkeypatch, tmp_path):
    stopped(run, monkeypatch)
    text = config_path("units", "adss").read_text()
    own = tmp_path / "own.toml"
    for old, new, code, said in (
        ("R_m = 4.1", "R_m = 4.5", 2, "R_m is 4.5 and was 4.1; give a unit file that has those"),
        ("J_L = 2.75e-3", "J_L = 5e-3", 2, "J_L is 0.005 and was 0.00275"),
        ("source_vpk = 5.0", "source_vpk = 2.0", 5, "above the 2 V peak of unit ADSS"),
        ("source_vpk = 5.0", "source_vpk = 4.0", 0, "2 of them stored"),
    ):
        assert text.count(old) == 1
        own.write_text(text.replace(old, new))
        ended, _, err = run("measure", "--unit", own, "--instrument", "sim:", "--resume", "1")
        assert (ended, said in err) == (code, True), err
    with Store(db, read_only=True) as store:
        assert store.measurement(1).state == "complete"


@pytest.mark.parametrize("kept", [{"unit": "["}, {"unit": "schema = 1"}, {}])
def test_unreadable_old_unit_file_permits_resume(run, db, monkeypatch, kept):
    stopped(run, monkeypatch)
    with sqlite3.connect(db) as history:
        history.execute("UPDATE measurements SET configurations = ?", (json.dumps(kept),))
    history.close()
    assert run("measure", "--unit", "adss", "--instrument", "sim:", "--resume", "1")[0] == 0


SAID = ["--serial", "S", "--operator", "anna", "--notes", "one", "--spacing", "log"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--spacing", "lin"], "spacing 'lin' was given and it has 'log'"),
        (["--operator", "bob"], "operator 'bob' was given and it has 'anna'"),
        (["--notes", "SECOND"], "notes 'SECOND' was given and it has 'one'"),
        (["--serial", "T"], "serial 'T' was given and it has 'S'"),
        (["--recipe", "edss"], "points 46 was given by recipe EDSS and it has 5"),
        (["--recipe", "adss", "--points", "5"], "start_hz 100.0 was given by recipe ADSS"),
    ],
)
def test_contradiction_to_stored_measurement_is_refused(run, db, words, said):
    assert run(*measuring(*SAID))[0] == 0
    bare = ["measure", "--unit", "adss", "--instrument", "sim:", "--resume", "1"]
    code, out, err = run(*bare, *words)
    assert (code, out) == (2, "")
    assert said in err
    assert "leave that out, or start a new measurement" in err
    assert run(*measuring("--resume", 1, *SAID))[0] == 0


def test_resume_accepts_the_recipe_if_unchanged(run, tmp_path):
    words = ["measure", "--unit", "adss", "--instrument", "sim:", "--recipe", "adss"]
    few = ["--points", "3", "--settle-cycles", "2", "--integrate-cycles", "4"]
    assert run(*words, *few)[0] == 0
    # What was overridden need not be said again.
    assert run(*words, "--resume", "1")[0] == 0
    text = config_path("recipes", "adss").read_text()
    for points, code in ((3, 0), (4, 2)):
        text = re.sub(r"points = \d+", f"points = {points}", text, count=1)
        other = tmp_path / "other.toml"
        other.write_text(text)
        assert run(*words[:-1], other, *few[2:], "--resume", "1")[0] == code


def test_two_points_equal_either_spacing(run):
    plan = ["--level", "2.5", "--start", "130", "--stop", "170", "--points", "2"]
    assert run(*measuring(plan=plan))[0] == 0
    for spacing in ("lin", "log"):
        assert run(*measuring("--spacing", spacing, "--resume", "1", plan=plan))[0] == 0


def test_resuming_a_complete_measurement_is_no_fault(run):
    assert run(*measuring())[0] == 0
    code, out, _ = run(*measuring("--resume", "1", "--json"))
    assert code == 0
    assert json.loads(out)["points"] == 5


def test_long_point_ends_at_once_and_repeats(run, db, tmp_path, monkeypatch):
    monkeypatch.setattr("daq.hp35670a.analyser.calibrate", lambda dialogue: None)
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


@pytest.mark.parametrize("band", ["1:2", "141:149", "170.1:200"])
def test_a_band_without_stored_points_is_refused(run, db, band):
    run(*measuring())
    code, out, err = run(*measuring("--resume", "1", "--remeasure", band))
    low, high = band.split(":")
    assert (code, out) == (2, "")
    assert f"measurement 1 has no point from {low} to {high} Hz" in err
    assert "its 5 points lie from 130 to 170 Hz" in err


def test_transcript_replays_session_without_instrument(run, db, tmp_path):
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
