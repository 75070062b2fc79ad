import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.ensemble.model import Hypothesis, every_single_cause
from sim.catalogue import CATALOGUE
from sim.unit import load_unit

UNITS = {name: load_unit(name) for name in ("adss", "edss")}


@given(
    name=st.sampled_from(sorted(UNITS)),
    effects=st.sets(st.sampled_from(sorted(CATALOGUE)), max_size=3),
    ratio=st.floats(0.0, 1.0),
    u=st.floats(0.0, 1.0),
)
def test_places_and_physical_values_are_inverse(name, effects, ratio, u):
    hypothesis = Hypothesis(UNITS[name], tuple(sorted(effects)))
    place = np.array([ratio, *[u] * (hypothesis.d - 1)])
    values = hypothesis.values(place)
    assert np.all(values > 0.0)
    np.testing.assert_allclose(hypothesis.place(ratio, values), place, atol=1e-9)


@pytest.mark.parametrize("name", sorted(UNITS))
@pytest.mark.parametrize("corner", [0.0, 1.0])
def test_range_ends_of_causes_make_machines(name, corner):
    for hypothesis in every_single_cause(UNITS[name]):
        place = np.array([0.3, *[corner] * (hypothesis.d - 1)])
        machine = hypothesis.machine(place, seed=1)
        (setting,) = machine.effects
        assert setting.id == hypothesis.effects[0]
        assert machine.servo(UNITS[name]).system.A.shape[0] >= 13


def test_every_usual_cause_is_examined():
    usual = [h.effects[0] for h in every_single_cause(UNITS["adss"])]
    assert usual == [e for e in CATALOGUE if not CATALOGUE[e].rare]
    assert len(usual) == 22


def test_datasheet_values_lie_inside_range_only():
    """Added effects begin at one end of theirs."""
    amid = {h.effects[0] for h in every_single_cause(UNITS["edss"]) if h.amid == [True]}
    assert amid == {
        "load-inertia", "shaft-stiffness", "total-backlash", "amplifier-gain",
        "motor-resistance", "motor-constant", "tachometer-gain", "filter-corner",
    }  # fmt: skip


def test_model_states_sites_of_its_causes():
    plant = ("cable-stiffness", "shaft-damping")
    assert Hypothesis(UNITS["adss"], plant).sites == ("plant",)
    assert Hypothesis(UNITS["adss"], (*plant, "tachometer-gain")).sites == ("chain", "plant")


@pytest.mark.parametrize(
    ("effects", "known"),
    [
        ((), []),
        # Half to twice of what it says; of what hangs on the load it says nothing.
        (("shaft-stiffness",), [0.5]),
        (("payload-flexibility", "shaft-stiffness"), [np.nan, np.nan, np.nan, 0.5]),
    ],
)
def test_sizes_have_datasheet_place_if_known(effects, known):
    np.testing.assert_allclose(Hypothesis(load_unit("adss"), effects).datasheet, known)
