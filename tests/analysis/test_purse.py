"""What may be spent on a measurement, and what is not held against it."""

from analysis.purse import Purse
from sim.effort import counting, spend


def test_what_is_simulated_aside_is_not_held_against_the_purse():
    with counting() as outer, counting() as effort:
        purse = Purse(effort, granted_s=100.0)
        spend(60.0)
        with purse.aside():
            spend(500.0, 700.0)
        assert not purse.has_spent(0.6)
        assert effort.simulated_s == effort.worth_s == 60.0
        spend(41.0)
        assert purse.is_spent
    # It was simulated all the same.
    assert (outer.simulated_s, outer.worth_s) == (601.0, 801.0)
