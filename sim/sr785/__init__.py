"""The simulated Stanford Research Systems SR785: its language, its status words, its swept sine.

Where its manual is silent or contradicts itself it takes the unkind reading; `choices` lists every
such choice. It knows nothing of any program that drives it.
"""

from sim.sr785.choices import Choices
from sim.sr785.instrument import SR785

__all__ = ["SR785", "Choices"]
