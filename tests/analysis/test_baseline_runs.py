"""How many runs the plain model gets before it is believed that it will do, or left."""

from types import SimpleNamespace

import numpy as np
import pytest

from analysis import baseline_runs, contest

PLAY = ("total-backlash",)


class Fine:
    """A hunt in which more play leads the plain model, which has 40 runs."""

    purse = SimpleNamespace(is_spent=False)

    def __init__(self, lead, leader_runs=160):
        self.found = {
            (): self._standing((), 100.0, 40),
            PLAY: self._standing(PLAY, 100.0 + lead, leader_runs),
        }
        self.heard = 0

    @staticmethod
    def _standing(effects, likelihood, count):
        best = SimpleNamespace(log_likelihood=likelihood)
        return SimpleNamespace(
            hypothesis=SimpleNamespace(effects=effects), best=best, population=range(count)
        )

    @property
    def best(self):
        return max(self.found.values(), key=lambda one: one.best.log_likelihood)

    @property
    def runs(self):
        return len(self.found[()].population)

    def settle(self, keys, groups):
        assert (keys, groups) == ([()], 6)
        self.found[()].population = range(self.runs + 5 * groups)

    def hear(self):
        self.heard += 1


@pytest.mark.parametrize(
    ("lead", "leader_runs", "chance_until", "runs"),
    [
        (178.0, 160, 70, 70),
        (178.0, 160, 400, 160),
        (178.0, 70, 400, 70),
        (178.0, 160, 0, 40),
        (37.0, 160, 400, 40),
    ],
)
def test_it_gets_more_where_few_say_that_the_leader_leads_by_chance(
    monkeypatch, lead, leader_runs, chance_until, runs
):
    """As many as the leader at most; and none where nothing would be named."""

    def may_be_chance(simpler, best, misfit, rng):
        assert (simpler.hypothesis.effects, best.hypothesis.effects) == ((), PLAY)
        assert misfit == 1.1
        return len(simpler.population) < chance_until

    monkeypatch.setattr(
        baseline_runs, "judge_adequacy", lambda one, rng: SimpleNamespace(sigma=1.1)
    )
    monkeypatch.setattr(baseline_runs, "may_be_chance", may_be_chance)
    fine = Fine(lead, leader_runs)
    baseline_runs.weigh_baseline(fine, np.random.default_rng(0))
    assert fine.runs == runs
    assert fine.heard == (runs - 40) // 30


@pytest.mark.parametrize(
    ("lead", "leader_runs", "runs"),
    [(76.0, 160, 160), (75.9, 160, 40), (168.0, 60, 70), (168.0, 40, 40), (-10.0, 160, 40)],
)
def test_it_has_as_many_as_what_leads_it_by_far(lead, leader_runs, runs):
    fine = Fine(lead, leader_runs)
    assert baseline_runs.level_baseline(fine) == (runs > 40)
    assert fine.runs == runs
    assert fine.heard == (runs - 40) // 30


@pytest.mark.parametrize(("will_do_until", "missing"), [(0, True), (70, True), (400, False)])
def test_nothing_is_missing_only_if_as_many_runs_say_so(monkeypatch, will_do_until, missing):
    """More play of an EDSS led by 168, and of thirty runs of the plain model a fifth said that it
    may do so by chance; of sixty fewer did."""
    fine = Fine(168.0, 60)
    monkeypatch.setattr(contest, "is_nothing_missing", lambda one, _: one.runs < will_do_until)
    monkeypatch.setattr(contest, "_is_left", lambda *_: True)
    assert contest.compare(fine, None) == missing
    # Nobody asks for more where something is missing anyway.
    assert fine.runs == (70 if will_do_until else 40)
