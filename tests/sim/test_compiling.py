"""What numba is told: vectors as wide as the machine's."""

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


@compiling.njit
def _scale(source, target, by):
    for i in range(source.shape[0]):
        target[i] = by * source[i]


@pytest.mark.skipif(
    not llvm.get_host_cpu_features().get("avx512f"), reason="this machine has no wide vectors"
)
def test_loops_are_compiled_in_whole_vectors():
    source, target = np.arange(100.0), np.zeros(100)
    _scale(source, target, 3.0)
    assert np.array_equal(target, 3.0 * source)
    assert WISH in numba.config.CPU_FEATURES
    (assembly,) = _scale.inspect_asm().values()
    assert "zmm" in assembly
