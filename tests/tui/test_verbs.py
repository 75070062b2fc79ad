"""The verbs end to end: the documents that scripts rely on, and the tables for people."""

import functools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from daq.errors import AnalysisError
from daq.formats import read_response, write_response
from tui.cli import main
from tui.computations import Computations

PRACTICE = Path(__file__).parents[1] / "data" / "practice"
SWEEP = str(PRACTICE / "practice-09.csv")


def document(words, capsys, compute=None):
    """Run a verb with --json and return its one document; narration may only go to stderr."""
    assert main([*words, "--json"], compute) == 0
    out = capsys.readouterr().out

    def refuse(constant):
        raise AssertionError(f"{constant} is no JSON")

    return json.loads(out, parse_constant=refuse)


def text(words, capsys, compute=None):
    assert main(words, compute) == 0
    return capsys.readouterr().out


def test_extract_gives_levels_with_agreed_fields(capsys):
    levels = document(["extract", SWEEP], capsys)["levels"]
    assert [level["source_vpk"] for level in levels] == [1.5, 2.5, 4.0]
    for level in levels:
        assert set(level) >= {"source_vpk", "arf", "rf", "difference_hz", "damping_ratio", "flags"}
        assert set(level["arf"]) >= {"frequency_hz", "std_hz", "gain_db"}
        assert set(level["difference_hz"]) >= {"value", "std"}
        assert set(level["damping_ratio"]) >= {"arf", "rf"}
        assert 120 < level["arf"]["frequency_hz"] < level["rf"]["frequency_hz"] < 160


def test_extract_gives_null_with_reason(tmp_path, capsys):
    lines = Path(SWEEP).read_text().splitlines(keepends=True)
    cut = tmp_path / "cut.csv"
    cut.write_text("".join(lines[:15]))
    (level,) = document(["extract", str(cut)], capsys)["levels"]
    assert level["arf"] is None
    assert level["rf"] is None
    assert level["flags"]
    assert text(["extract", str(cut)], capsys).strip()


def test_extract_prints_a_table(capsys):
    table = text(["extract", SWEEP], capsys)
    assert "ARF" in table
    assert "RF" in table
    assert all(len(line) <= 120 for line in table.splitlines())


FIELDS = {"contribution_ratio", "b1_deg", "b2_deg", "b_t_deg", "error_index", "warnings"}


def check_estimate(result):
    assert set(result) >= FIELDS
    ratio = result["contribution_ratio"]
    low, high = ratio["interval95"]
    assert 0 <= low <= ratio["value"] <= high <= 1
    assert ratio["std"] > 0
    index = result["error_index"]
    assert len(index["ratio"]) == len(index["hz"]) == len(index["std_hz"]) > 2
    assert index["ratio"][0] <= index["minimum_ratio"] <= index["ratio"][-1]
    for name in ("b1_deg", "b2_deg", "b_t_deg"):
        assert set(result[name]) >= {"value", "std"}


@pytest.mark.long
def test_estimate_has_agreed_fields(capsys):
    """For the paper's ADSS, it tells what the microscope saw."""
    words = ["estimate", "--unit", "adss", "--arf-hz", "128", "--rf-hz", "137"]
    found = document(words, capsys)
    check_estimate(found)
    low, high = found["contribution_ratio"]["interval95"]
    assert low < 0.23 < high
    assert high - low < 0.5
    assert min(found["error_index"]["hz"]) < 10.0
    assert not found["warnings"]


class Calls(list):
    """What was asked of computations that take no time."""

    compute = None


@pytest.fixture
def calls():
    """Estimates at once, without a simulation; the calls are kept."""
    from analysis import estimate
    from analysis.estimate.from_features import IndexCurve

    made = Calls()

    def known(*words, progress=None, **options):
        made.append((words, options))
        ratios = np.linspace(0, 1, 5)
        uncertain = estimate.Uncertain(0.5, 0.1, (0.3, 0.7))
        curve = IndexCurve(ratios, 10 * ratios, np.full(5, np.nan))
        rest = (uncertain, uncertain, estimate.Uncertain(0.066, 0.0), curve, ("a warning",), 1.0)
        progress(0.5, "half")
        return estimate.Estimate("ADSS", uncertain, *rest)

    made.compute = Computations(estimate_response=known, estimate_features=known)
    return made


def test_estimate_hands_the_whole_response_on(calls, capsys):
    result = document(["estimate", SWEEP, "--unit", "adss"], capsys, calls.compute)
    check_estimate(result)
    assert result["error_index"]["std_hz"] == [None] * 5
    (((response, unit, unknown), options),) = calls
    assert (len(response), unit.name, unknown) == (183, "ADSS", False)
    assert options["cache"].name == "lashbench"
    assert options["executor"] is None


def test_estimate_hands_several_responses_on_together(calls, capsys, tmp_path):
    other = tmp_path / "other.csv"
    other.write_text(Path(SWEEP).read_text().replace('unit = "ADSS"', 'unit = "OTHER"'))
    result = document(["estimate", SWEEP, str(other), "--unit", "adss"], capsys, calls.compute)
    (((response, _, _), options),) = calls
    assert response.unit == "ADSS"
    assert [one.unit for one in options["further"]] == ["OTHER"]
    assert result["warnings"] == ["the response is of unit OTHER, not of ADSS", "a warning"]


def test_estimate_states_that_total_is_unknown(calls, capsys):
    document(
        ["estimate", SWEEP, "--unit", "adss", "--total-backlash-unknown"], capsys, calls.compute
    )
    assert calls[0][0][2] is True


def test_estimate_hands_two_frequencies_on(calls, capsys):
    document(
        ["estimate", "--unit", "edss", "--arf-hz", "40", "--rf-hz", "75.5"], capsys, calls.compute
    )
    arf, rf, unit = calls[0][0]
    assert (arf, rf, unit.name) == (40.0, 75.5, "EDSS")


def test_estimate_warns_of_another_units_response(calls, capsys, tmp_path):
    few = str(tmp_path / "few.csv")
    write_response(read_response(Path(SWEEP)).take(np.arange(0, 183, 30)), few)
    result = document(["estimate", few, "--unit", "edss"], capsys, calls.compute)
    assert result["warnings"] == ["the response is of unit ADSS, not of EDSS", "a warning"]
    assert "of unit ADSS" in text(["estimate", few, "--unit", "edss"], capsys, calls.compute)


@pytest.mark.long
def test_reproduce_has_agreed_fields(capsys, tmp_path):
    from analysis.paper import reproduce

    # One row of Table 2 with few runs: the verb is under test, not the numbers.
    short = functools.partial(reproduce, paper_runs=2, exact_runs=2, rows=[("ADSS", 50)])
    words = ["reproduce", "--plots", str(tmp_path / "plots")]
    result = document(words, capsys, Computations(reproduce=short))
    assert set(result) >= {"table2", "error_index", "damping", "elapsed_s"}
    row = result["table2"][0]
    assert (row["unit"], row["ratio_percent"]) == ("ADSS", 50)
    wanted = {"published_hz", "value_hz", "std_hz", "exact_hz"}
    wanted |= {"published_db", "value_db", "exact_db"}
    for feature in ("arf", "rf"):
        assert set(row[feature]) >= wanted
    assert set(result["error_index"]["ADSS"]) >= {"minimum_ratio_percent", "minimum_hz"}
    pictures = list((tmp_path / "plots").glob("*.png"))
    assert pictures
    assert all(picture.read_bytes().startswith(b"\x89PNG") for picture in pictures)


@pytest.fixture
def cluster():
    """A cluster that does nothing but know where it is, and whether it was left."""

    class Cluster:
        """Knows whether it was closed."""

        left = False

        def __init__(self, address):
            self.address = address

        def __enter__(self):
            return self

        def __exit__(self, *error):
            Cluster.left = True

    return Cluster


def test_estimate_simulates_where_the_cluster_is(calls, capsys, cluster):
    compute = replace(calls.compute, cluster=cluster)
    words = ["estimate", SWEEP, "--unit", "adss", "--cluster", "tcp://here:8786"]
    document(words, capsys, compute)
    assert calls[0][1]["executor"].address == "tcp://here:8786"
    assert cluster.left


def test_diagnose_simulates_where_the_cluster_is(capsys, cluster):
    asked = []

    def known(response, unit, **options):
        asked.append(options)
        raise AnalysisError("no answer")

    compute = Computations(diagnose_response=known, cluster=cluster)
    words = ["diagnose", SWEEP, "--unit", "adss", "--cluster", "tcp://here:8786"]
    assert main(words, compute) == 1
    assert "no answer" in capsys.readouterr().err
    assert asked[0]["executor"].address == "tcp://here:8786"
    assert cluster.left


def test_cluster_option_is_refused_for_paper(capsys):
    assert main(["diagnose", "--paper", "--unit", "adss", "--cluster", "x"]) == 2
    assert "--cluster" in capsys.readouterr().err


def test_cluster_option_is_refused_for_frequencies(capsys):
    words = ["estimate", "--unit", "adss", "--arf-hz", "128", "--rf-hz", "137", "--cluster", "x"]
    assert main(words) == 2
    assert "--cluster" in capsys.readouterr().err
