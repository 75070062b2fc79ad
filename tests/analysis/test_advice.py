"""What an estimate means for whoever adjusts the gears."""

import pytest

from analysis.advice import limit_lines, stage_to_adjust
from sim.unit import load_unit, unit_from_mapping


def document(value, interval=None, std=0.05, b1=0.2, b2=0.04):
    ratio = {"value": value, "std": std} | ({"interval95": list(interval)} if interval else {})
    return {
        "contribution_ratio": ratio,
        "b1_deg": {"value": b1, "std": 0.01},
        "b2_deg": {"value": b2, "std": 0.004},
    }


@pytest.mark.parametrize(
    ("value", "interval", "said"),
    [
        (0.8, (0.6, 0.9), "Adjust stage 1 first: 80 %"),
        (0.2, (0.1, 0.4), "Adjust stage 2 first: 20 %"),
        (0.6, (0.45, 0.75), "Neither stage stands out"),
        (0.4, (0.2, 0.5), "Neither stage stands out"),
        (0.62, None, "Adjust stage 1 first"),
        (0.58, None, "Neither stage stands out"),
    ],
)
def test_a_stage_is_named_only_where_the_whole_interval_is_on_its_side(value, interval, said):
    assert stage_to_adjust(document(value, interval)).startswith(said)


def test_without_limits_the_greatest_value_there_can_be_is_named():
    unit = load_unit("adss")
    lines = limit_lines(document(0.3), unit)
    assert lines[0].endswith("no limit set, all of it would be 0.6930 deg")
    assert lines[1].endswith("no limit set, all of it would be 0.0660 deg")


@pytest.mark.parametrize(
    ("b1", "verdict"),
    [(0.17, "WITHIN"), (0.18, "WITHIN"), (0.19, "NOT DECIDED"), (0.215, "NOT DECIDED"),
     (0.23, "ABOVE")],
)  # fmt: skip
def test_a_limit_is_passed_only_beyond_two_standard_errors(b1, verdict):
    content = load_unit("adss").model_dump(by_alias=True)
    content["limits"] |= {"b1_deg": 0.2, "b2_deg": 0.066}
    unit = unit_from_mapping(content, "test")
    first, second = limit_lines(document(0.3, b1=b1), unit)
    assert f"limit 0.2000 deg: {verdict}" in first
    assert "WITHIN" in second
