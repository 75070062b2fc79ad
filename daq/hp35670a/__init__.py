"""The HP/Agilent 35670A as a swept-sine analyser (Option 1D2).

Owns everything that is particular to it. Nothing here was watched on a real instrument;
docs/instrument.md lists what to check there first.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from daq.hp35670a.analyser import HP35670A, Method

__all__ = ["HP35670A", "Method"]


def __getattr__(name: str) -> object:
    # The table of drivers imports this package of every instrument, numpy only of the one in use.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from daq.hp35670a import analyser

    return getattr(analyser, name)
