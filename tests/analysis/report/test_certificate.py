"""A report as a certificate: number, calibration, limits, approval, logo, readings, PDF."""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from datetime import date

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from outputs import report_makings as makings
from outputs.browser import look

from analysis.acceptance import LimitSet, judge
from analysis.report.certificate import Certificate
from analysis.report.document import Origin
from analysis.report.history_index import reports_in, write_index
from analysis.report.logo import logo_address
from analysis.report.pdf import print_pdf
from daq.errors import ConfigurationError
from daq.frf import PointFlag
from sim.acceptance import Acceptance

PNG = b"\x89PNG\r\n\x1a\n" + b"0" * 20
SVG = "{http://www.w3.org/2000/svg}"
FULL = Certificate(
    number="C-7/2026",
    organisation="Gear Lab",
    calibrated=date(2025, 3, 1),
    calibration_due=date(2026, 3, 1),
    calibration_certificate="4711",
    environment={"temperature": "22.5 degC"},
    approver="Q. Manager",
)


def judged(upper):
    table = Acceptance.model_validate({"b1_deg": {"upper": upper}})
    return judge(LimitSet("outgoing", table), estimate=makings.ESTIMATE)


def test_certificate_and_its_document_are_complete(report):
    path, page = report(certificate=FULL, judgement=judged(0.4))
    for words in ("C-7/2026", "Gear Lab", "2025-03-01, due 2026-03-01, certificate 4711",
                  "22.5 degC", "Q. Manager", "A. B.", "Decision rule: ISO 14253-1"):  # fmt: skip
        assert words in page.text
    assert "OVERDUE" not in page.text
    assert page.data["certificate"]["environment"] == {"temperature": "22.5 degC"}
    assert page.data["judgement"]["verdict"] == "PASS"
    assert "PASS by limits outgoing." in page.text
    assert "counter(pages)" in path.read_text(encoding="utf-8")


def test_unit_out_of_limits_is_stated_first(report):
    _, page = report(judgement=judged(0.1))
    assert page.text.index("FAIL by limits outgoing; out of limits: b1.") < 160
    assert "No limits are set" not in page.text


def test_overdue_calibration_is_marked(report):
    late = Certificate(calibrated=date(2024, 1, 1), calibration_due=date(2025, 12, 31))
    _, page = report(certificate=late)
    assert "it was OVERDUE when this was measured" in page.text
    assert page.data["certificate"]["calibration_overdue"] is True


def test_default_number_depends_on_date_and_data(report):
    numbers = {report(**words)[1].data["certificate"]["number"]
               for words in ({}, {}, {"response": makings.response(serial="SN 8")})}  # fmt: skip
    assert len(numbers) == 1
    other = makings.response()
    other.gain[3] *= 1.001
    assert report(other)[1].data["certificate"]["number"] not in numbers


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.text(st.characters(codec="utf-8"), min_size=1, max_size=20))
def test_number_cannot_leave_the_style_sheet(text):
    from analysis.report.certificate import page_style

    style = page_style({"certificate": {"number": text}})
    assert style.count("}") == 3
    assert "<" not in style
    assert style.count('"') == 2 + 4


def test_only_a_logo_is_embedded(report, tmp_path):
    file = tmp_path / "logo.png"
    file.write_bytes(PNG)
    path, page = report(certificate=Certificate(logo=logo_address(file)))
    sources = [value for tag, name, value in page.attributes if name == "src"]
    assert [source[:22] for source in sources] == ["data:image/png;base64,"]
    assert "img-src data:" in path.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [("l.gif", b"GIF89a", "a logo is a .png"), ("l.png", b"<svg/>", "is no PNG picture"),
     ("l.svg", b"\x89PNG", "is no SVG picture"), ("l.png", None, "cannot be read"),
     ("l.png", PNG + b"0" * (1 << 20), "up to 1 MiB")],
)  # fmt: skip
def test_invalid_logo_is_refused(tmp_path, name, content, words):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigurationError, match=words):
        logo_address(path)


def test_tooltip_of_reading_lies_at_its_mark(report):
    path, _ = report()
    picture = re.search(r"<svg.*?</svg>", path.read_text(encoding="utf-8"), re.DOTALL)[0]
    root = ET.fromstring(picture)
    marks = {(round(float(use.get("x"))), round(float(use.get("y"))))
             for use in root.iter(f"{SVG}use") if use.get("x")}  # fmt: skip
    spots = list(root.iter(f"{SVG}circle"))
    assert len(spots) == 2 * len(makings.response())
    near = {(x + i, y + j) for x, y in marks for i in (-1, 0, 1) for j in (-1, 0, 1)}
    places = {(round(float(spot.get("cx"))), round(float(spot.get("cy")))) for spot in spots}
    assert places <= near
    titles = [spot.find(f"{SVG}title").text for spot in spots]
    assert re.fullmatch(r"100 Hz, 1.5 V: -\d+\.\d+ ± 0\.050 dB", titles[0])


def test_spoilt_reading_is_marked_without_phase(report):
    whole = makings.response()
    flags = whole.flags.copy()
    flags[3] = PointFlag.SPOILT
    path, _ = report(response=replace(whole, flags=flags))
    picture = re.search(r"<svg.*?</svg>", path.read_text(encoding="utf-8"), re.DOTALL)[0]
    titles = [one.find(f"{SVG}title").text for one in ET.fromstring(picture).iter(f"{SVG}circle")]
    place = f"{whole.frequency_hz[3]:.6g} Hz, {whole.source_vpk[3]:g} V: "
    (told,) = [text for text in titles if text.startswith(place)]
    assert re.fullmatch(r"spoilt, -\d+\.\d+ dB", told.removeprefix(place))
    assert sum("spoilt" in text for text in titles) == 1


def test_browser_prints_page_numbers(report, tmp_path):
    path, _ = report(certificate=FULL, judgement=judged(0.4))
    seen = look(path, tmp_path)
    assert seen.complaints == []
    out = tmp_path / "certificate.pdf"
    print_pdf(path, out)
    assert out.read_bytes().startswith(b"%PDF-")
    assert 2 <= seen.pages <= 4


def test_index_links_reports_of_its_history(report, tmp_path):
    path, _ = report(origin=Origin("measurement 3 of lab.db", facts={"measurement": 3}))
    (tmp_path / "other.html").write_text("<p>no report</p>")
    begun = {3: makings.response().provenance["started"], 4: "2026-01-02T03:04:06+00:00"}
    links = reports_in(tmp_path, "lab.db", begun, tmp_path)
    assert links == {3: path.name}
    assert reports_in(tmp_path, "other.db", begun, tmp_path) == {}
    # Measurement 3 of another bench, whose history has the same name.
    assert reports_in(tmp_path, "lab.db", begun | {3: "2025-01-01T00:00:00+00:00"}, tmp_path) == {}
    assert reports_in(tmp_path, "lab.db", {4: begun[4]}, tmp_path) == {}
    row = {"id": 3, "started": "2026-01-02T03:04:05", "unit": makings.NASTY, "serial": "<b>",
           "simulated": False, "state": "complete", "points": 5, "planned": 5,
           "contribution_ratio": {"value": 0.3, "std": 0.02},
           "b1_deg": None, "b2_deg": None}  # fmt: skip
    page = tmp_path / "index.html"
    write_index(page, "lab.db", [row, row | {"id": 4}], links, 9)
    text = page.read_text(encoding="utf-8")
    assert text.count(f'<a href="{path.name}">') == 1
    assert "The last 2 of 9" in text
    assert text.index(">4<") < text.index(">3<")
    assert "<script" not in text
