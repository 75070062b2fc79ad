"""Reports, written and read back as pages, and a diagnosis to report on."""

from datetime import UTC, datetime

import pytest
from outputs import report_makings as makings
from outputs.report_pages import Page

from analysis.report import write_report
from analysis.report.document import Origin

MADE = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
CAUSES = [("load-inertia",), ("shaft-stiffness",), ("load-inertia", "motor-resistance")]


@pytest.fixture
def report(tmp_path):
    def make(response=None, unit=makings.ADSS, **parts):
        path = tmp_path / "report.html"
        parts = {"origin": Origin("x.csv"), "estimate": makings.ESTIMATE, "made": MADE} | parts
        assert write_report(path, response or makings.response(), unit, **parts) == path
        return path, Page(path.read_text(encoding="utf-8"))

    return make


@pytest.fixture(scope="module")
def explained():
    with pytest.MonkeyPatch.context() as patch:
        return makings.diagnosis(patch, ("load-inertia",), CAUSES)
