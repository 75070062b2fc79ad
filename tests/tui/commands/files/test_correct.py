"""The verb correct: what was said of a measurement is mended, and what stood there stays."""

import json

import pytest
from instruments.measuring import measuring

from daq.formats import read_response
from daq.store import Store


def test_a_correction_is_listed_printed_and_exported(run, db, tmp_path):
    run(*measuring("--serial", "SN-7", "--operator", "A. B.", "--notes", "warm"))
    code, out, err = run("correct", 1, "--serial", "SN 8", "--notes", "cold", "--by", "C. D.")
    assert code == 0
    assert "measurement 1: corrected serial, notes" in err
    first, second = out.splitlines()
    assert first.startswith("#1: serial 'SN-7' corrected to 'SN 8' by C. D., 20")
    assert second.startswith("#1: notes 'warm' corrected to 'cold' by C. D., 20")
    assert run("correct", 1)[1] == out
    document = json.loads(run("history", "--json", "--estimate", "none")[1])
    (row,) = document["measurements"]
    assert (row["serial"], row["notes"], row["operator"]) == ("SN 8", "cold", "A. B.")
    assert [(c["field"], c["old"], c["person"]) for c in row["corrections"]] == [
        ("serial", "SN-7", "C. D."), ("notes", "warm", "C. D.")
    ]  # fmt: skip
    assert json.loads(run("correct", 1, "--json")[1])["corrections"] == row["corrections"]
    listed = run("history", "--estimate", "none")[1]
    assert "serial 'SN-7' corrected to 'SN 8'" in listed
    for suffix in ("csv", "h5", "uff", "mat"):
        out = tmp_path / f"x.{suffix}"
        assert run("export", 1, "--out", out)[0] == 0
        provenance = read_response(out).provenance
        assert provenance["serial"] == "SN 8"
        assert list(provenance["corrections"]["old"]) == ["SN-7", "warm"]
        assert list(provenance["corrections"]["person"]) == ["C. D.", "C. D."]


def test_corrected_serial_number_joins_its_trend(run, db):
    for serial in ("S", "X"):
        run(*measuring("--serial", serial))
    number = {"value": 0.3, "std": 0.05}
    with Store(db) as store:
        for measurement in (1, 2):
            store.add_estimate(measurement, "t", {"contribution_ratio": number})
    assert run("correct", 2, "--serial", "S", "--by", "me")[0] == 0
    document = json.loads(run("history", "--json", "--estimate", "none")[1])
    assert [(t["serial"], t["measurements"]) for t in document["trends"]] == [("S", 2)]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((1, "--serial", "x"), "--by NAME"),
        ((1, "--by", "me"), "nothing to correct"),
        ((9, "--serial", "x", "--by", "me"), "measurement 9 is not in"),
        ((9,), "measurement 9 is not in"),
        ((1, "--notes", "two\nlines", "--by", "me"), "not one line of text"),
        ((1, "--notes", "x", "--by", "m\x1be"), "not one line of text"),
        ((1, "--serial", "x" * 1001, "--by", "me"), "serial has 1001 characters"),
    ],
)
def test_invalid_correction_exits_2_changing_nothing(run, db, words, said):
    run(*measuring("--serial", "S"))
    code, out, err = run("correct", *words)
    assert (code, out) == (2, "")
    assert said in err
    with Store(db, read_only=True) as store:
        assert store.measurement(1).header.serial == "S"
        assert store.corrections(1) == []


def test_equal_value_is_no_correction(run, db):
    run(*measuring("--serial", "S"))
    code, out, err = run("correct", 1, "--serial", "S", "--by", "me")
    assert code == 0
    assert "nothing" in err
    assert out == "#1: nothing was corrected\n"
