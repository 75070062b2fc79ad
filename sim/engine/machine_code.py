"""From the text of a program to a function that runs, and the folder that keeps what was compiled.

Owns what the compiler is told of the machine, and what is kept on disk. It writes no program.
"""

from __future__ import annotations

import ctypes
import hashlib
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any

import llvmlite
import llvmlite.binding as llvm
from platformdirs import user_cache_path

from daq.formats.atomic import keeping
from daq.untrusted.trust import own_folder, read_own

__all__ = [
    "architecture",
    "code_folder",
    "compiled",
    "has_wide_vectors",
    "machine_features",
    "multiplies_and_adds",
]

_INT, _POINTER = ctypes.c_int64, ctypes.c_void_p
_KIND = ctypes.CFUNCTYPE(None, *[_POINTER] * 3, *[_INT] * 3, _POINTER)

_MARK = hashlib.sha256

_LOCK = Lock()
"""The compiler is asked for one thing at a time."""

_ALIVE: list[Any] = []
"""What holds the memory in which compiled functions lie."""


def code_folder() -> Path:
    """Where what was compiled is kept if no other user may write there; XDG_CACHE_HOME moves it."""
    return user_cache_path("lashbench", appauthor=False) / "code"


def architecture() -> str:
    """The family of processors that the machine belongs to: "x86", "arm", or "" for others."""
    triple = llvm.get_process_triple()
    known = {"x86_64": "x86", "amd64": "x86", "aarch64": "arm", "arm64": "arm"}
    return known.get(triple.split("-")[0], "")


def multiplies_and_adds() -> bool:
    """Whether the machine multiplies and adds in one instruction."""
    return architecture() == "arm" or bool(llvm.get_host_cpu_features().get("fma"))


def has_wide_vectors() -> bool:
    """Whether the machine computes with vectors of 64 bytes, and has 32 registers of them."""
    return bool(llvm.get_host_cpu_features().get("avx512f"))


def machine_features() -> str:
    """What a compiler is told of this machine; with AVX-512 whole vectors, which it halves else."""
    wide = ",-prefer-256-bit" if has_wide_vectors() else ""
    return f"{llvm.get_host_cpu_features().flatten()}{wide}"


def compiled(name: str, sources: Sequence[Path], write: Callable[[], str]) -> Any:
    """The function "step" of a program, kept from run to run.

    Parameters
    ----------
    name
        What tells this program from others that the same sources write.
    sources
        Files that decide what the program is: where one changes it is compiled anew.
    write
        Gives the program, if it was not kept.
    """
    with _LOCK:
        key = f"{name} {_target_text()} {_sources_mark(tuple(sources))}"
        file = own_folder(code_folder()) / f"{_MARK(key.encode()).hexdigest()[:24]}.code"
        program = _read(file)
        if program is None:
            program = _compile(write())
            _keep(file, program)
        engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target_machine())
        engine.add_object_file(llvm.ObjectFileRef.from_data(program))
        engine.finalize_object()
        _ALIVE.append(engine)
        return _KIND(engine.get_function_address("step"))


def _compile(text: str) -> bytes:
    module = llvm.parse_assembly(text)
    module.verify()
    # The program has no loops over lanes and nothing to simplify: only registers are to be found.
    return bytes(target_machine().emit_object(module))


def target_machine() -> Any:
    """What machine code is made for: this processor, with the instructions that are used."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_triple(llvm.get_process_triple())
    return target.create_target_machine(
        cpu=llvm.get_host_cpu_name(), features=machine_features(), opt=3, jit=True
    )


@cache
def _target_text() -> str:
    return f"{llvmlite.__version__} {llvm.get_host_cpu_name()} {machine_features()}"


@cache
def _sources_mark(sources: tuple[Path, ...]) -> str:
    return _MARK(b"".join(file.read_bytes() for file in sources)).hexdigest()


def _read(file: Path) -> bytes | None:
    """What was kept, or None where it is not what was written: half a program would crash.

    Nor is it run where others could have written it.
    """
    kept = read_own(file)
    size = _MARK().digest_size
    if kept is not None and kept[:size] == _MARK(kept[size:]).digest():
        return kept[size:]
    return None


def _keep(file: Path, program: bytes) -> None:
    """Keep what was compiled; a folder that cannot be written costs time later and nothing else."""
    with keeping(file) as stream:
        stream.write(_MARK(program).digest() + program)
