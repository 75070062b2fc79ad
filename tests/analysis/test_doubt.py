"""When the leader of a search is doubted, and what that costs."""

from types import SimpleNamespace

import numpy as np
import pytest

from analysis import doubt
from analysis.purse import Purse
from sim.effort import Effort, counting, spend


@pytest.mark.parametrize(
    ("misfits", "structures", "missed", "doubted", "settled"),
    [
        ([1.9], [1.9], [1.9], False, 0),
        # What few rows leave open is asked again on all; what is plain is not.
        ([2.1, 3.4], [0.0, 0.0], [1.0], False, 1), ([0.0, 0.0], [2.1, 3.4], [1.0], False, 1),
        ([2.1, 3.6], [0.0, 0.0], [], True, 1), ([0.0, 0.0], [2.1, 3.6], [], True, 1),
        ([9.0, 1.0], [9.0, 1.0], [1.0], False, 1), ([0.0, 0.0], [0.0, 0.0], [2.1, 2.1], True, 1),
    ],
)  # fmt: skip
def test_few_rows_call_for_pairs_where_the_doubt_is_plain(
    monkeypatch, misfits, structures, missed, doubted, settled
):
    leader, more = ("load-inertia",), []
    fits = [SimpleNamespace(sigma=m, structure=s) for m, s in zip(misfits, structures, strict=True)]
    best = SimpleNamespace(
        hypothesis=SimpleNamespace(effects=leader), surface=SimpleNamespace(observation=None)
    )
    rough = SimpleNamespace(best=best, settle=lambda chosen, groups: more.append(chosen))
    monkeypatch.setattr(doubt, "judge_adequacy", lambda *_: fits.pop(0))
    monkeypatch.setattr(doubt, "hold_out", lambda *_: SimpleNamespace(missed=missed.pop(0)))
    assert doubt.is_doubtful_at_once(rough, None) is doubted
    assert more == [[leader]] * settled
    assert not fits
    assert not missed


@pytest.mark.parametrize(
    ("leader", "alone", "doubts", "still", "settled"),
    [
        (("load-inertia",), True, [False], False, 0),
        (("load-inertia",), True, [True, False], False, 1),
        (("load-inertia",), True, [True, True, True, False], False, 3),
        (("load-inertia",), True, [True, True, True, True], True, 3),
        (("load-inertia",), False, [True], True, 0),
        ((), True, [True], True, 0),
    ],
)
def test_a_doubted_leader_far_ahead_gets_more_runs_before_pairs_are_looked_at(
    monkeypatch, leader, alone, doubts, still, settled
):
    more = []
    fine = SimpleNamespace(
        best=SimpleNamespace(hypothesis=SimpleNamespace(effects=leader)),
        leading=lambda most, behind: [leader] if alone else [leader, ("mesh1-damping",)],
        settle=lambda chosen, groups: more.append(chosen),
    )
    monkeypatch.setattr(doubt, "is_doubtful", lambda *_: doubts.pop(0))
    assert doubt.is_doubtful_still(fine, None) is still
    assert more == [[leader]] * settled
    assert not doubts


@pytest.mark.parametrize(
    ("causes", "misfit", "structure", "missed", "hopeless", "refused"),
    [
        (2, 4.1, 0.0, 1.0, True, True), (2, 0.0, 4.1, 1.0, True, True),
        (2, 0.0, 0.0, 2.1, True, True), (2, 3.9, 3.9, 1.9, False, True),
        (2, 0.0, 2.6, 1.0, False, True), (2, 0.0, 0.0, 1.6, False, True),
        (2, 3.9, 2.4, 1.4, False, False), (1, 3.9, 2.4, 1.9, False, False),
    ],
)  # fmt: skip
def test_a_leader_that_may_explain_is_looked_at_whatever_was_spent(
    monkeypatch, causes, misfit, structure, missed, hopeless, refused
):
    """One that may yet come to explain, for a quarter more; one that does, to the end."""
    fitted = SimpleNamespace(sigma=misfit, structure=structure)
    monkeypatch.setattr(doubt, "judge_adequacy", lambda *_: fitted)
    monkeypatch.setattr(doubt, "hold_out", lambda *_: SimpleNamespace(missed=missed))
    hypothesis = SimpleNamespace(effects=("a", "b")[:causes])
    best = SimpleNamespace(surface=SimpleNamespace(observation=None), hypothesis=hypothesis)
    effort = Effort()
    fine = SimpleNamespace(best=best, purse=Purse.for_observation(swept(1.0), effort))
    effort.add(fine.purse.granted_s)
    assert not doubt.is_given_up(fine, None)
    effort.add(1.0)
    assert doubt.is_given_up(fine, None) is hopeless
    effort.add(0.25 * 230_000.0 - 2.0)
    assert doubt.is_given_up(fine, None) is hopeless
    effort.add(2.0)
    assert doubt.is_given_up(fine, None) is refused


@pytest.mark.parametrize(
    ("lead", "doubtful", "hardly"),
    [(37.0, False, True), (39.0, False, False), (37.0, True, False), (0.0, False, True)],
)
def test_what_leads_a_plain_model_that_will_do_by_little_is_hardly_missing(
    monkeypatch, lead, doubtful, hardly
):
    asked = []
    plain = SimpleNamespace(best=SimpleNamespace(log_likelihood=700.0))
    best = SimpleNamespace(best=SimpleNamespace(log_likelihood=700.0 + lead))
    monkeypatch.setattr(doubt, "is_doubtful", lambda one, _: asked.append(one) or doubtful)
    fine = SimpleNamespace(best=best, found={(): plain, ("load-inertia",): best})
    rng = np.random.default_rng(0)
    assert doubt.is_hardly_missing(fine, rng) is hardly
    assert asked in ([], [plain])
    # What comes after it has the chance that it had.
    assert rng.random() == np.random.default_rng(0).random()


def swept(duration_s):
    """An observation of two levels that take so long together."""
    plans = [(SimpleNamespace(duration_s=share * duration_s), None) for share in (0.25, 0.75)]
    return SimpleNamespace(plans=plans)


def test_a_purse_grows_with_the_sweep_and_holds_what_comes_after_it():
    with counting() as effort:
        spend(5e5)
        quick, usual, slow = (Purse.for_observation(swept(s), effort) for s in (1.0, 70.0, 700.0))
        assert quick.granted_s == usual.granted_s > 1500 * 70.0
        assert slow.granted_s == pytest.approx(1500 * 700.0)
        spend(0.5 * usual.granted_s)
        assert usual.has_spent(0.49)
        assert not usual.has_spent(0.51)
        spend(0.5 * usual.granted_s + 1.0)
        assert usual.is_spent
        assert not slow.is_spent
    assert not Purse().has_spent(0.0)
