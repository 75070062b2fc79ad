"""numba, told to use vectors as wide as the machine's.

Owns that wish alone. Whoever compiles with numba takes `njit` from here, which is
numba's own: the wish counts only if it is told before anything is compiled. (numba's cache on
disk does not look at this file: after a change here, empty the `__pycache__` folders.)
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numba
from numba import njit

from sim.machine_code import has_wide_vectors, machine_features

__all__ = ["njit", "part"]


def _ask_for_whole_vectors() -> None:
    """Have vectors as wide as the machine's: the compiler halves them on Intel's AVX-512.

    That is for code that uses them now and then. It holds for all that numba compiles in this
    process, if it has not compiled anything yet; what a user set in its environment stays.
    """
    settings: Any = numba.config
    if settings.CPU_FEATURES or settings.CPU_NAME or not settings.ENABLE_AVX:
        return
    if has_wide_vectors():
        settings.CPU_FEATURES = machine_features()


_ask_for_whole_vectors()

_NOT_FROM_PYTHON: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Numba's own types do not know these two; its compiler does."""

part = partial(njit, error_model="numpy", nogil=True, **_NOT_FROM_PYTHON)
"""For a part of a compiled function, called by others alone: what would let Python call it is a
share of the time to compile."""
