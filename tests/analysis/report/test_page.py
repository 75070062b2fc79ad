"""The report: what it says, that nothing breaks it, and what a browser makes of it."""

import hashlib
import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from datetime import UTC, datetime
from html.parser import HTMLParser

import numpy as np
import pytest
import report_makings as makings
from browser import look
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from analysis.observation.joint import sweep_lines
from analysis.report import file_origin, write_report
from analysis.report.document import Origin
from analysis.report.html import Markup, data_block, element
from daq.errors import AnalysisError, InputError
from sim.catalogue import CATALOGUE
from sim.unit import load_unit, unit_from_mapping

ADSS = load_unit("adss")
MADE = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
CAUSES = [("load-inertia",), ("shaft-stiffness",), ("load-inertia", "motor-resistance")]
VOID = {"meta", "br", "hr", "col"}


class Page(HTMLParser):
    """A page as its elements, failing where one is not closed in order."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.open, self.tags, self.attributes, self.words, self.blocks = [], [], [], [], {}
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]
        if tag not in VOID:
            self.open.append((tag, dict(attrs)))

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]

    def handle_endtag(self, tag):
        assert self.open.pop()[0] == tag

    def handle_data(self, data):
        if self.open and self.open[-1][0] == "script":
            self.blocks[self.open[-1][1].get("id")] = data
        elif self.open and self.open[-1][0] not in ("style", "text"):
            self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())

    @property
    def data(self):
        return json.loads(self.blocks["lashbench-report"])


@pytest.fixture
def report(tmp_path):
    def make(response=None, unit=ADSS, **parts):
        path = tmp_path / "report.html"
        parts = {"origin": Origin("x.csv"), "estimate": makings.ESTIMATE, "made": MADE} | parts
        assert write_report(path, response or makings.response(), unit, **parts) == path
        return path, Page(path.read_text(encoding="utf-8"))

    return make


@pytest.fixture(scope="module")
def explained():
    with pytest.MonkeyPatch.context() as patch:
        return makings.diagnosis(patch, ("load-inertia",), CAUSES)


def with_limits(b1_deg, b2_deg):
    document = ADSS.model_dump(by_alias=True)
    document["limits"] |= {"b1_deg": b1_deg, "b2_deg": b2_deg}
    return unit_from_mapping(document, "test")


def test_it_says_what_was_measured_and_how(report):
    _, page = report()
    for words in (
        "Backlash report: ADSS SN 7", "Operator A. B.", "Notes warm", "HP 35670A, serial 1",
        "48 points, 100 to 180 Hz, up", "1.5, 4 V peak", "20 cycles settled, 30 averaged",
        "Begun 2026-01-02T03:04:05+00:00", "Report made 2026-01-02T03:04:05+00:00",
    ):  # fmt: skip
        assert words in page.text
    assert "SIMULATED" not in page.text


def test_the_features_and_the_estimate_stand_in_words_and_numbers(report):
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
def test_limits_decide_the_headline_and_the_table_alike(report, limits, said):
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
def test_a_refuted_plain_model_gives_no_advice_and_no_stage_before_a_diagnosis(report, limits):
    _, page = report(unit=with_limits(*limits), estimate=REFUTED)
    assert "No advice before a diagnosis" in page.text
    assert WARNED in page.text
    for word in ("Adjust", "Leave stage", "Stage 1", "Stage 2", "0.6237", "0.900", "PASS", "FAIL"):
        assert word not in page.text
    # The copy for programs holds what was estimated, and that it is refuted.
    assert page.data["estimate"]["warnings"] == REFUTED["warnings"]


def test_with_a_diagnosis_all_numbers_are_those_of_the_model_that_it_accepts(report, explained):
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


def test_the_diagnosis_has_its_causes_gain_and_pictures(report, explained):
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
    assert f"kg.m^2 (datasheet {ADSS.load.J_L:.4g} kg.m^2)\n" in told
    assert f"    To make sure: {cause['check']}.\n" in told


def test_sweeps_that_were_taken_together_are_listed_and_departures_say_of_which(report, explained):
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
def test_every_verdict_has_its_words(report, monkeypatch, hidden, judged, verdict, said):
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


def test_a_tie_is_told_with_the_sweep_that_would_break_it(report):
    class Told:
        def to_json(self):
            from screen import DIAGNOSIS

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


def test_what_is_missing_says_why(report):
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


def test_no_doubt_where_the_unit_is_the_one_that_was_measured(report):
    from daq.configs import config_path

    text = config_path("units", "adss").read_text(encoding="utf-8")
    _, page = report(makings.response(configurations={"unit": text}))
    assert "has changed" not in page.text


def test_the_copy_for_programs_is_whole_and_its_hashes_hold(report, tmp_path):
    file = tmp_path / "data.csv"
    file.write_bytes(b"some bytes")
    response = makings.response()
    _, page = report(response, origin=file_origin(file))
    data = page.data
    columns = data["response"]
    np.testing.assert_allclose(columns["gain_db"], response.gain_db, rtol=0, atol=0)
    np.testing.assert_allclose(columns["frequency_hz"], response.frequency_hz, rtol=0, atol=0)
    compact = json.dumps(columns, sort_keys=True, separators=(",", ":")).encode()
    source = data["provenance"]
    assert source["response_sha256"] == hashlib.sha256(compact).hexdigest()
    assert source["file_sha256"] == hashlib.sha256(b"some bytes").hexdigest()
    bench = source["configurations"]["bench"]
    assert bench["sha256"] == hashlib.sha256(bench["text"].encode()).hexdigest()
    assert data["estimate"]["b1_deg"] == makings.ESTIMATE["b1_deg"]
    assert unit_from_mapping(data["unit"]["document"], "copy") == ADSS
    for digest in (source["response_sha256"], source["file_sha256"], bench["sha256"]):
        assert digest in page.text


def test_one_changed_reading_changes_the_hash(report):
    _, page = report()
    first = page.data["provenance"]["response_sha256"]
    response = makings.response()
    response.gain[7] *= 1.0 + 1e-12
    _, page = report(response)
    assert page.data["provenance"]["response_sha256"] != first


def test_the_same_report_is_the_same_file(report, explained):
    once = report(diagnosis=explained)[0].read_bytes()
    assert report(diagnosis=explained)[0].read_bytes() == once


def test_nothing_is_fetched_and_no_name_is_given_twice(report, explained):
    path, page = report(diagnosis=explained)
    assert "script-src" not in path.read_text()
    assert page.tags.count("script") == 1
    assert not {"img", "link", "iframe", "object"} & set(page.tags)
    names = [value for _, name, value in page.attributes if name == "id"]
    assert len(names) == len(set(names))
    for tag, name, value in page.attributes:
        assert not name.startswith("on"), (tag, name)
        if name in ("href", "xlink:href", "src"):
            assert value[0] == "#", value
            assert value[1:] in names
        for target in re.findall(r"url\(#([^)]+)\)", value or ""):
            assert target in names
    assert "@import" not in path.read_text()


def test_every_picture_is_an_image_with_words_and_sound_xml(report):
    path, _ = report()
    pictures = re.findall(r"<svg.*?</svg>", path.read_text(encoding="utf-8"), re.DOTALL)
    assert len(pictures) == 2
    for picture in pictures:
        root = ET.fromstring(picture)
        assert root.get("role") == "img"
        assert root.get("aria-label")
        assert len(root.findall(".//{http://www.w3.org/2000/svg}path")) > 10


def test_what_an_operator_writes_stays_text(report):
    nasty = makings.NASTY
    response = makings.response(
        unit=nasty, operator=nasty, notes=nasty, serial=nasty, address=nasty,
        configurations={nasty: nasty}, instrument={"maker": nasty, "model": nasty},
    )  # fmt: skip
    estimate = makings.ESTIMATE | {"warnings": [nasty]}
    _, page = report(response, estimate=estimate, remarks={"diagnosis": nasty})
    assert page.tags.count("script") == 1
    assert "img" not in page.tags
    assert page.data["measurement"]["operator"] == nasty
    assert page.data["provenance"]["configurations"][nasty]["text"] == nasty
    assert "<script>alert(1)</script>" in page.text


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.text(), st.text())
def test_markup_cannot_be_broken(text, other):
    whole = element("p", text, element("b", other), class_=text) + data_block({text: other}, "d")
    page = Page(whole)
    assert page.tags == ["p", "b", "script"]
    assert json.loads(page.blocks["d"]) == {text: other}


def test_markup_is_escaped_once_and_a_number_that_is_none_refused():
    assert element("p", Markup("<i>"), "<i>") == "<p><i>&lt;i&gt;</p>"
    with pytest.raises(ValueError, match="JSON"):
        data_block({"a": float("nan")}, "d")


def test_what_is_not_seen_is_written_out(report):
    _, page = report(makings.response(serial="SN\u202e4\x1b[2J", notes="zero\u200bwidth"))
    assert "SN\\u202e4\\x1b[2J" in page.text
    assert "zero\\u200bwidth" in page.text
    assert not {"\u202e", "\x1b", "\u200b"} & set(page.text)
    assert page.data["measurement"]["serial"] == "SN\u202e4\x1b[2J"


def test_a_long_remark_does_not_fill_the_pages(report):
    _, page = report(makings.response(notes="word " * 5000))
    assert "the rest is in the data" in page.text
    assert page.data["measurement"]["notes"] == "word " * 5000


def test_without_phase_errors_levels_or_words_it_still_is_a_report(report):
    from daq.frf import FrequencyResponse

    bare = FrequencyResponse.from_arrays(
        np.linspace(100, 200, 21), None, np.full(21, 0.1), unit="ADSS", phase_known=False
    )
    _, page = report(bare, estimate=None)
    assert "21 points, 100 to 200 Hz" in page.text
    assert page.data["response"]["phase_deg"] == [None] * 21


def test_a_place_that_cannot_be_written_and_an_empty_response_are_refused(tmp_path):
    response = makings.response()
    with pytest.raises(InputError, match="no directory"):
        write_report(tmp_path / "no" / "r.html", response, ADSS, Origin("x"))
    with pytest.raises(AnalysisError, match="no reading"):
        write_report(tmp_path / "r.html", response.take(slice(0, 0)), ADSS, Origin("x"))
    assert list(tmp_path.iterdir()) == []


def test_a_browser_shows_all_of_it_without_complaint_on_two_to_four_pages(
    report, explained, tmp_path
):
    path, page = report(makings.response(notes=makings.NASTY), diagnosis=explained)
    seen = look(path, tmp_path)
    assert seen.complaints == []
    assert 2 <= seen.pages <= 4
    assert seen.text.count("<svg") == seen.text.count("</svg>") == 4
    # Markup in a remark that came to life would have become elements of the page.
    assert Page(seen.text).tags.count("script") == page.tags.count("script") == 1


def test_the_browser_would_have_complained(tmp_path):
    bad = tmp_path / "bad.html"
    bad.write_text("<!DOCTYPE html><script>null.x</script><img src='https://example.org/a.png'>")
    assert look(bad, tmp_path).complaints
