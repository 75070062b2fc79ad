"""What a system asks to be stepped, heard on the way, and what it is told changed.

Owns the wrapper of who asks (`sim.engine.engine.carry`). It steps nothing.
"""

from dataclasses import replace

import numpy as np


def overheard(asking, hear):
    """The same asker; it is told what `hear(steps, stepped)` makes of each answer."""
    try:
        steps = next(asking)
        while True:
            stepped = yield steps
            steps = asking.send(hear(steps, stepped))
    except StopIteration as end:
        return end.value


def growing(asking, grows):
    """The same asker; it finds that a motion grew without bound where `grows(steps)` says so."""

    def hear(steps, stepped):
        return replace(stepped, sums=stepped.sums * np.nan) if grows(steps) else stepped

    return overheard(asking, hear)
