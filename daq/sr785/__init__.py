"""The Stanford Research Systems SR785 and SR780 as swept-sine analysers.

Owns everything that is particular to them. Nothing here was watched on a real instrument;
docs/sr785.md lists what to check there first.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from daq.sr785.analyser import SR785

__all__ = ["SR785"]


def __getattr__(name: str) -> object:
    # The table of drivers imports this package of every instrument, numpy only of the one in use.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from daq.sr785 import analyser

    return getattr(analyser, name)
