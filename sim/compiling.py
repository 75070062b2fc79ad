"""What the machine's compiler is told about the engine's loops.

Owns the decorators of compiled code, and the promises and wishes behind them. It
holds no loop itself. Whoever compiles takes `njit` from here too, which is numba's own:
the wishes count only if they are told before anything is compiled. (numba's cache on
disk does not look at this file: after a change here, empty the `__pycache__` folders.)
"""

from __future__ import annotations

from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from numba import njit
from numba.core import ir, types
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.untyped_passes import FindLiterallyCalls

__all__ = ["law", "loop", "njit", "part"]

_FLAGS = {"contract"}
"""Fused multiply-add, but no re-ordering: a lane's result does not depend on its neighbours, and
NaN stays NaN."""


def _ask_for_whole_vectors() -> None:
    """Have vectors as wide as the machine's: the compiler halves them on Intel's AVX-512.

    That is for code that uses them now and then. It holds for all that numba compiles in this
    process, if it has not compiled anything yet; what a user set in its environment stays.
    """
    settings: Any = numba.config
    if settings.CPU_FEATURES or settings.CPU_NAME or not settings.ENABLE_AVX:
        return
    features = llvm.get_host_cpu_features()
    if features.get("avx512f"):
        settings.CPU_FEATURES = f"{features.flatten()},-prefer-256-bit"


@register_pass(mutates_CFG=False, analysis_only=False)
class _SinglePrecision(FunctionPass):
    """Makes constants single where the arrays are.

    One double constant makes a double of all that it meets, and half as many go into a vector.
    """

    _name = "single_precision"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        dtypes = {a.dtype for a in state.args if isinstance(a, types.Array)}
        if types.float32 not in dtypes:
            return False
        for block in state.func_ir.blocks.values():
            for assign in block.find_insts(ir.Assign):
                constant = assign.value
                if isinstance(constant, ir.Const) and isinstance(constant.value, float):
                    assign.value = ir.Const(np.float32(constant.value), constant.loc)
        return True


class _OfOnePrecision(Compiler):
    """Compiles functions that work in the precision of their array arguments."""

    def define_pipelines(self) -> list[Any]:
        managers = super().define_pipelines()
        for manager in managers:
            # After this pass the laws stand where they were called.
            manager.add_pass_after(_SinglePrecision, FindLiterallyCalls)
            manager.finalize()
        return managers


class _Apart(_OfOnePrecision):
    """The same where array arguments do not overlap, as a promise and unchecked."""

    def define_pipelines(self) -> list[Any]:
        self.state.flags.noalias = True
        return super().define_pipelines()


_ask_for_whole_vectors()

# Numba's own types do not know these two; its compiler does.
_NOT_FROM_PYTHON: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_NOT_FROM_C: dict[str, Any] = {"no_cfunc_wrapper": True}

law = njit(inline="always", fastmath=_FLAGS, error_model="numpy")
"""For a scalar law, inlined by numba."""

part = njit(
    pipeline_class=_Apart,
    forceinline=True,
    fastmath=_FLAGS,
    error_model="numpy",
    **_NOT_FROM_PYTHON,
)
"""For a part of a loop, inlined by the machine's compiler; its arrays must not overlap. It cannot
be called from Python: what that takes is a tenth of the time to compile."""

loop = njit(
    cache=True,
    pipeline_class=_OfOnePrecision,
    fastmath=_FLAGS,
    error_model="numpy",
    nogil=True,
    **_NOT_FROM_C,
)
"""For a whole loop, kept on disk; other threads run beside it."""
