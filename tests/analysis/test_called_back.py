"""Who led on few rows, and got few runs on all, is called back where a leader would be refused."""

from types import SimpleNamespace

import numpy as np
import pytest
import synthetic

from analysis import contest
from analysis.causes import Hypothesis

LEADER, FIRST = ("load-inertia", "payload-flexibility"), ("cable-stiffness", "payload-flexibility")
GONE, FAR = ("motor-constant",), ("load-viscous-damping", "payload-flexibility")


class Standing:
    """A hunt on all rows, in which `FIRST` takes the lead once it has runs enough."""

    observation = None
    half_spent = True

    def __init__(self, runs, leads_with=np.inf, spent_after=np.inf):
        self.runs = {LEADER: 200, FIRST: runs, (): 20}
        self.leads_with, self.spent_after = leads_with, spent_after
        self.settled, self.done, self.near = [], [], set(self.runs)

    @property
    def found(self):
        return {
            key: SimpleNamespace(
                population=range(count), hypothesis=Hypothesis(synthetic.ADSS, key)
            )
            for key, count in self.runs.items()
        }

    def leading(self, most, behind):
        return [key for key in self.found if key in self.near]

    @property
    def best(self):
        first = FIRST if self.runs[FIRST] >= self.leads_with else LEADER
        return SimpleNamespace(hypothesis=Hypothesis(synthetic.ADSS, first))

    @property
    def purse(self):
        def has_spent(share):
            assert share == 0.5
            return self.half_spent

        return SimpleNamespace(is_spent=len(self.settled) >= self.spent_after, has_spent=has_spent)

    def settle(self, chosen, groups):
        self.settled.append(list(chosen))
        for key in chosen:
            self.runs[key] += 5 * groups

    def hear(self):
        self.done.append("hear")


@pytest.fixture
def called(monkeypatch):
    """Call back in a hunt, given who led on few rows, and whether the leader would be refused."""

    def call(fine, led, refused=True):
        def predict(_):
            fine.done.append("predict")

        def asked(_, rng):
            rng.random()
            return refused

        monkeypatch.setattr(contest, "is_refused_now", asked)
        monkeypatch.setattr(contest, "compare", lambda *_: fine.done.append("compare"))
        monkeypatch.setattr(contest, "see_it_predict", predict)
        rough = SimpleNamespace(
            found=dict.fromkeys(led),
            leading=lambda most, behind=np.inf: [key for key in led if behind > 100 or key != FAR],
        )
        rng = np.random.default_rng(1)
        contest.call_back(rough, fine, rng)
        # What comes after it has the chance that it had.
        assert rng.random() == np.random.default_rng(1).random()
        return fine

    return call


@pytest.mark.parametrize(
    ("runs", "others", "spent_after", "rounds"),
    [
        # As many as the leader has, or nine rounds, or what is left to spend.
        (170, 200, np.inf, 1), (110, 200, np.inf, 3), (0, 200, np.inf, 7), (0, 320, np.inf, 9),
        (110, 200, 2, 2), (110, 200, 0, 0), (200, 200, np.inf, 0),
    ],
)  # fmt: skip
def test_who_led_on_few_rows_gets_runs_where_the_leader_would_be_refused(
    called, runs, others, spent_after, rounds
):
    fine = Standing(runs, spent_after=spent_after)
    fine.runs[LEADER] = others
    called(fine, [FIRST])
    assert fine.settled == [[FIRST]] * rounds
    # It does not lead, and all others stand as they stood.
    assert not fine.done


@pytest.mark.parametrize(("leads_with", "led"), [(150, True), (230, False)])
def test_who_leads_then_is_compared_with_the_others(called, leads_with, led):
    fine = called(Standing(30, leads_with), [FIRST, LEADER])
    assert fine.settled == [[FIRST]] * 6
    assert fine.done == (["hear", "compare", "predict"] if led else [])


@pytest.mark.parametrize(
    ("led", "refused", "rounds"),
    [
        ([FIRST, LEADER], True, 6), ([FIRST, LEADER], False, 0), ([LEADER, FIRST], True, 0),
        # Who was not looked at on all rows is not; nor is the plain model an explanation.
        ([GONE, FIRST, LEADER], True, 6), ([GONE, LEADER, FIRST], True, 0), ([(), FIRST], True, 0),
        ([GONE], True, 0), ([], True, 0),
    ],
)  # fmt: skip
def test_none_but_who_led_on_few_rows_is_called_back(called, led, refused, rounds):
    assert called(Standing(30), led, refused).settled == [[FIRST]] * rounds


def runner_up(runs=30, **given):
    fine = Standing(runs, **given)
    fine.half_spent = False
    return fine


@pytest.mark.parametrize("refused", [True, False])
def test_who_came_next_to_several_causes_on_few_rows_gets_all_runs_that_any_gets(called, refused):
    """However many the leader has, and whether it would be refused or not."""
    fine = runner_up()
    fine.runs[LEADER] = 60
    called(fine, [LEADER, FIRST], refused)
    assert fine.settled[:9] == [[FIRST]] * 9
    # More runs fit better, so the leader gets as many, while it is not left far behind.
    assert fine.settled[9:] == [[LEADER]] * 8
    assert fine.runs == {LEADER: 300, FIRST: 300, (): 20}
    assert not fine.done


def test_a_leader_that_is_left_far_behind_gets_no_more(called):
    fine = runner_up(leads_with=150)
    fine.near = {FIRST}
    called(fine, [LEADER, FIRST])
    assert fine.settled == [[FIRST]] * 9
    assert fine.done == ["hear", "compare", "predict"]


@pytest.mark.parametrize(
    ("led", "half_spent"),
    [
        # Too little is left, ...
        ([LEADER, FIRST], True),
        # ... nobody came near, or nobody with many sizes, or nobody that was looked at on all rows.
        ([LEADER, FAR], False), ([LEADER], False), ([LEADER, ("cable-stiffness",)], False),
        ([LEADER, ("load-viscous-damping", "mesh1-stiffness", "payload-flexibility")], False),
    ],
)  # fmt: skip
def test_nobody_else_is_called_back_from_behind_several_causes(called, led, half_spent):
    fine = runner_up()
    fine.half_spent = half_spent
    fine.runs |= {FAR: 30, ("cable-stiffness",): 30}
    assert called(fine, led).settled == []


def test_nobody_is_called_back_from_behind_a_single_cause(called, monkeypatch):
    monkeypatch.setattr(
        Standing, "best", SimpleNamespace(hypothesis=Hypothesis(synthetic.ADSS, GONE))
    )
    fine = runner_up()
    fine.runs[GONE] = 200
    assert called(fine, [GONE, FIRST]).settled == []
