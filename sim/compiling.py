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
from numba import njit
from numba.core.compiler import Compiler

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


class _Apart(Compiler):
    """Compiles functions whose array arguments do not overlap, as a promise and unchecked."""

    def define_pipelines(self):
        self.state.flags.noalias = True
        return super().define_pipelines()


_ask_for_whole_vectors()

law = njit(inline="always", fastmath=_FLAGS, error_model="numpy")
"""For a scalar law, inlined by numba."""

part = njit(pipeline_class=_Apart, forceinline=True, fastmath=_FLAGS, error_model="numpy")
"""For a part of a loop, inlined by the machine's compiler; its arrays must not overlap."""

loop = njit(cache=True, fastmath=_FLAGS, error_model="numpy", nogil=True)
"""For a whole loop, kept on disk; other threads run beside it."""
