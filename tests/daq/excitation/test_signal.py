"""Signals: their rms and lines, what files keep of them, and what no signal can be."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from daq.errors import InputError
from daq.excitation.choices import plan_by_signal, usual_cycles
from daq.excitation.plan import ExcitedPlan
from daq.excitation.signal import SIGNAL_KEY, chirp, excitation_of, multisine, noise
from daq.plan import SweepPlan

GRID = np.arange(20.0, 41.0, 2.0)


def over_time(signal, count=4096):
    t = np.arange(count) / count * signal.period_s
    turns = np.outer(t, signal.frequencies_hz)
    return t, np.imag(np.exp(2j * np.pi * turns) @ signal.phasors())


def test_signals_have_a_unit_sines_rms():
    for signal in (multisine(GRID, 1.0, "schroeder"), chirp(20.0, 40.0, 1.0)):
        assert np.std(over_time(signal)[1]) == pytest.approx(np.sqrt(0.5), rel=1e-6)


def test_schroeder_phases_lower_the_peaks():
    low = np.abs(over_time(multisine(GRID, 1.0, "schroeder"))[1]).max()
    high = [np.abs(over_time(multisine(GRID, 1.0, "random", s))[1]).max() for s in range(5)]
    assert low < min(high)


def test_chirp_goes_from_start_to_stop():
    signal = chirp(20.0, 120.0, 2.0)
    t, u = over_time(signal, 1 << 14)
    inside = (t > 0.2) & (t < 1.8)
    crossings = np.flatnonzero(np.diff(np.sign(u)) > 0)
    early, late = (np.diff(t[crossings[crossings > np.flatnonzero(inside)[0]]])[i] for i in (0, -6))
    assert 1.0 / early == pytest.approx(20.0 + 50.0 * 0.2, abs=5.0)
    assert 1.0 / late > 100.0


def test_noise_is_white_in_its_band():
    signal = noise(20.0, 40.0, 1.0)
    lines, phasors = signal.drawn(np.random.default_rng(1), 200)
    assert lines[0] / 200 == pytest.approx(20.0, abs=0.5)
    assert lines[-1] / 200 == pytest.approx(40.0, abs=0.5)
    power = np.abs(phasors) ** 2
    assert power.sum() == pytest.approx(1.0)
    assert np.mean(power[: power.size // 2]) == pytest.approx(np.mean(power), rel=0.15)
    other = signal.drawn(np.random.default_rng(2), 200)[1]
    assert abs(np.vdot(other, phasors)) < 0.2


def test_file_document_restores_the_signal():
    for signal in (multisine(GRID, 1.0, "random", 3), noise(20.0, 40.0, 0.5)):
        kept = excitation_of({SIGNAL_KEY: signal.to_json()})
        assert kept.lines == signal.lines
        np.testing.assert_allclose(kept.amplitudes, signal.amplitudes, rtol=1e-4)
        if signal.phase_deg:
            np.testing.assert_allclose(kept.phasors(), signal.phasors(), atol=1e-4)


@settings(max_examples=40, deadline=None)
@given(
    st.dictionaries(
        st.sampled_from(["kind", "period_s", "lines", "amplitude", "phase_deg", "more"]),
        st.one_of(
            st.none(), st.booleans(), st.text(max_size=4), st.sampled_from(["periodic", "noise"]),
            st.floats(), st.integers(-3, 3),
            st.lists(st.one_of(st.floats(), st.integers(-2, 9), st.text(max_size=2)), max_size=4),
        ),
    )
)  # fmt: skip
def test_no_document_is_half_accepted(document):
    try:
        signal = excitation_of({SIGNAL_KEY: document})
    except InputError:
        return
    assert excitation_of({SIGNAL_KEY: signal.to_json()}).lines == signal.lines


def test_plan_refuses_frequencies_not_driven():
    signal = multisine(GRID, 1.0, "schroeder")
    with pytest.raises(InputError, match="21 Hz"):
        ExcitedPlan((20.0, 21.0), (1.0,), excitation=signal)
    plan = ExcitedPlan(
        (20.0, 40.0), (1.0, 2.0), settle_cycles=2, integrate_cycles=8, excitation=signal
    )
    assert plan.duration_s == pytest.approx(20.0)


@pytest.mark.parametrize(
    ("changed", "options", "said"),
    [
        ({"direction": "down"}, {}, "direction"),
        ({"from_rest": True}, {}, "rest"),
        ({}, {"resolution_hz": 30.0}, "resolution"),
        ({}, {"resolution_hz": float("nan")}, "resolution"),
    ],
)
def test_contradictory_choices_are_refused(changed, options, said):
    settle, integrate = usual_cycles("multisine", None, None)
    plan = SweepPlan(
        tuple(GRID), (1.0,), settle_cycles=settle, integrate_cycles=integrate, **changed
    )
    with pytest.raises(InputError, match=said):
        plan_by_signal(plan, "multisine", **options)
