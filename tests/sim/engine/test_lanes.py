"""Arithmetic that is written with lanes, run and held against numpy, value by value."""

from __future__ import annotations

import ctypes
import operator
from fractions import Fraction

import llvmlite.binding as llvm
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from llvmlite import ir

from sim.engine import machine_code
from sim.engine.lanes import VECTOR_BYTES, Code, Lanes, between, greatest, least
from sim.engine.laws import PlayOverStep, friction_force, peaked_friction, play_force

ALIVE = []


def machine(expression, inputs, single, fused=None, branches=False):
    """A function that gives what an expression of lanes makes of `inputs` columns of numbers."""
    dtype = np.float32 if single else np.float64
    module, integer = ir.Module(), ir.IntType(64)
    scalar = ir.FloatType() if single else ir.DoubleType()
    pointer = scalar.as_pointer()
    function = ir.Function(module, ir.FunctionType(ir.VoidType(), [pointer, pointer]), "run")
    emit = ir.IRBuilder(function.append_basic_block())
    fused = machine_code.multiplies_and_adds() if fused is None else fused
    code = Code(module, emit, single, fused, branches)
    width, vectors = code.width, 2

    def at(base, place):
        start = emit.gep(base, [integer(place)])
        return emit.bitcast(start, code.vector.as_pointer())

    numbers = [
        Lanes(code, [emit.load(at(function.args[0], (k * vectors + v) * width), align=4)
                     for v in range(vectors)])
        for k in range(inputs)
    ]  # fmt: skip
    result = expression(*numbers).lanes()
    for v, vector in enumerate(result.vectors):
        emit.store(vector, at(function.args[1], v * width), align=4)
    emit.ret_void()
    target = machine_code.target_machine()
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(str(module)), target)
    engine.finalize_object()
    ALIVE.append(engine)
    kind = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
    call = kind(engine.get_function_address("run"))

    def run(columns):
        given_numbers, count = np.zeros((inputs, vectors * width), dtype), np.shape(columns)[1]
        given_numbers[:, :count] = columns
        given_numbers[:, count:] = given_numbers[:, :1]
        found = np.zeros(vectors * width, dtype)
        call(given_numbers.ctypes.data, found.ctypes.data)
        return found[:count]

    return run


def computed(expression, columns, single, fused=None):
    """What an expression of lanes gives for columns (k, lanes) of numbers."""
    return machine(expression, len(columns), single, fused)(columns)


A = np.array([1.5, -2.0, 0.0, 1e-3, 7.0, -0.25, 3.0])
B = np.array([0.5, 4.0, -1.0, -1e-3, 7.0, 2.0, -3.0])
C = np.array([-0.75, 8.0, 0.5, 1e-6, -49.0, 0.5, 9.0])


@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize(
    "expression",
    [
        operator.add, operator.sub, operator.mul, operator.truediv,
        lambda a, b: 2.0 - a, lambda a, b: 3.0 * b, lambda a, b: 1.0 / b, lambda a, b: a * b / b,
        lambda a, b: -(a * b), lambda a, b: abs(a * b), lambda a, b: a * b - 0.5,
        lambda a, b: 0.5 - a * b, lambda a, b: a * b * b, lambda a, b: b - a * b,
        lambda a, b: a * b + a * b,
    ],
)  # fmt: skip
def test_every_operation_is_numpys(expression, single):
    dtype = np.float32 if single else np.float64
    a, b = A.astype(dtype), B.astype(dtype)
    rounding = float(4.0 * np.finfo(dtype).eps)
    assert computed(expression, [a, b], single) == pytest.approx(
        expression(a, b), rel=rounding, abs=rounding
    )


@pytest.mark.parametrize("single", [False, True])
def test_choices_and_bounds_are_numpys(single):
    for way in (operator.lt, operator.le, operator.gt, operator.ge):
        found = computed(lambda a, b, way=way: way(a, b).choose(a, 2.0), [A, B], single)
        assert np.array_equal(found, np.where(way(A, B), A, 2.0).astype(found.dtype))
    found = computed(lambda a, b: a.is_zero().choose(1.0, a * b), [A, B], single)
    assert np.allclose(found, np.where(A == 0.0, 1.0, A * B))
    for ours, numpys in ((least, np.minimum), (greatest, np.maximum)):
        found = computed(ours, [A, B], single)
        assert np.array_equal(found, numpys(A, B).astype(found.dtype))
    found = computed(lambda a, b: between(a, -abs(b), abs(b)), [A, B], single)
    assert np.array_equal(found, np.clip(A, -abs(B), abs(B)).astype(found.dtype))
    found = computed(lambda a, b: a.equals(b).choose(1.0, 2.0), [A, B], single)
    assert np.array_equal(found, np.where(A == B, 1.0, 2.0))


@pytest.mark.parametrize("single", [False, True])
def test_signs_match_numpy_including_zeros(single):
    b = np.array([0.5, -4.0, -1.0, -1e-3, 0.0, -0.0, -3.0])
    for ours, wanted in (
        (Lanes.signed_as, np.copysign(A, b)),
        (Lanes.signed_by, A * np.copysign(1.0, b)),
        (lambda a, b: a.signed_as(-b), np.copysign(A, -b)),
    ):
        found = computed(ours, [A, b], single)
        assert np.array_equal(found, wanted.astype(found.dtype))
        assert np.array_equal(np.signbit(found), np.signbit(wanted))


def test_fused_multiply_add_rounds_once():
    if not machine_code.multiplies_and_adds():
        pytest.skip("this machine multiplies and adds one after the other")
    a = np.array([1.0 + 2.0**-30])
    (found,) = computed(lambda a: a * a - 1.0, [a], single=False)
    exact = Fraction(a[0]) ** 2 - 1
    assert Fraction(found) == Fraction(float(exact))
    assert found != a[0] * a[0] - 1.0


def test_machine_without_fused_multiply_rounds_twice():
    a = np.array([1.0 + 2.0**-30, -3.7, 1e-9])
    found = computed(lambda a: a * a - 1.0, [a], single=False, fused=False)
    assert np.array_equal(found, a * a - 1.0)


@pytest.mark.parametrize(
    ("architecture", "triple", "sets"),
    [("x86", "x86_64-unknown-linux-gnu", "ldmxcsr"), ("arm", "aarch64-unknown-linux-gnu", "msr")],
)
def test_denormals_mode_is_set_and_restored(architecture, triple, sets):
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    module = ir.Module()
    emit = ir.IRBuilder(
        ir.Function(module, ir.FunctionType(ir.VoidType(), []), "run").append_basic_block()
    )
    with Code(module, emit, True, True).without_denormals(architecture):
        pass
    emit.ret_void()
    target = llvm.Target.from_triple(triple).create_target_machine()
    text = target.emit_assembly(llvm.parse_assembly(str(module)))
    assert text.count(f"\t{sets}\t") == 2


def test_unknown_architecture_keeps_denormals_setting():
    module = ir.Module()
    emit = ir.IRBuilder(
        ir.Function(module, ir.FunctionType(ir.VoidType(), []), "run").append_basic_block()
    )
    with Code(module, emit, True, True).without_denormals(""):
        pass
    emit.ret_void()
    assert "call" not in str(module).split("define")[1]


def test_nan_stays_in_its_lane():
    a = np.array([1.0, np.nan, 3.0])
    found = computed(lambda a, b: a * b + a, [a, a], single=True)
    assert np.array_equal(np.isnan(found), [False, True, False])


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=VECTOR_BYTES // 8))
def test_lane_does_not_depend_on_neighbours(numbers):
    def expression(a):
        return (a * a + 1.0) / (abs(a) + 2.0) - a * 0.3

    together = computed(expression, [np.array(numbers)], single=False)
    alone = [computed(expression, [np.array([one])], single=False)[0] for one in numbers]
    assert np.array_equal(together, alone)


def test_stribeck_curve_has_stated_accuracy():
    w = np.linspace(-3.0, 3.0, 15)
    one = np.ones_like(w)
    for part in (slice(0, 8), slice(7, 15)):
        found = computed(peaked_friction, [w[part], one[part], 2.0 * one[part], 0.5 * one[part]],
                         single=False)  # fmt: skip
        assert found == pytest.approx(1.0 + 2.0 * np.exp(-((w[part] / 0.5) ** 2)), abs=2e-5)


D, HALF, DAMP = 1e-3, -0.05, -0.01
"""A play, and half k beta and (c/h) beta of a step, as those of the paper's units."""
EDGES = D * np.array([-3.0, -1.0 - 1e-9, -1.0, -1.0 + 1e-9, 0.0, 0.4, 1.0 - 1e-9, 1.0, 1.5])


def play(y0, ahead):
    """The force of a play of that size."""
    away = HALF + DAMP
    fixed = 0.5e4, 1e3, HALF, HALF - DAMP, away, away - 1.0, 1.0 / (1.0 - away)
    return play_force(y0, ahead, y0.like(D), y0.like(-D), PlayOverStep(*map(y0.like, fixed)))


def friction(w0, ahead):
    """The force of a friction that slows motion down by `D` a step at most."""
    return friction_force(w0, ahead, w0.like(0.1), w0.like(D), w0.like(0.1 / D))


@pytest.mark.parametrize("law", [play, friction])
def test_short_cut_is_bit_equal(law):
    plain, branching = (machine(law, 2, single=False, branches=b) for b in (False, True))
    rng = np.random.default_rng(0)
    random = D * rng.normal(scale=2.0, size=(2, 400))
    cases = np.hstack([[np.repeat(EDGES, len(EDGES)), np.tile(EDGES, len(EDGES))], random,
                       [[np.nan, 0.0, D, np.inf], [0.0, np.nan, -np.inf, D]]])  # fmt: skip
    # Alone a case goes its own way; among others all lanes go the long way as soon as one must.
    for case in cases.T[:, :, None]:
        np.testing.assert_array_equal(branching(case), plain(case))
    for first in range(0, cases.shape[1], 5):
        some = cases[:, first : first + 5]
        np.testing.assert_array_equal(branching(some), plain(some))


def test_short_cut_needs_all_lanes():
    def expression(a):
        return a.code.short_cut(lambda: (a > 0.0, a.like(1.0)), lambda: a.like(2.0))

    plain, branching = (machine(expression, 1, single=False, branches=b) for b in (False, True))
    assert list(branching([[1.0, 2.0]])) == [1.0, 1.0]
    assert list(branching([[1.0, -2.0]])) == [2.0, 2.0]
    assert list(branching([[1.0, np.nan]])) == [2.0, 2.0]
    assert list(plain([[1.0, 2.0]])) == [2.0, 2.0]
