"""Frequency responses for tests of file formats: any that can be, and equality to the last bit."""

import math

import numpy as np
from hypothesis import strategies as st

from daq.frf import FrequencyResponse, PointFlag

ARRAYS = (
    "frequency_hz",
    "source_vpk",
    "gain",
    "phase_known",
    "gain_std_db",
    "phase_std_deg",
    "dc_v",
    "harmonic2",
    "harmonic3",
    "flags",
)
REST = ("unit", "direction", "settle_cycles", "integrate_cycles", "from_rest")


def same(one: FrequencyResponse, other: FrequencyResponse) -> None:
    """Fail unless both are equal to the last bit, unknown values included."""
    for name in ARRAYS:
        left, right = getattr(one, name), getattr(other, name)
        assert left.dtype == right.dtype, name
        np.testing.assert_array_equal(left, right, err_msg=name, strict=True)
    for name in REST:
        assert getattr(one, name) == getattr(other, name), name
        assert type(getattr(one, name)) is type(getattr(other, name)), name
    assert repr(dict(one.provenance)) == repr(dict(other.provenance))


def measured(levels=(1.5, 2.5), points: int = 5, **changes) -> FrequencyResponse:
    """A plain response with awkward digits."""
    frequency = np.tile(np.linspace(100.0, 200.0, points) + 1 / 3, len(levels))
    known = {
        "unit": "ADSS",
        "gain_std_db": 0.1 + 1e-9 * frequency,
        "phase_std_deg": np.pi / frequency,
        "dc_v": -frequency / 7,
        "harmonic3": 1j / frequency,
        "flags": np.arange(len(frequency)) % 4,
        "direction": "down",
        "settle_cycles": 20,
        "integrate_cycles": 30,
        "from_rest": False,
        "provenance": {"kind": "measured", "notes": "line\nline; 50 Ω — 'x'", "list": [1, 0.1]},
    }
    return FrequencyResponse.from_arrays(
        frequency, np.repeat(levels, points), np.exp(-1j * frequency) / 3, **(known | changes)
    )


def _numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


_finite = _numbers(-1e9, 1e9)
_maybe = st.one_of(st.just(math.nan), _numbers(0.0, 1e6))
_json = st.recursive(
    st.none() | st.booleans() | st.integers() | _finite | st.text(max_size=90),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=9), inner),
    max_leaves=6,
)


@st.composite
def responses(draw: st.DrawFn) -> FrequencyResponse:
    """Any response that can be written."""
    rows = draw(st.integers(1, 12))

    def column(strategy):
        return draw(st.lists(strategy, min_size=rows, max_size=rows))

    gain = np.array(column(st.builds(complex, _finite, _finite)), dtype=complex)
    phase_known = np.array(column(st.booleans()))
    gain = np.where(phase_known, gain, np.abs(gain))
    flags = np.array(column(st.integers(0, 31)))
    if draw(st.booleans()):
        spoilt = (flags & PointFlag.SPOILT) != 0
        gain[spoilt] = complex(math.nan, math.nan)
    return FrequencyResponse.from_arrays(
        column(_numbers(1e-6, 1e6)),
        column(st.one_of(st.just(math.nan), _numbers(1e-6, 10.0))),
        gain,
        unit=draw(st.text(max_size=99)),
        phase_known=phase_known,
        gain_std_db=column(_maybe),
        phase_std_deg=column(_maybe),
        dc_v=column(st.one_of(st.just(math.nan), _finite)),
        harmonic2=column(st.builds(complex, _finite, _finite)),
        flags=flags,
        direction=draw(st.sampled_from([None, "up", "down"])),
        settle_cycles=draw(st.none() | st.integers(0, 10**6)),
        integrate_cycles=draw(st.none() | st.integers(1, 10**6)),
        from_rest=draw(st.none() | st.booleans()),
        provenance=draw(st.dictionaries(st.text(max_size=9), _json, max_size=4)),
    )
