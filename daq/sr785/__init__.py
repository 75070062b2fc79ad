"""The Stanford Research Systems SR785 and SR780 as swept-sine analysers.

Owns everything that is particular to them. Nothing here was watched on a real instrument;
docs/sr785.md lists what to check there first.
"""

from daq.sr785.analyser import SR785

__all__ = ["SR785"]
