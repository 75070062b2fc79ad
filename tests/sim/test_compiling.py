"""What the engine's compiler is told: vectors as wide as the machine's, and arrays apart."""

from __future__ import annotations

import llvmlite.binding as llvm
import numba
import numpy as np
import pytest

from sim import compiling

WISH = "-prefer-256-bit"


@pytest.fixture
def settings(monkeypatch):
    """numba's settings as they are where nobody set anything; put back afterwards."""
    for name, value in {"CPU_FEATURES": None, "CPU_NAME": None, "ENABLE_AVX": 1}.items():
        monkeypatch.setattr(numba.config, name, value)
    return numba.config


@pytest.mark.parametrize("wide", [True, False])
def test_whole_vectors_are_asked_for_where_the_machine_has_them(settings, monkeypatch, wide):
    features = llvm.FeatureMap({"sse2": True, "avx512f": wide})
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: features)
    compiling._ask_for_whole_vectors()
    assert (f"+avx512f,+sse2,{WISH}" if wide else None) == settings.CPU_FEATURES


@pytest.mark.parametrize(
    ("name", "value"), [("CPU_FEATURES", "+sse2"), ("CPU_NAME", "generic"), ("ENABLE_AVX", 0)]
)
def test_what_a_user_set_stays(settings, monkeypatch, name, value):
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: llvm.FeatureMap({"avx512f": True}))
    monkeypatch.setattr(settings, name, value)
    compiling._ask_for_whole_vectors()
    assert getattr(settings, name) == value
    assert WISH not in (settings.CPU_FEATURES or "")


@compiling.part
def _scale(source, target, by):
    for i in range(source.shape[0]):
        target[i] = by * source[i]


@numba.njit
def _scaled_twice(source, target, by):
    _scale(source, target, by)
    _scale(target, source, by)


@pytest.mark.skipif(
    not llvm.get_host_cpu_features().get("avx512f"), reason="this machine has no wide vectors"
)
def test_a_part_is_compiled_in_whole_vectors():
    source, target = np.arange(100.0), np.zeros(100)
    _scaled_twice(source, target, 3.0)
    assert np.array_equal(source, 9.0 * np.arange(100.0))
    assert WISH in numba.config.CPU_FEATURES
    (assembly,) = _scaled_twice.inspect_asm().values()
    assert "zmm" in assembly


@compiling.law
def _third(x):
    return 0.1 * x + 1.0 / 3.0


@compiling.part
def _take_thirds(source, target):
    for i in range(source.shape[0]):
        target[i] = _third(source[i])


@numba.njit(pipeline_class=compiling._OfOnePrecision)
def _thirds(source, target):
    _take_thirds(source, target)
    for i in range(source.shape[0]):
        target[i] *= 0.7


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_constants_have_the_precision_of_the_arrays(precision):
    source = np.linspace(0.0, 1.0, 1000).astype(precision)
    target = np.zeros_like(source)
    _thirds(source, target)
    tenth, third, last = (precision(c) for c in (0.1, 1.0 / 3.0, 0.7))
    assert np.allclose(target, (tenth * source + third) * last, rtol=4.0 * np.finfo(precision).eps)
    (signature,) = (s for s in _thirds.signatures if s[0].dtype.name == np.dtype(precision).name)
    # A single double constant would widen the vectors, and narrow what comes out.
    assert ("double" in _thirds.inspect_llvm(signature)) == (precision is np.float64)
