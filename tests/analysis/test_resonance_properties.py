"""What must hold for any response at all, and the time that reading one takes."""

import json
import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from analysis.resonance import extract, summary, to_json
from daq.frf import DB_PER_NEPER, FrequencyResponse

anything = st.floats(allow_nan=True, allow_infinity=True, width=64)
finite = st.floats(allow_nan=False, allow_infinity=False, width=64)


@st.composite
def responses(draw, values=anything):
    rows = draw(st.integers(0, 40))

    def column(elements):
        return draw(hnp.arrays(float, rows, elements=elements))

    ascending = draw(st.booleans())
    frequency = np.linspace(5, 200, rows) if ascending else column(values)
    with np.errstate(all="ignore"):
        gain = column(values) + 1j * column(values)
    return FrequencyResponse.from_arrays(
        frequency,
        draw(hnp.arrays(float, rows, elements=st.sampled_from([1.5, 2.5, -1.0, math.nan]))),
        gain,
        unit="any",
        phase_known=draw(hnp.arrays(bool, rows)),
        gain_std_db=draw(st.none() | hnp.arrays(float, rows, elements=anything)),
        phase_std_deg=draw(st.none() | hnp.arrays(float, rows, elements=anything)),
        flags=draw(hnp.arrays(np.int64, rows, elements=st.integers(0, 31))),
    )


def wild(rows):
    """Seeds of responses with shape and any noise: with features more often than `anything`."""
    return st.tuples(st.integers(0, 2**31), st.integers(5, rows), st.floats(-4, 1), st.booleans())


def noisy_pair(seed, points, log_noise, phase):
    rng = np.random.default_rng(seed)
    f = np.sort(rng.uniform(20, 110, points))
    zero, pole = np.sort(rng.uniform(15, 120, 2))
    h = (1 - (f / zero) ** 2 + 2j * rng.uniform(0.001, 0.8) * f / zero) / (
        1 - (f / pole) ** 2 + 2j * rng.uniform(0.001, 0.8) * f / pole
    )
    noise = 10**log_noise
    h = h * (1 + noise * (rng.normal(size=points) + 1j * rng.normal(size=points)))
    std = noise * DB_PER_NEPER * 10 ** rng.uniform(-1, 1) if rng.random() < 0.5 else None
    return FrequencyResponse.from_arrays(
        f, 1.0, h if phase else np.abs(h), unit="", phase_known=phase, gain_std_db=std
    )


def check_sane(response):
    levels = extract(response)
    document = json.dumps(to_json(levels), allow_nan=False)
    assert json.loads(document)["levels"] == to_json(levels)["levels"]
    assert all(isinstance(line, str) for line in summary(levels))
    for level in levels:
        for name in ("arf", "rf"):
            feature = getattr(level, name)
            if feature is None:
                assert any(flag.startswith((f"{name}: ", "level: ")) for flag in level.flags)
                continue
            rows = response.frequency_hz
            assert np.nanmin(rows) <= feature.frequency_hz <= np.nanmax(rows)
            assert feature.std_hz > 0
            assert math.isfinite(feature.std_hz)
            assert math.isfinite(feature.gain_db)
            assert feature.gain_std_db > 0
            assert (feature.damping_ratio is None) == (feature.damping_std is None)
            assert feature.damping_ratio is None or 0 < feature.damping_ratio < math.inf
        if level.arf and level.rf:
            assert level.difference_hz > 0
            assert level.difference_std_hz >= 0
        else:
            assert level.difference_hz is None


@given(responses())
def test_any_response_is_read_or_refused(response):
    check_sane(response)


@given(responses(finite))
def test_any_finite_response_is_read_or_refused(response):
    check_sane(response)


@settings(deadline=None, max_examples=20)
@given(wild(80))
def test_any_noisy_pair_is_read_plausibly(parameters):
    check_sane(noisy_pair(*parameters))


@settings(deadline=None, max_examples=8)
@given(wild(60), st.floats(-5, 5))
def test_gain_does_not_move_frequencies(parameters, log_factor):
    one = noisy_pair(*parameters)
    factor = 10**log_factor
    other = FrequencyResponse.from_arrays(
        one.frequency_hz,
        1.0,
        one.gain * factor,
        unit="",
        phase_known=one.phase_known,
        gain_std_db=one.gain_std_db,
    )
    same_features(extract(one), extract(other), gain_db=20 * log_factor)


@settings(deadline=None, max_examples=8)
@given(wild(60), st.sampled_from([1e-3, 1 / 60, 2 * math.pi, 1e3]))
def test_the_unit_of_frequency_does_not_matter(parameters, factor):
    one = noisy_pair(*parameters)
    other = FrequencyResponse.from_arrays(
        one.frequency_hz * factor,
        1.0,
        one.gain,
        unit="",
        phase_known=one.phase_known,
        gain_std_db=one.gain_std_db,
    )
    same_features(extract(one), extract(other), hz=factor)


@settings(deadline=None, max_examples=8)
@given(wild(60), st.randoms(use_true_random=False))
def test_row_order_does_not_matter(parameters, random):
    one = noisy_pair(*parameters)
    rows = list(range(len(one)))
    random.shuffle(rows)
    same_features(extract(one), extract(one.take(np.array(rows))))


def same_features(left, right, hz=1.0, gain_db=0.0):
    """Both alike up to the least-squares fits' own tolerance, well below a standard error."""
    for one, other in zip(left, right, strict=True):
        for a, b in ((one.arf, other.arf), (one.rf, other.rf)):
            assert (a is None) == (b is None)
            if a is not None:
                assert a.method == b.method
                assert b.frequency_hz / hz == pytest.approx(a.frequency_hz, abs=0.02 * a.std_hz)
                assert b.std_hz / hz == pytest.approx(a.std_hz, rel=0.02)
                assert b.gain_db - gain_db == pytest.approx(a.gain_db, abs=0.05 * a.gain_std_db)


def test_noise_widens_the_bars_of_any_pair():
    ratios = []
    f = np.linspace(20, 110, 181)
    for seed in range(18):
        rng = np.random.default_rng(seed)
        zero, pole = rng.uniform(30, 60), rng.uniform(65, 100)
        zetas = rng.uniform(0.01, 0.2, 2)
        h = (1 - (f / zero) ** 2 + 2j * zetas[0] * f / zero) / (
            1 - (f / pole) ** 2 + 2j * zetas[1] * f / pole
        )
        n = rng.normal(size=f.size) + 1j * rng.normal(size=f.size)
        quiet, loud = (
            extract(FrequencyResponse.from_arrays(f, 1.0, h * (1 + noise * n), unit=""))[0]
            for noise in (0.01, 0.06)
        )
        for a, b in ((quiet.arf, loud.arf), (quiet.rf, loud.rf)):
            if a is not None and b is not None:
                ratios.append(b.std_hz / a.std_hz)
    assert len(ratios) > 30
    assert 5 < np.median(ratios) < 7
    assert np.mean(np.array(ratios) > 2) > 0.95


def test_extraction_cost_of_61_points_is_bounded():
    """That is 70 ms where such a problem takes 33 us; 1470 were measured. Machines differ, and so
    does one from minute to minute: the ratio is taken of neighbours."""
    # The slowest kind: scattering, so that every linear fit is tried and refused.
    rng = np.random.default_rng(2)
    f = np.linspace(100, 180, 61)
    base = 1 - (f / 132) ** 2 + 0.02j, 1 - (f / 150) ** 2 + 0.02j
    h = base[0] / base[1] * np.exp(0.15 * rng.standard_t(2, 61) + 0.15j * rng.standard_t(2, 61))
    response = FrequencyResponse.from_arrays(f, 2.5, h, unit="", gain_std_db=0.3)
    assert extract(response)[0].arf.method != "rational"
    matrix, asked = rng.normal(size=(122, 10)), rng.normal(size=122)
    ratios = []
    for _ in range(6):
        start = time.process_time()
        extract(response)
        middle = time.process_time()
        for _ in range(100):
            np.linalg.lstsq(matrix, asked, rcond=None)
        ratios.append((middle - start) / (time.process_time() - middle) * 100.0)
    assert min(ratios) < 3500.0
