"""What was analysed and corrected, in a history: which of it is in force, and what stays."""

import sqlite3

import pytest

from daq.analyser import SourceState, SweepPoint
from daq.errors import InputError
from daq.frf import PointFlag
from daq.plan import SweepPlan
from daq.store import Store
from daq.store_records import LONGEST_TEXT, Correction, MeasurementHeader

PLAN = SweepPlan((100.0, 110.0), (1.5,))
ESTIMATE = {
    "contribution_ratio": {"value": 0.3, "std": 0.05},
    "b1_deg": {"value": 0.2, "std": 0.03},
    "warnings": ["the model leaves 3 standard deviations"],
    "error_index": {"ratio": [0.0, 1.0]},
}
DIAGNOSIS = {
    "verdict": "explained",
    "causes": [{"effect": "load-inertia", "probability": 0.97}],
    "contribution_ratio": {"extended": {"value": 0.2, "std": 0.01}},
    "residual": [],
}


def measured(store, serial="SN-7", unit="ADSS", hz=(100.0, 110.0), ended=True):
    number = store.begin(
        MeasurementHeader(unit, serial, PLAN, "sim:", "t", operator="A", notes="warm")
    )
    for frequency in hz:
        store.add_point(number, 1.5, frequency, SweepPoint(frequency, 0.1j))
    if ended:
        store.finish(number, "complete", SourceState.CONFIRMED_OFF)
    return number


def the_clock_was(path, when, table):
    with sqlite3.connect(path) as raw:
        raw.execute(f"UPDATE {table} SET made = ?", (when,))
    raw.close()


@pytest.mark.parametrize("when", ["1999-01-01T00:00:00+00:00", "2099-01-01T00:00:00+00:00"])
def test_answer_in_force_ignores_the_clock(file_store, when):
    number = measured(file_store)
    file_store.add_estimate(number, "t", ESTIMATE)
    file_store.add_diagnosis(number, "t", DIAGNOSIS, {number: 2})
    for table in ("estimates", "diagnoses"):
        the_clock_was(file_store.path, when, table)
    (line,) = file_store.lines()
    assert line.estimate.made == line.diagnosis.made == when
    assert line.estimate.summary == {k: ESTIMATE[k] for k in ESTIMATE if k != "error_index"}
    assert line.diagnosis.summary["causes"] == DIAGNOSIS["causes"]
    assert file_store.estimate_in_force(number).document == ESTIMATE
    assert [one.document for one in file_store.diagnoses_in_force(number)] == [DIAGNOSIS]
    file_store.reopen(number)
    file_store.add_point(number, 1.5, 110.0, SweepPoint(110.0, 0.2j))
    file_store.finish(number, "complete", SourceState.CONFIRMED_OFF)
    (line,) = file_store.lines()
    assert (line.points, line.estimate, line.diagnosis) == (2, None, None)
    assert file_store.estimate_in_force(number) is None
    assert file_store.diagnoses_in_force(number) == []


def test_answer_belongs_to_points_it_used(store):
    number = measured(store, ended=False)
    version = store.response(number).provenance["points_version"]
    store.add_point(number, 1.5, 120.0, SweepPoint(120.0, 0.2j))
    # It took a while: points have come since it read them.
    store.add_estimate(number, "t", ESTIMATE, points_version=version)
    store.add_diagnosis(number, "t", DIAGNOSIS, {number: version})
    assert store.lines()[0].estimate is None
    assert store.lines()[0].diagnosis is None
    version = store.response(number).provenance["points_version"]
    kept = store.add_estimate(number, "t", ESTIMATE, points_version=version, elapsed_s=1.5)
    assert store.estimate_in_force(number) == kept


def test_any_changed_measurement_invalidates_joint_diagnosis(store):
    one, two = measured(store), measured(store)
    kept = store.add_diagnosis(two, "t", DIAGNOSIS, {one: 2, two: 2}, physics="p", edition="e")
    assert store.diagnoses_in_force(two) == [kept]
    assert store.diagnoses_in_force(one) == []
    store.add_point(one, 1.5, 120.0, SweepPoint(120.0, 0.2j))
    assert store.diagnoses_in_force(two) == []
    assert store.lines()[1].diagnosis is None


def test_diagnosis_with_other_values_is_unlisted(store):
    number = measured(store)
    store.add_diagnosis(number, "t", DIAGNOSIS, {number: 2}, as_measured=False)
    assert store.lines()[0].diagnosis is None
    assert len(store.diagnoses_in_force(number)) == 1


def test_counts_are_of_points_in_force(store):
    number = measured(store)
    spoilt = SweepPoint(110.0, 0.1j, flags=PointFlag.SPOILT)
    retaken = SweepPoint(110.0, 0.1j, flags=PointFlag.RETAKEN)
    seen = []
    for point in (spoilt, spoilt, retaken):
        store.add_point(number, 1.5, 110.0, point)
        line, whole = store.lines()[0], store.measurement(number)
        assert (line.points, line.flagged) == (whole.points, whole.flagged)
        seen.append((whole.points, whole.flagged, whole.points_version))
    assert seen == [(2, 1, 3), (2, 1, 4), (2, 0, 5)]


def test_lines_are_filtered_by_unit_and_serial(store):
    for serial, unit in (("A", "ADSS"), ("B", "adss"), ("A", "EDSS"), ("A", "ADSS")):
        measured(store, serial, unit)
    measured(store, "A", hz=())
    assert [line.id for line in store.lines()] == [1, 2, 3, 4, 5]
    assert [line.id for line in store.lines("Adss")] == [1, 2, 4, 5]
    assert [line.id for line in store.lines("Adss", "A", last=2)] == [4, 5]
    assert [line.id for line in store.lines("Adss", last=2, with_points=True)] == [2, 4]
    assert (store.count(), store.count("ADSS", "A"), store.count("none")) == (5, 3, 0)
    assert store.unit_names() == ["ADSS", "EDSS", "adss"]


def test_search_finds_each_word_literally(store):
    for serial, unit in (("SN-07", "ADSS"), ("sn_08", "EDSS"), ("100%", "ADSS")):
        measured(store, serial, unit)
    asked = {
        "sn": [1, 2], "SN adss": [1], "0%": [3], "_": [2], "complete edss": [2], "nobody": [],
        "20": [], "": [1, 2, 3], "|": [], "\\": [], "'; DROP TABLE units; --": [],
    }  # fmt: skip
    for words, numbers in asked.items():
        assert [line.id for line in store.lines(search=words)] == numbers, words
    day = store.measurement(1).started[:10]
    assert (store.count(search="adss"), store.count(search=f"adss {day}")) == (2, 2)


def test_search_reads_long_texts_whole(store):
    """No word is left out, however many there are."""
    measured(store, "a b")
    assert [line.id for line in store.lines(search="adss " * 9 + "a b")] == [1]
    assert store.lines(search="adss " * 12 + "nobody") == []


def test_file_search_ignores_case_beyond_ascii(tmp_path):
    """A server folds letters by its locale."""
    with Store(tmp_path / "bench.db", create=True) as store:
        measured(store, "MÜLLER-7")
        for word in ("müller-7", "Müller", "MÜLLER"):
            assert [line.id for line in store.lines(search=word)] == [1], word


def test_correction_records_person_time_and_old_value(store):
    number, other = measured(store), measured(store)
    done = store.correct(number, "C. D.", {"serial": "SN-8", "notes": "cold", "operator": "A"})
    # The operator was right already.
    assert [(one.field, one.old, one.new) for one in done] == [
        ("serial", "SN-7", "SN-8"), ("notes", "warm", "cold")
    ]  # fmt: skip
    store.correct(number, "E. F.", {"serial": "SN-7"})
    trail = store.corrections(number)
    assert [(one.person, one.field, one.old, one.new) for one in trail] == [
        ("C. D.", "serial", "SN-7", "SN-8"),
        ("C. D.", "notes", "warm", "cold"),
        ("E. F.", "serial", "SN-8", "SN-7"),
    ]
    assert all(isinstance(one, Correction) and one.time > "2020" for one in trail)
    header = store.measurement(number).header
    assert (header.serial, header.notes, header.operator) == ("SN-7", "cold", "A")
    assert [line.corrections for line in store.lines()] == [3, 0]
    assert store.corrections(other) == []
    said = store.response(number).provenance["corrections"]
    assert said["old"] == ["SN-7", "warm", "SN-8"]
    assert said["person"] == ["C. D.", "C. D.", "E. F."]
    assert "corrections" not in store.response(other).provenance


@pytest.mark.parametrize(
    ("number", "person", "changes", "said"),
    [
        (9, "A", {"serial": "x"}, "measurement 9 is not in"),
        (1, " ", {"serial": "x"}, "who made it"),
        (1, "A", {"unit": "x"}, "'unit' cannot be corrected"),
        (1, "A", {"serial": "x", "notes": "y" * (LONGEST_TEXT + 1)}, "notes has 65537 characters"),
    ],
)
def test_correction_that_cannot_be_stored_changes_nothing(store, number, person, changes, said):
    measured(store)
    with pytest.raises(InputError, match=said):
        store.correct(number, person, changes)
    assert store.measurement(1).header.serial == "SN-7"
    assert store.corrections(1) == []


def test_too_long_remark_is_refused_before_measuring(store):
    with pytest.raises(InputError, match="notes has"):
        store.begin(MeasurementHeader("U", "", PLAN, "sim:", "t", notes="n" * (LONGEST_TEXT + 1)))
    assert store.lines() == []


def test_read_size_does_not_grow_with_history(tmp_path):
    """By what SQLite did: the steps of its machine, not the clock."""
    path, steps = tmp_path / "bench.db", []
    with Store(path, create=True) as store:
        measured(store)
    for count in (200, 2000):
        with sqlite3.connect(path) as raw:
            raw.execute(
                "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < ?) "
                "INSERT INTO measurements (unit_id, plan_id, address, state, source_state, started,"
                " software, operator, notes, configurations, readback, points) "
                "SELECT unit_id, plan_id, address, state, source_state, started, software, "
                "operator, notes, configurations, readback, 5 FROM measurements, n WHERE id = 1",
                (count,),
            )
        raw.close()
        steps.append(_steps_of_a_look(path))
    assert steps[1] < 1.2 * steps[0]


def _steps_of_a_look(path):
    from sqlalchemy import event
    from sqlalchemy.pool import Pool

    ticks = []

    def count(connection, _record):
        connection.set_progress_handler(lambda: ticks.append(1), 100)

    event.listen(Pool, "connect", count)
    try:
        with Store(path, read_only=True) as store:
            ticks.clear()
            assert len(store.lines(last=20, with_points=True)) == 20
            assert store.measurement(1).points == 2
            return len(ticks)
    finally:
        event.remove(Pool, "connect", count)
