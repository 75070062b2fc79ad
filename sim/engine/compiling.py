"""numba, told to use vectors as wide as the machine's, and to keep what it compiles in safe places.

Owns these two wishes alone. Whoever compiles with numba takes `njit` from here: the first
counts only if it is told before anything is compiled. (numba's cache on disk does not look at this
file: after a change here, empty the `__pycache__` folders.)
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

import numba
from numba.core import config

from daq.untrusted.trust import distrust, fresh_folder, own_folder, pass_over
from sim.engine.machine_code import code_folder, has_wide_vectors, machine_features

__all__ = ["njit", "part"]


def _ask_for_whole_vectors() -> None:
    """Have vectors as wide as the machine's: the compiler halves them on Intel's AVX-512.

    That is for code that uses them now and then. It holds for all that numba compiles in this
    process, if it has not compiled anything yet; what a user set in its environment stays.
    """
    settings: Any = config
    if settings.CPU_FEATURES or settings.CPU_NAME or not settings.ENABLE_AVX:
        return
    if has_wide_vectors():
        settings.CPU_FEATURES = machine_features()


_ask_for_whole_vectors()


def njit(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Numba's own decorator, whose cache lies where nobody else can write: it holds code.

    Its index is a pickle, which runs code as well. Where others could have written into the folder
    that numba would take, the function is kept in a folder of lashbench instead.
    """

    def compiling(function: Callable[..., Any]) -> Any:
        settings: Any = config
        before = settings.CACHE_DIR
        if options.get("cache"):
            settings.CACHE_DIR = _safe_place(Path(function.__code__.co_filename).parent, before)
        try:
            return numba.njit(**options)(function)
        finally:
            # Other functions of this process are their owner's.
            settings.CACHE_DIR = before

    return compiling if function is None else compiling(function)


@cache
def _safe_place(source: Path, given: str) -> str:
    """What numba is to be told of its cache for functions of a source folder; "" for nothing."""
    beside = source / "__pycache__"
    if given:
        fault = distrust(Path(given)) if os.path.exists(given) else None
        if fault is None:
            fault = _planted(*Path(given).glob(f"{source.name}_*"))
        if fault is None:
            return given
        pass_over(fault)
    elif beside.is_dir() and os.access(beside, os.W_OK) and _planted(beside) is None:
        return ""
    own = own_folder(code_folder().with_name("numba"))
    if _planted(*own.glob(f"{source.name}_*")) is None and os.access(own, os.W_OK):
        return str(own)
    return str(fresh_folder() / "numba")


def _planted(*folders: Path) -> str | None:
    """Why others could have changed what numba kept in some folders; None if nobody could."""
    for folder in folders:
        for place in (folder, *folder.glob("*.nb[ci]")):
            fault = distrust(place)
            if fault is not None:
                return fault
    return None


_NOT_FROM_PYTHON: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
"""Numba's own types do not know these two; its compiler does."""

part = partial(njit, error_model="numpy", nogil=True, **_NOT_FROM_PYTHON)
"""For a part of a compiled function, called by others alone: what would let Python call it is a
share of the time to compile."""
