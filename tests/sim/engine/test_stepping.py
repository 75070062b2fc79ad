"""Several systems stepped in one call: each gets what it gets alone, to the last bit."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from worlds.asked_steps import growing
from worlds.side_by_side import ADSS, EDSS, law_parameters

from daq.errors import AnalysisError
from sim.effects import drivetrain_with, parse_effect
from sim.engine import stepping
from sim.engine.engine import Stretch, carry
from sim.engine.lanes import VECTOR_BYTES
from sim.engine.stepping import shared_out, step_together

LONG, SHORT = 1e-5, 5e-6
VECTOR = VECTOR_BYTES // 4  # lanes in single precision, on this machine
TWO = 2 * VECTOR - 2  # lanes in two vectors, the second not full
FREQUENCIES = (90.0, 110.0, 125.0)


def asker(unit=EDSS, ratio=0.5, effects=(), lanes=TWO, steps=(LONG,), single=True, cycles=(2, 3)):
    """A system on its way through three stretches, as many lanes of it as asked for."""
    system = drivetrain_with(unit, ratio, [parse_effect(text) for text in effects]).system()
    one = np.ones(lanes)
    some = [
        Stretch(f, 2.5 * np.linspace(0.2, 1.0, lanes), 0.0 * one, 0.0 * one, *cycles)
        for f in FREQUENCIES
    ]
    start = np.zeros((len(system.states), lanes))
    return carry(system, law_parameters(system, lanes), start, some, steps, single)


def same(one, other):
    return all(
        np.array_equal(getattr(a, what), getattr(b, what))
        for a, b in zip(one, other, strict=True)
        for what in ("coefficients", "peak", "state")
    )


@pytest.fixture
def calls(monkeypatch):
    """(systems, vectors) of every call of the kernel."""
    made, plain = [], stepping.step_cycles

    def noted(layout, coefficients, lanes, *rest):
        made.append((len(coefficients), lanes.shape[1] // layout.width))
        return plain(layout, coefficients, lanes, *rest)

    monkeypatch.setattr(stepping, "step_cycles", noted)
    return made


DIFFERENT = [
    {"ratio": 0.3},
    {"ratio": 0.7, "effects": ("load-inertia:J_L=0.2",)},
    {"ratio": 0.4, "effects": ("motor-constant:scale=0.8",)},
    {"unit": ADSS, "ratio": 0.6},
]


@pytest.mark.parametrize("single", [True, False])
@pytest.mark.parametrize(
    ("count", "lanes", "made"),
    [(2, TWO, [(2, 4)]), (3, TWO, [(2, 4), (1, 2)]),
     (4, VECTOR - 3, [(4, 4)]), (3, VECTOR - 3, [(2, 2), (1, 1)]),
     (2, 3 * VECTOR - 4, [(1, 2), (1, 1)] * 2), (2, 4 * VECTOR, [(1, 4)] * 2)],
)  # fmt: skip
def test_requests_of_one_program_share_calls(count, lanes, made, single, calls):
    # Vectors hold half as many numbers of twice the size.
    lanes = lanes if single else -(-lanes // 2)
    ask = [dict(how, lanes=lanes, single=single) for how in DIFFERENT[:count]]
    together = step_together([asker(**how) for how in ask])
    assert calls == made * len(FREQUENCIES)
    for how, found in zip(ask, together, strict=True):
        (alone,) = step_together([asker(**how)])
        assert same(found, alone)
    assert not same(together[0], together[1])


@pytest.mark.parametrize(
    "other",
    [
        {"effects": ("shaft-hardening:h=10000",)},
        {"effects": ("load-stribeck-friction:T_s_L=0.02,omega_s=0.05",)},
        {"single": False},
        {"lanes": TWO + 3},
        {"cycles": (2, 4)},
        {"steps": (SHORT,)},
    ],
)
def test_different_programs_are_stepped_separately(other, calls):
    plain, different = {"lanes": TWO}, {"lanes": TWO, **other}
    together = step_together([asker(**plain), asker(**different)])
    assert {systems for systems, _ in calls} == {1}
    for how, found in zip((plain, different), together, strict=True):
        (alone,) = step_together([asker(**how)])
        assert same(found, alone)


def growing_asker(**how):
    """One of which what is stepped at the long step grows at 110 Hz."""
    return growing(asker(**how), lambda steps: 900 < steps.steps < 920)


def test_repeated_request_leaves_the_other_unchanged(calls):
    back = {"lanes": TWO - 1, "steps": (LONG, SHORT)}
    other = {"ratio": 0.3, "steps": (LONG,)}
    together = step_together([growing_asker(**back), asker(**other)])
    for found, ask in zip(together, (growing_asker(**back), asker(**other)), strict=True):
        (alone,) = step_together([ask])
        assert same(found, alone)
    assert [m.step_s > SHORT for m in together[0]] == [False, False, False]
    assert calls[0] == (2, 4)


def test_one_error_ends_all_requests():
    with pytest.raises(AnalysisError, match="at 110 Hz grew without bound"):
        step_together([asker(lanes=TWO), growing_asker(lanes=TWO - 1)])


def test_empty_request_is_finished():
    def silent():
        return 7
        yield

    first, second = step_together([silent(), asker(lanes=3)])
    assert first == 7
    assert len(second) == len(FREQUENCIES)
    assert step_together([]) == []


@given(
    kinds=st.lists(st.sampled_from("abc"), max_size=40),
    cores=st.integers(1, 9),
    lanes=st.integers(1, 100),
    single=st.booleans(),
)
def test_requests_are_shared_among_all_cores(kinds, cores, lanes, single):
    lots = shared_out(kinds, cores, lanes, single)
    assert sorted(i for lot in lots for i in lot) == list(range(len(kinds)))
    assert all(lots)
    assert len(lots) >= min(cores, len(kinds))
    width = VECTOR if single else VECTOR // 2
    assert all(len(lot) == 1 or len(lot) * -(-lanes // width) <= 4 for lot in lots)
    # No core has more than a lot more than another.
    loads = np.zeros(cores)
    for lot in lots:
        loads[np.argmin(loads)] += len(lot)
    assert loads.max() - loads.min() <= max(map(len, lots), default=0)


@pytest.mark.parametrize(
    ("kinds", "cores", "lanes", "lots"),
    [
        ("aa", 2, TWO, [[0], [1]]),
        ("aaa", 2, TWO, [[0, 1], [2]]),
        ("aaaa", 2, TWO, [[0, 1], [2, 3]]),
        ("aaaaaa", 2, TWO, [[0, 1], [2, 3], [4], [5]]),
        ("aaaa", 2, 2 * TWO, [[0], [1], [2], [3]]),
        ("aaaaaaaaaaaa", 2, VECTOR - 3, [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9], [10, 11]]),
        ("aaaa", 1, TWO, [[0, 1], [2, 3]]),
        ("aaaaa", 8, TWO, [[0], [1], [2], [3], [4]]),
        # What is alike is together, and what each has one too many of.
        ("abab", 1, TWO, [[0, 2], [1, 3]]),
        ("aaabbbcc", 2, TWO, [[0, 1], [3, 4], [6, 7], [2, 5]]),
    ],
)
def test_pairs_form_only_when_cores_suffice(kinds, cores, lanes, lots):
    assert shared_out(kinds, cores, lanes) == lots
