"""Work between simulations on several cores: all of it, in order, and nothing after an error."""

import os
from threading import Barrier, active_count, current_thread, main_thread
from time import sleep

import numpy as np
import pytest
from worlds.synthetic import candidate, observation, read

from analysis.checking.cross_validation import hold_out
from analysis.checking.goodness_of_fit import judge_adequacy, judge_chance
from analysis.execution.executor import side_by_side


@pytest.fixture
def cores(monkeypatch):
    """Have the system grant this process so many cores."""

    def grant(count):
        granted = set(range(count))
        monkeypatch.setattr(os, "sched_getaffinity", lambda _: granted, raising=False)

    return grant


@pytest.fixture
def two_cores(cores):
    cores(2)


def test_two_tasks_run_at_once_in_order(two_cores):
    both = Barrier(2, timeout=20.0)

    def work(number):
        # Neither gets past this alone.
        both.wait()
        return 10 * number

    assert side_by_side(work, iter(range(6))) == [0, 10, 20, 30, 40, 50]


def test_one_piece_of_work_is_done_here(two_cores):
    assert side_by_side(lambda _: current_thread(), [1]) == [main_thread()]
    assert side_by_side(lambda _: pytest.fail("asked"), []) == []


def test_one_core_works_in_this_thread(cores):
    cores(1)
    assert side_by_side(lambda _: current_thread(), [1, 2]) == [main_thread()] * 2


def test_error_drops_tasks_not_yet_started(two_cores):
    begun = []

    def work(number):
        begun.append(number)
        if number == 0:
            raise ZeroDivisionError(number)
        # All of it would take seconds: enough for the error to be heard long before.
        sleep(0.01)

    with pytest.raises(ZeroDivisionError):
        side_by_side(work, range(500))
    assert len(begun) < 500


def test_tasks_may_be_nested(two_cores):
    def work(number):
        return sum(side_by_side(lambda other: number * other, range(4)))

    assert side_by_side(work, range(5)) == [0, 6, 12, 18, 24]


def test_interpreter_bound_tasks_use_few_cores(cores):
    cores(64)
    others = active_count()

    def work(_):
        sleep(0.005)
        return active_count() - others

    assert 1 < max(side_by_side(work, range(40))) <= 4


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.long) for n in (1, 2))])
def test_judgement_does_not_depend_on_cores(cores, seed):
    """To the last bit: all that is drawn is drawn before the work is shared out."""
    cause = ("load-inertia",)
    seen = observation(read(cause, np.array([0.55, 0.4]), np.random.default_rng(seed)))
    found = []
    for count in (1, 2, 3):
        cores(count)
        one, plain = candidate(seen, cause, seed), candidate(seen, (), seed)
        held_out = hold_out(one, seen)
        found.append(
            (
                one.best.log_likelihood,
                judge_adequacy(one, np.random.default_rng(seed)),
                judge_chance(plain, one, np.random.default_rng(seed)),
                held_out.score,
                held_out.residual.tolist(),
            )
        )
    assert found[0] == found[1] == found[2]
