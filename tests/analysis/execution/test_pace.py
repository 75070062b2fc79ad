"""How long a job still takes, and how that is said."""

import pytest

from analysis.execution.pace import Pace, duration


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


def test_steady_job_estimate_ignores_initial_share(clock):
    clock.now = 50.0
    pace = Pace(clock)
    clock.now = 100.0
    assert pace.remaining_s(0.1) is None
    clock.now = 110.0
    assert pace.remaining_s(0.3) == pytest.approx(35.0)
    clock.now = 120.0
    assert pace.remaining_s(0.5) == pytest.approx(25.0)
    assert pace.remaining_s(1.0) is None


def test_little_progress_gives_no_estimate(clock):
    pace = Pace(clock)
    pace.remaining_s(0.0)
    clock.now = 1.0
    assert pace.remaining_s(0.5) is None
    clock.now = 60.0
    pace.remaining_s(0.0)
    clock.now = 90.0
    assert pace.remaining_s(0.01) is None


def test_a_smaller_share_begins_another_job(clock):
    pace = Pace(clock)
    pace.remaining_s(0.0)
    clock.now = 100.0
    pace.remaining_s(1.0)
    assert pace.remaining_s(0.0) is None
    clock.now = 104.0
    assert pace.remaining_s(0.5) == pytest.approx(4.0)


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.4, "0 s"),
        (89.0, "89 s"),
        (92.0, "1 min 30 s"),
        (119.0, "2 min 00 s"),
        (700.0, "12 min"),
        (5400.0, "1 h 30 min"),
        (7199.0, "2 h 00 min"),
    ],
)
def test_durations_in_words(seconds, words):
    assert duration(seconds) == words
