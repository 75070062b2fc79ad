"""What is believed of a datasheet, in words."""

from analysis.ensemble.datasheet_belief import believed_document, believed_lines
from sim.unit import load_unit

ADSS = load_unit("adss")


def lines(**shares):
    return believed_lines(believed_document(ADSS.with_tolerance(shares)))


def test_few_tolerances_are_listed_by_name():
    assert lines(default=0.05, R_m=0.01) == [
        "datasheet believed to 1 %: R_m (by --tolerance)",
        "datasheet believed to 5 %: all other values (by --tolerance)",
    ]


def test_many_tolerances_are_given_as_range():
    """As those of a commissioned drive are: each value has its own."""
    many = {"R_m": 0.01, "k_t": 0.02, "k_a": 0.03, "k_s1": 0.04, "J_L": 0.05, "J_m": 0.06}
    told = lines(**many)
    assert "datasheet believed to 1 % (R_m) to 6 % (J_m), 6 values (by --tolerance)" in told
    assert len(told) == 2
