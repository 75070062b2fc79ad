"""Sets that say the same of the load: a payload far from what was measured is no payload."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from worlds.synthetic import ADSS, FREQUENCIES

from analysis.checking.equivalence import is_equivalent_at_load
from analysis.ensemble.model import Hypothesis
from analysis.selection.verdict import Judged, Verdict

J_L = ADSS.load.J_L
SWINGING, BRAKED, HEAVY, TIED = (
    ("payload-flexibility",), ("load-viscous-damping",), ("load-inertia",), ("cable-stiffness",)
)  # fmt: skip
LOW, HIGH = FREQUENCIES[0], FREQUENCIES[-1]
FAR_BELOW, FAR_ABOVE, AMID = (
    [0.2 * J_L, f_p, zeta] for f_p, zeta in [(0.1 * LOW, 2.0), (5.0 * HIGH, 0.02), (140.0, 0.03)]
)


def believed(effects, values=None):
    """A set at a place; where none is given, amid the ranges."""
    hypothesis = Hypothesis(ADSS, effects)
    place = np.full(hypothesis.d, 0.5) if values is None else hypothesis.place(0.4, values)
    seen = SimpleNamespace(frequency_hz=np.tile(FREQUENCIES, 2))
    return SimpleNamespace(
        hypothesis=hypothesis,
        best=SimpleNamespace(place=place),
        surface=SimpleNamespace(observation=seen),
    )


@pytest.mark.parametrize(
    ("payload", "other", "alike"),
    [
        (FAR_ABOVE, HEAVY, True), (FAR_ABOVE, BRAKED, False), (FAR_ABOVE, TIED, False),
        # Below its resonance a damped payload hangs behind: a brake, hardly heavier.
        (FAR_BELOW, BRAKED, True), (FAR_BELOW, HEAVY, False), (FAR_BELOW, TIED, False),
        (AMID, HEAVY, False), (AMID, BRAKED, False), (AMID, TIED, False),
    ],
)  # fmt: skip
def test_payload_is_equivalent_only_within_range(payload, other, alike):
    assert is_equivalent_at_load(believed(SWINGING, payload), believed(other)) is alike


def test_damped_heavier_load_equals_damped_payload():
    heavy = believed(tuple(sorted(HEAVY + BRAKED)))
    swinging = Hypothesis(ADSS, tuple(sorted(SWINGING + BRAKED)))
    values = {"B_L": 0.2, "J_p": 0.2 * J_L, "f_p": 5.0 * HIGH, "zeta_p": 0.02}
    one = believed(swinging.effects, [values[p.name] for _, p in swinging.parameters])
    assert is_equivalent_at_load(one, heavy)
    assert not is_equivalent_at_load(heavy, one)


@pytest.mark.parametrize("extra", [("amplifier-gain",), ("load-coulomb-friction",)])
def test_causes_beyond_load_must_be_equal(extra):
    known = {"k_a": 4.5, "T_f_L": 0.05}
    with_extra = Hypothesis(ADSS, tuple(sorted(SWINGING + extra)))
    sizes = dict(zip(["J_p", "f_p", "zeta_p"], FAR_ABOVE, strict=True)) | known
    one = believed(with_extra.effects, [sizes[p.name] for _, p in with_extra.parameters])
    assert is_equivalent_at_load(one, believed(tuple(sorted(HEAVY + extra))))
    assert not is_equivalent_at_load(one, believed(HEAVY))


def test_sets_with_equal_sizes_are_not_equivalent():
    assert not is_equivalent_at_load(believed(HEAVY), believed(HEAVY))
    assert not is_equivalent_at_load(believed(BRAKED), believed(HEAVY))


@pytest.mark.parametrize(
    ("payload", "said"), [(FAR_BELOW, "equivalent, with more parameters"), (AMID, "")]
)
def test_larger_equivalent_set_is_marked(payload, said):
    judged = tuple(
        Judged(believed(effects, at), SimpleNamespace(), 0.0, 0.0, 0.0, p, "")
        for effects, at, p in ((BRAKED, None, 0.5), (SWINGING, payload, 0.4), ((), None, 0.1))
    )
    verdict = Verdict("explained", judged[0], judged, judged[-1])
    assert [verdict.remark(one) for one in judged] == ["", said, ""]
    assert verdict.probability == pytest.approx(0.9 if said else 0.5)
    refused = replace(judged[1], objection="needs a size outside its plausible range")
    assert verdict.remark(refused) == refused.objection
