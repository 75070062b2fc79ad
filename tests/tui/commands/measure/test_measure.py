"""The verb measure as scripts use it, on the simulated bench."""

import io
import json
from itertools import chain

import numpy as np
import pytest
from instruments.measuring import QUICK, measuring

from daq.store import Store
from tui.bench import drives_hardware


def test_measure_json_has_contract_fields(run, db):
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


def test_options_override_plan_of_recipe(run, db):
    words = ["measure", "--unit", "adss", "--instrument", "sim:", "--recipe", "adss"]
    assert run(*words, "--points", "3", *QUICK)[0] == 0
    with Store(db) as store:
        plan = store.measurement(1).header.plan
    assert plan.levels_vpk == (2.5,)
    assert plan.frequencies_hz == (100.0, 140.0, 180.0)
    assert plan.settle_cycles == 3


def test_recipe_limits_apply_within_bench_limits(run, db):
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
def test_limit_exits_5_before_any_command(run, db, changes, said):
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
def test_impossible_request_is_one_line(run, words, code, said):
    got, _, err = run(*words)
    errors = [line for line in err.splitlines() if line.startswith("error:")]
    assert got == code
    assert len(errors) == 1
    assert said in errors[0]


def test_hardware_is_driven_only_with_yes(run, db, monkeypatch):
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
def test_address_decides_on_hardware(url, is_hardware):
    assert drives_hardware(url) is is_hardware


def test_dry_run_changes_nothing(run, db):
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


@pytest.mark.parametrize(
    "band",
    [
        *(pytest.param(one, marks=pytest.mark.long) for one in ((110, 175, 40), (115, 165, 26))),
        (33, 47, 3),
        (100.1, 180.3, 7),
    ],
)
@pytest.mark.parametrize("direction", ["up", "down"])
def test_both_ends_of_band_are_measured(run, db, band, direction):
    start, stop, points = band
    plan = ["--level", "2.5", "--start", start, "--stop", stop, "--points", points]
    code, _, _ = run(*measuring("--direction", direction, plan=plan))
    assert code == 0
    with Store(db, read_only=True) as store:
        response = store.response(1)
    assert len(response) == points
    assert np.all(np.isfinite(response.gain_db))


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("--integrate-cycles", "235"), 5, "integrate cycles 235 is outside the instrument's"),
        (("--level", "0.0001"), 5, "below the smallest step"),
        (
            ("--start", "150", "--stop", "150.05"),
            2,
            "150.025 and 150.0375 Hz would both be measured",
        ),
        (("--notes", "a\udcffb"), 2, "notes 'a\\udcffb' is not one line of text"),
        (("--serial", "a\nb"), 2, "serial 'a\\nb' is not one line of text"),
    ],
)
@pytest.mark.parametrize("dry", [(), ("--dry-run",)])
def test_unsettable_value_is_refused_before_opening(run, db, words, code, said, dry):
    given = {"--unit": "adss", "--instrument": "sim:", "--level": "2", "--points": "5"}
    given |= {"--start": "100", "--stop": "160"} | dict(zip(words[::2], words[1::2], strict=True))
    ended, out, err = run("measure", *chain.from_iterable(given.items()), *dry)
    assert (ended, out) == (code, "")
    assert said in err
    assert not db.exists()
