"""Even and odd harmonics of what was measured, held against those of a model."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.harmonics import Harmonic, compare_harmonics, describe_harmonics
from analysis.ensemble.model import Hypothesis
from analysis.observation.observation import observe
from daq.plan import SweepPlan
from sim.effects import parse_effect
from sim.engine.effort import counting
from sim.response import simulate
from sim.unit import load_unit

ADSS = load_unit("adss")
PLAN = SweepPlan(tuple(np.linspace(110.0, 170.0, 12)), (2.5, 4.0))
RATIO = 0.4


def measured(*texts, plan=PLAN, seed=1):
    effects = [parse_effect(text) for text in texts]
    return simulate(ADSS, RATIO, plan, effects=effects, seed=seed)


def compared(*responses, seed=2, noise_v=5e-5):
    plain = SimpleNamespace(
        hypothesis=Hypothesis(ADSS, ()), best=SimpleNamespace(place=np.array([RATIO]))
    )
    # What a diagnosis finds along with the cause.
    observation = observe(*responses).with_noise(noise_v)
    return compare_harmonics(responses, observation, plain, np.random.default_rng(seed))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_harmonics_of_plain_machine_agree_with_simulation(seed):
    """One in some five hundred is beyond four standard deviations of twelve machines."""
    found = compared(measured(seed=seed))
    assert {one.number for one in found} <= {2, 3}
    assert [one for one in found if one.number == 3]
    assert not any(one.differs for one in found)
    assert "something" not in describe_harmonics(found)
    assert "odd ones as simulated" in describe_harmonics(found)


def test_asymmetric_amplifier_shows_in_even_harmonics():
    found = compared(measured("amplifier-unevenness:scale=1.5"))
    even = [one for one in found if one.parity == "even"]
    assert even
    assert all(one.differs and one.sigma > 0 for one in even)
    said = describe_harmonics(found)
    assert said.startswith("even ones stronger than simulated, most at ")
    assert said.endswith(": something acts more one way than the other")


def test_clipping_shows_in_odd_harmonics_when_clipping():
    found = compared(measured("amplifier-saturation:V_sat=8"))
    odd = {one.source_vpk: one for one in found if one.parity == "odd"}
    assert odd[4.0].differs
    said = describe_harmonics(found)
    assert "odd ones stronger than simulated, most at 4 V" in said
    if not any(one.differs for one in found if one.parity == "even"):
        assert said.endswith(": something limits, rubs or gives alike both ways")


def test_harmonic_below_noise_is_not_reported():
    response = measured("amplifier-unevenness:scale=1.5")
    quiet = replace(response, harmonic2=response.harmonic2 * 1e-4)
    assert {one.number for one in compared(quiet)} == {3}
    assert compared(response, noise_v=1.0) == ()


def test_response_without_harmonics_simulates_nothing():
    """It is stated to have none."""
    response = measured()
    nothing = np.full(len(response), np.nan + 0j)
    with counting() as effort:
        assert compared(replace(response, harmonic2=nothing, harmonic3=nothing)) == ()
    assert effort.simulated_s == 0.0
    assert describe_harmonics(()).startswith("the response holds none above its noise")


def test_each_sweep_has_its_own_harmonics_reference():
    high = replace(PLAN, levels_vpk=(3.0,), direction="down")
    found = compared(measured(), measured(plan=high))
    assert {one.source_vpk for one in found if one.number == 3} == {2.5, 3.0, 4.0}
    assert not any(one.differs for one in found)


def test_only_row_without_harmonic_is_omitted():
    response = measured("amplifier-unevenness:scale=1.5")
    third = response.harmonic3.copy()
    third[3] = np.nan
    some, whole = compared(replace(response, harmonic3=third)), compared(response)
    assert [one.number for one in some] == [one.number for one in whole]
    assert all(np.isfinite(one.sigma) for one in some)
    (lower,) = (one for one in some if (one.number, one.source_vpk) == (2, 2.5))
    rows = (response.source_vpk == 2.5) & np.isfinite(third)
    of_rows = [np.abs(values[rows]) for values in (response.harmonic2, response.gain)]
    assert lower.measured == pytest.approx(np.exp(np.mean(np.log(of_rows[0] / of_rows[1]))))
    # Machines are held against it at the same points.
    (higher,) = (one for one in whole if (one.number, one.source_vpk) == (2, 2.5))
    assert lower.simulated != higher.simulated


def test_harmonic_converts_to_its_document():
    one = Harmonic(2, 1.5, 0.02, 0.01, 6.0)
    assert one.to_json() == {
        "harmonic": 2, "parity": "even", "source_vpk": 1.5, "measured_share": 0.02,
        "simulated_share": 0.01, "sigma": 6.0,
    }  # fmt: skip
    assert describe_harmonics([one]) == (
        "even ones stronger than simulated, most at 1.5 V, by 6 dB (2 % of the fundamental, "
        "6 sigma): something acts more one way than the other"
    )
    weaker = replace(one, sigma=-6.0, measured=0.001)
    assert "weaker than simulated" in describe_harmonics([weaker])
    assert "something" not in describe_harmonics([weaker])
