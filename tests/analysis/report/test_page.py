"""What kind of page a report is: data and hashes, markup, pictures, what a browser shows."""

import hashlib
import json
import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from outputs import report_makings as makings
from outputs.browser import look
from outputs.report_pages import Page

from analysis.report import file_origin, write_report
from analysis.report.document import Origin
from analysis.report.html import Markup, data_block, element
from daq.errors import AnalysisError, InputError
from sim.unit import unit_from_mapping


def test_machine_readable_copy_and_hashes_are_complete(report, tmp_path):
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
    assert unit_from_mapping(data["unit"]["document"], "copy") == makings.ADSS
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


def test_nothing_is_fetched_and_identifiers_are_unique(report, explained):
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


def test_every_picture_has_label_and_valid_xml(report):
    path, _ = report()
    pictures = re.findall(r"<svg.*?</svg>", path.read_text(encoding="utf-8"), re.DOTALL)
    assert len(pictures) == 2
    for picture in pictures:
        root = ET.fromstring(picture)
        assert root.get("role") == "img"
        assert root.get("aria-label")
        assert len(root.findall(".//{http://www.w3.org/2000/svg}path")) > 10


def test_operator_text_is_not_markup(report):
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


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.text(), st.text())
def test_markup_cannot_be_broken(text, other):
    whole = element("p", text, element("b", other), class_=text) + data_block({text: other}, "d")
    page = Page(whole)
    assert page.tags == ["p", "b", "script"]
    assert json.loads(page.blocks["d"]) == {text: other}


def test_markup_is_escaped_and_nan_is_refused():
    assert element("p", Markup("<i>"), "<i>") == "<p><i>&lt;i&gt;</p>"
    with pytest.raises(ValueError, match="JSON"):
        data_block({"a": float("nan")}, "d")


def test_invisible_characters_are_shown_as_escapes(report):
    _, page = report(makings.response(serial="SN\u202e4\x1b[2J", notes="zero\u200bwidth"))
    assert "SN\\u202e4\\x1b[2J" in page.text
    assert "zero\\u200bwidth" in page.text
    assert not {"\u202e", "\x1b", "\u200b"} & set(page.text)
    assert page.data["measurement"]["serial"] == "SN\u202e4\x1b[2J"


def test_long_remark_does_not_fill_pages(report):
    _, page = report(makings.response(notes="word " * 5000))
    assert "the rest is in the data" in page.text
    assert page.data["measurement"]["notes"] == "word " * 5000


def test_report_needs_no_phase_errors_or_levels(report):
    from daq.frf import FrequencyResponse

    bare = FrequencyResponse.from_arrays(
        np.linspace(100, 200, 21), None, np.full(21, 0.1), unit="ADSS", phase_known=False
    )
    _, page = report(bare, estimate=None)
    assert "21 points, 100 to 200 Hz" in page.text
    assert page.data["response"]["phase_deg"] == [None] * 21


def test_unwritable_place_and_empty_response_are_refused(tmp_path):
    response = makings.response()
    with pytest.raises(InputError, match="no directory"):
        write_report(tmp_path / "no" / "r.html", response, makings.ADSS, Origin("x"))
    with pytest.raises(AnalysisError, match="no reading"):
        write_report(tmp_path / "r.html", response.take(slice(0, 0)), makings.ADSS, Origin("x"))
    assert list(tmp_path.iterdir()) == []


def test_browser_shows_report_on_few_pages(report, explained, tmp_path):
    """On two to four pages, without a complaint of the browser."""
    path, page = report(makings.response(notes=makings.NASTY), diagnosis=explained)
    seen = look(path, tmp_path)
    assert seen.complaints == []
    assert 2 <= seen.pages <= 4
    assert seen.text.count("<svg") == seen.text.count("</svg>") == 4
    # Markup in a remark that came to life would have become elements of the page.
    assert Page(seen.text).tags.count("script") == page.tags.count("script") == 1


def test_browser_check_finds_faulty_page(tmp_path):
    bad = tmp_path / "bad.html"
    bad.write_text("<!DOCTYPE html><script>null.x</script><img src='https://example.org/a.png'>")
    assert look(bad, tmp_path).complaints
