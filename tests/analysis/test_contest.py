"""The contest on all rows: who gets more runs, and how many, given how all stand."""

from types import SimpleNamespace

import numpy as np
import pytest
import synthetic

from analysis import contest
from analysis.causes import Hypothesis
from analysis.placement import groups_about
from analysis.purse import Purse

ADSS = synthetic.ADSS


@pytest.mark.parametrize(
    ("causes", "missed", "second", "rounds"),
    [
        # What is missed is that with every reading, too, if it is not said apart.
        (1, [1.0], 10.0, 0), (1, [1.29], 10.0, 0), (1, [2.6], 10.0, 0), (0, [1.6], 10.0, 0),
        (1, [1.6, 1.1], 10.0, 1), (1, [1.6, 1.5, 1.2], 10.0, 2), (1, [1.6] * 9, 10.0, 4),
        (1, [1.6] * 9, 199.0, 4), (1, [1.6] * 5 + [1.2], 201.0, 5), (1, [1.6] * 11, 201.0, 9),
        (2, [0.99], 201.0, 0), (2, [1.1, 1.1, 0.9], 201.0, 2), (2, [2.6], 10.0, 0),
        (3, [1.6, 1.2, 0.9], 10.0, 2),
        # Few readings far off are worth runs until there are 160, or four rounds beside others.
        (1, [(0.8, 1.31)] * 9, 201.0, 5), (1, [(0.8, 1.31), (0.8, 1.29)], 201.0, 1),
        (2, [(0.8, 1.31)] * 9, 10.0, 4), (0, [(0.8, 1.31)], 201.0, 0),
        (1, [(2.6, 3.0)], 201.0, 0),
    ],
)  # fmt: skip
def test_a_leader_that_predicts_badly_gets_more_runs(monkeypatch, causes, missed, second, rounds):
    settled = []
    left = iter(one if isinstance(one, tuple) else (one, one) for one in missed)
    leader = ("amplifier-lag", "load-inertia", "motor-constant")[:causes]
    best = SimpleNamespace(hypothesis=Hypothesis(ADSS, leader), population=range(10))

    def settle(chosen, groups):
        settled.append(chosen)
        best.population = range(len(best.population) + 5 * groups)

    def hold_out(*_):
        few, every = next(left)
        return SimpleNamespace(missed=few, rms_sigma=every)

    fine = SimpleNamespace(
        best=best,
        found={leader: best},
        observation=None,
        leading=lambda most, behind: [leader, ()] if second < behind else [leader],
        settle=settle,
        hear=lambda: None,
    )
    monkeypatch.setattr(contest, "hold_out", hold_out)
    contest.see_it_predict(fine)
    assert settled == [[leader]] * rounds


@pytest.mark.parametrize(
    ("doubted", "missed", "runs", "rounds", "leads"),
    [
        # It takes the lead with more runs, and is in no doubt.
        (True, 0.78, 110, 1, True),
        # It gets as many as the leader has, or four rounds.
        (True, 0.78, 130, 1, False), (True, 0.78, 90, 2, False), (True, 0.78, 0, 4, False),
        (False, 0.78, 110, 0, False), (True, 1.2, 110, 0, False), (True, 0.78, 150, 0, False),
    ],
)  # fmt: skip
def test_who_predicts_better_than_a_doubted_leader_is_backed(
    monkeypatch, doubted, missed, runs, rounds, leads
):
    leader, other, settled = ("load-inertia",), ("payload-flexibility",), []

    def standing(effects, count):
        hypothesis = Hypothesis(ADSS, effects)
        return SimpleNamespace(hypothesis=hypothesis, population=range(count))

    found = {leader: standing(leader, 150), other: standing(other, runs), (): standing((), 40)}

    class Fine:
        """One whose second takes the lead with more runs, or does not."""

        observation = None
        found = property(lambda _: found)
        best = property(lambda _: found[other if settled and leads else leader])

        def leading(self, most, behind):
            assert behind == contest.HOPELESS
            return [leader, other, ()]

        def settle(self, chosen, groups):
            settled.append(chosen)
            for key in chosen:
                found[key] = standing(key, len(found[key].population) + 5 * groups)

        def hear(self):
            pass

    monkeypatch.setattr(
        contest, "is_doubtful", lambda one, _: doubted and one.hypothesis.effects == leader
    )
    sigma = {leader: 1.37, other: missed, (): 0.1}
    monkeypatch.setattr(
        contest,
        "hold_out",
        lambda one, _: SimpleNamespace(missed=sigma[one.hypothesis.effects]),
    )
    rng = np.random.default_rng(1)
    contest.back_who_predicts(Fine(), rng)
    assert settled == [[other]] * rounds
    assert rng.random() == np.random.default_rng(1).random()


@pytest.mark.parametrize(
    ("leader", "missed", "moved", "looked", "settled"),
    [
        (("load-inertia",), 1.1, 0.11, 1, 1), (("load-inertia",), 1.1, -0.09, 1, 0),
        (("load-inertia",), 1.0, 0.5, 0, 0), ((), 2.0, 0.5, 0, 0),
    ],
)  # fmt: skip
def test_a_leader_that_predicts_worse_than_true_causes_is_looked_at_over_all_ratios(
    monkeypatch, leader, missed, moved, looked, settled
):
    calls, place = [], np.array([0.6, 0.5])[: 1 + len(leader)]

    def standing(ratio):
        best = SimpleNamespace(place=np.array([ratio, *place[1:]]))
        return SimpleNamespace(hypothesis=Hypothesis(ADSS, leader), best=best)

    def start(places, groups, reach):
        ((key, at),) = places.items()
        np.testing.assert_array_equal(at, place)
        told = Hypothesis(ADSS, key), at, groups, np.random.default_rng(0), reach
        # The whole range, whatever it was found at: one of five machines in each fifth of it.
        fifths = [list(np.floor(5.0 * group.ratios)) for group in groups_about(*told)]
        assert fifths == [list(range(5))] * groups
        fine.found[key] = standing(0.6 + moved)
        calls.append("start")

    fine = SimpleNamespace(
        best=standing(0.6),
        found={leader: standing(0.6)},
        observation=None,
        start=start,
        settle=lambda chosen, groups: calls.append("settle"),
    )
    monkeypatch.setattr(contest, "hold_out", lambda *_: SimpleNamespace(missed=missed))
    contest.look_at_every_ratio(fine)
    assert calls == ["start"] * looked + ["settle"] * settled


@pytest.mark.parametrize(
    ("gap", "spent", "rounds"),
    [(50.0, False, 4), (199.0, False, 4), (201.0, False, 1), (50.0, True, 1)],
)
def test_a_pair_is_compared_with_its_parts_in_every_round(monkeypatch, gap, spent, rounds):
    """As long as there is motion to be spent on it."""
    pair, part, settled = ("amplifier-lag", "load-inertia"), ("load-inertia",), []
    standing = {pair: 300.0, part: 300.0 - gap, (): 0.0}

    def leading(most, behind):
        return [key for key in list(standing)[:most] if standing[key] >= 300.0 - behind]

    purse = SimpleNamespace(is_spent=spent)
    fine = SimpleNamespace(found=standing, leading=leading, hear=lambda: None, purse=purse)
    monkeypatch.setattr(contest, "is_nothing_missing", lambda *_: False)
    monkeypatch.setattr(contest, "is_given_up", lambda *_: False)
    monkeypatch.setattr(contest, "is_pressed", lambda _: False)
    monkeypatch.setattr(contest, "is_felt_alike", lambda *_: False)
    monkeypatch.setattr(contest, "settle", lambda _, chosen: settled.append(chosen))
    assert contest.compare(fine, None)
    assert settled == ([[pair, part]] if gap < 200.0 else [[pair]]) * rounds


@pytest.mark.parametrize(
    ("explains_at", "overdrawn_at", "runs"),
    [
        # It explains as it is, or with one or two rounds more, and is then compared, once.
        (100, 999, 130), (130, 999, 160), (160, 999, 190),
        # It explains too late, or nothing is left to try that with.
        (190, 999, 160), (130, 100, 100), (160, 130, 130),
    ],
)  # fmt: skip
def test_a_search_is_not_left_with_a_leader_of_few_runs(
    monkeypatch, explains_at, overdrawn_at, runs
):
    """All is spent that may be. It has 100 runs, and gets 30 at a time."""
    leader, made = ("shaft-damping", "total-backlash"), [None] * 100
    best = SimpleNamespace(hypothesis=SimpleNamespace(effects=leader), population=made)

    class Spent:
        is_spent = True

        @property
        def is_overdrawn(self):
            return len(made) >= overdrawn_at

    fine = SimpleNamespace(
        best=best,
        found={leader: best},
        purse=Spent(),
        leading=lambda *_: [leader],
        hear=lambda: None,
    )
    monkeypatch.setattr(contest, "is_nothing_missing", lambda *_: False)
    monkeypatch.setattr(contest, "is_given_up", lambda *_: len(made) < explains_at)
    monkeypatch.setattr(contest, "is_pressed", lambda _: False)
    monkeypatch.setattr(contest, "settle", lambda _, who: made.extend([None] * 30))
    assert contest.compare(fine, None)
    assert len(made) == runs


@pytest.mark.parametrize(
    ("pressed", "alike", "rounds"),
    [
        ("", "", [2, 2]), ("near", "", []), ("leader", "", [1, 1]), ("leader near", "", [2, 2]),
        ("", "leader", []), ("", "near", []),
    ],
)  # fmt: skip
def test_who_is_no_rival_is_left_aside_after_two_rounds(monkeypatch, pressed, alike, rounds):
    """Who wants a size that no bench has, unless all do, or says the same as the leader.

    Who stands behind one of the first gets runs all the same: it may be the explanation.
    """
    leader, near, settled = ("load-inertia",), ("payload-flexibility",), []
    found = {leader: SimpleNamespace(name="leader"), near: SimpleNamespace(name="near")}
    fine = SimpleNamespace(
        found=found, leading=lambda *_: list(found), hear=lambda: None, purse=Purse()
    )
    monkeypatch.setattr(contest, "is_nothing_missing", lambda *_: False)
    monkeypatch.setattr(contest, "is_pressed", lambda candidate: candidate.name in pressed)
    monkeypatch.setattr(contest, "is_felt_alike", lambda one, simpler: simpler.name == alike)
    monkeypatch.setattr(contest, "settle", lambda _, chosen: settled.append(chosen))
    assert contest.compare(fine, None)
    assert settled[:2] == [[leader, near]] * 2
    assert settled[2:] == [[leader, near][-count:] for count in rounds]


@pytest.mark.parametrize(
    ("pressed", "spent", "overdrawn", "rounds"),
    [
        # What is spent ends a comparison, but not for whom an implausible leader keeps behind it.
        ((), True, False, 0), (("leader",), True, False, 3), (("leader",), True, True, 0),
        (("leader", "near"), True, False, 0), (("near",), True, False, 0), ((), False, False, 3),
    ],
)  # fmt: skip
def test_a_leader_that_no_bench_has_does_not_end_a_comparison(
    monkeypatch, pressed, spent, overdrawn, rounds
):
    """A shaft too stiff to be one led the shaft that hardens, which was the truth, by chance."""
    leader, near, settled = ("shaft-stiffness",), ("shaft-hardening",), []
    found = {leader: SimpleNamespace(name="leader"), near: SimpleNamespace(name="near")}
    fine = SimpleNamespace(
        found=found,
        leading=lambda *_: list(found),
        hear=lambda: None,
        purse=SimpleNamespace(is_spent=spent, is_overdrawn=overdrawn),
    )
    monkeypatch.setattr(contest, "is_nothing_missing", lambda *_: False)
    monkeypatch.setattr(contest, "is_given_up", lambda *_: False)
    monkeypatch.setattr(contest, "is_pressed", lambda candidate: candidate.name in pressed)
    monkeypatch.setattr(contest, "is_felt_alike", lambda *_: False)
    monkeypatch.setattr(contest, "settle", lambda _, chosen: settled.append(chosen))
    contest.compare(fine, None)
    assert settled == [[leader, near], *[[near] if pressed else [leader, near]] * rounds]


@pytest.mark.parametrize(
    ("of_leader", "behind", "rounds", "left"),
    [
        # The leader's runs, or enough, and no more; none where they show that it is not close.
        (110, [20.0, 20.0, 20.0], 2, 110), (111, [20.0] * 4, 3, 140), (400, [0.0] * 9, 9, 320),
        (110, [20.0, 31.0], 1, 80), (110, [31.0], 0, 50), (50, [20.0, 20.0], 0, 50),
    ],
)  # fmt: skip
def test_a_newcomer_that_is_close_gets_as_many_runs_as_the_leader(of_leader, behind, rounds, left):
    leader, pair, other = ("load-inertia",), ("amplifier-lag", "load-inertia"), ("motor-constant",)
    runs, settled = {leader: of_leader, pair: 50, other: 50}, []

    class Fine:
        """One whose newcomer stands elsewhere after each round of runs."""

        found = property(
            lambda _: {key: SimpleNamespace(population=range(n)) for key, n in runs.items()}
        )

        def leading(self, most, within):
            here = behind[min(len(settled), len(behind) - 1)] <= within
            return [leader, other, *([pair] if here else [])]

        def settle(self, chosen, groups):
            settled.append(chosen)
            for key in chosen:
                runs[key] += 5 * groups

    contest.catch_up(Fine(), [pair], leader)
    assert settled == [[pair]] * rounds
    assert runs == {leader: of_leader, pair: left, other: 50}


@pytest.mark.parametrize(
    ("known", "behind", "started", "runs"),
    [
        # It was not looked at, or elsewhere, gets a second look unless that is hopeless, and is
        # then compared as long as it is not far behind.
        (None, 59.0, True, 150), (None, 61.0, True, 60), (None, 299.0, True, 60),
        (None, 301.0, True, 30), (0.29, 59.0, True, 150), (0.29, 61.0, True, 60),
        (0.31, 59.0, False, 150), (0.31, 61.0, False, 30),
    ],
)  # fmt: skip
def test_what_says_the_same_with_fewer_sizes_is_compared_with_a_leader(
    monkeypatch, known, behind, started, runs
):
    leader, plainer = ("payload-flexibility",), ("load-inertia",)
    there, looked = {plainer: np.array([0.41, 0.5])}, []

    def one(key, count, ratio=0.4):
        best = SimpleNamespace(place=np.array([ratio, 0.5]))
        return SimpleNamespace(hypothesis=Hypothesis(ADSS, key), population=range(count), best=best)

    class Fine:
        def __init__(self):
            self.found = {leader: one(leader, 150)}
            if known is not None:
                self.found[plainer] = one(plainer, 30, known)

        best = property(lambda self: self.found[leader])

        def start(self, places, groups):
            looked.append(places)
            self.found |= {key: one(key, 5 * groups) for key in places}

        def leading(self, most, within):
            return [leader, *([plainer] if behind <= within else [])]

        def settle(self, chosen, groups):
            for key in chosen:
                self.found[key] = one(key, len(self.found[key].population) + 5 * groups)

        def hear(self):
            pass

    monkeypatch.setattr(contest, "plainer_places", lambda _, without: without == "x" and there)
    fine = Fine()
    contest.weigh_plainer(fine, "x")
    assert looked == [there] * started
    assert len(fine.found[plainer].population) == runs
    # Where nothing says the same nothing is done.
    monkeypatch.setattr(contest, "plainer_places", lambda *_: {})
    contest.weigh_plainer(fine, ())
    assert looked == [there] * started


def test_who_has_runs_enough_gets_no_more_to_be_compared_by():
    settled, few, enough = [], ("load-inertia",), ("amplifier-lag",)
    found = {
        few: SimpleNamespace(population=range(319)),
        enough: SimpleNamespace(population=range(320)),
    }
    fine = SimpleNamespace(found=found, settle=lambda chosen, groups: settled.append(chosen))
    contest.settle(fine, [few, enough])
    contest.settle(fine, [enough])
    assert settled == [[few]]


@pytest.mark.parametrize(
    ("structures", "runs", "rounds"),
    [
        # Where nothing is left, and where it is plain, more runs tell nothing.
        ([1.0], 80, 0), ([8.0], 80, 0), ([1.8, 0.5], 80, 1), ([1.8, 9.0], 80, 1),
        ([1.8, 2.4, 3.1, 4.2], 80, 4),
        # Who has as many as are compared by gets no more.
        ([], 320, 0), ([1.8], 280, 1),
    ],
)  # fmt: skip
def test_a_leader_that_may_leave_structure_gets_more_runs_with_who_is_close(
    monkeypatch, structures, runs, rounds
):
    leader, close, settled = ("motor-constant",), ("amplifier-gain",), ("motor-resistance",)
    found = {
        key: SimpleNamespace(population=[None] * count, hypothesis=SimpleNamespace(effects=key))
        for key, count in ((leader, runs), (close, 40), (settled, 320))
    }
    more = []

    def settle(chosen, groups, how="settle"):
        more.append((how, chosen, groups))
        for key in chosen:
            found[key].population += [None] * 5 * groups

    fine = SimpleNamespace(
        found=found,
        best=found[leader],
        leading=lambda most, behind: list(found),
        look_closer=lambda chosen, groups: settle(chosen, groups, "along"),
        settle=settle,
        hear=lambda: more.append("hear"),
    )
    monkeypatch.setattr(
        contest, "judge_adequacy", lambda *_: SimpleNamespace(structure=structures.pop(0))
    )
    contest.settle_doubt(fine, None)
    few = [leader, close]
    assert more == [("along", few, 4), ("settle", few, 4), "hear"] * rounds
    assert not structures
