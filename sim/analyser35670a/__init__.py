"""The simulated HP 35670A: its language, its status model, its swept sine.

Owns the instrument as a controller on the bus meets it. It opens no port (see
`sim.serve`), and what its device under test does is `sim.response`'s matter.
"""

from sim.analyser35670a.choices import Choices
from sim.analyser35670a.instrument import Analyser35670A
from sim.instrument.bus import Talk, TalkState
from sim.instrument.plant import LinearPlant, Plant

__all__ = ["Analyser35670A", "Choices", "LinearPlant", "Plant", "Talk", "TalkState"]
