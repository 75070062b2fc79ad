"""Every fault that the simulated analyser has, provoked again and held against docs/faults.md."""

import re
from pathlib import Path

import pytest
from fault_table import (
    CATALOGUE,
    OWN,
    every_job,
    ordered,
    provoke_again,
    provoke_all,
    rows,
    short_timing,
    written_outcomes,
    written_rows,
)

ROOT = Path(__file__).parents[2]

BY_ADAPTER = ("missing-eoi", "adapter-reset", "link-away", "silence")
"""Faults whose outcome an adapter may change; each is provoked on raw TCP every day."""
DAILY = [job for job in every_job(CATALOGUE) if job[1] == "tcp" or job[0] in BY_ADAPTER]
REST = [job for job in every_job(CATALOGUE) if job not in DAILY]


@pytest.fixture(scope="module", params=[DAILY, pytest.param(REST, marks=pytest.mark.long)],
                ids=["daily", "rest"])  # fmt: skip
def outcomes(request, tmp_path_factory):
    patch = pytest.MonkeyPatch()
    patch.setattr("daq.hp35670a.analyser.Timing", short_timing)
    patch.setattr("daq.hp35670a.safe._BUDGET_S", 4.0)
    faults = {name: ordered(name) for name in CATALOGUE}
    # Well under what an answer may take here: a busy machine adds to it.
    faults["slow-reply"] += ",seconds=0.3"
    try:
        made = provoke_all(tmp_path_factory.mktemp("faults"), faults, request.param)
        return provoke_again(made, tmp_path_factory.mktemp("alone"), faults)
    finally:
        patch.undo()


@pytest.mark.long
def test_page_lists_outcomes_of_an_sr785(tmp_path_factory):
    faults = {name: ordered(name) for name in OWN}
    jobs = every_job(OWN, "sr785")
    made = provoke_all(tmp_path_factory.mktemp("faults"), faults, jobs, "sr785")
    made = provoke_again(made, tmp_path_factory.mktemp("alone"), faults, "sr785")
    assert rows(made, "sr785") == written_rows("sr785")
    assert {outcome.source for outcome in made.values()} == {"confirmed-off"}


@pytest.mark.slow
def test_every_outcome_is_a_documented_one(outcomes):
    """In the table of the page. One test: its outcomes take long."""
    assert rows(written_outcomes() | outcomes) == written_rows()
    for (name, wire), outcome in outcomes.items():
        assert outcome.code in (0, 1, 3, 4), (name, wire)
        assert (outcome.code == 0) == (outcome.state == "complete"), (name, wire)
        assert (outcome.code == 0) == (outcome.said == ""), (name, wire)
        # Only an instrument that says nothing any more leaves the source unproven.
        assert (outcome.source == "confirmed-off") == (name != "silence"), (name, wire)
        assert outcome.elapsed_s < 50.0, (name, wire)


@pytest.mark.parametrize("name", ["faults.md", "reliability.md"])
def test_tests_named_on_page_exist(name):
    page = (ROOT / "docs" / name).read_text()
    sources = "".join(path.read_text() for path in (ROOT / "tests").rglob("test_*.py"))
    named = set(re.findall(r"`(test_\w+)`", page))
    assert len(named) > 15
    for test in named:
        assert f"def {test}(" in sources, test
