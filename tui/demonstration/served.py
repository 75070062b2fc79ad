"""A simulated analyser on a socket of this computer, in a thread beside the one that measures.

Owns the thread and its end. What measures reaches it by its address alone, as
it would an instrument on the laboratory's network.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sim.effects import EffectSetting
    from sim.unit import Unit

__all__ = ["served"]


@contextmanager
def served(unit: Unit, ratio: float, effect: EffectSetting, seed: int) -> Iterator[str]:
    """Serve a unit with an effect in it until the block ends; yields the instrument's address.

    Raises
    ------
    LinkError
        If no port can be had.
    """
    from sim.models import Bench, model_of
    from sim.response import SteppedServo
    from sim.serve import Server

    servo = SteppedServo(unit, ratio, (effect,), seed=seed)
    # The first dwell may compile the engine, for longer than a client waits for a reply.
    servo.dwell(1000.0, 1.0, 0.0, 0, 1)
    servo.rest()
    instrument = model_of("").build(servo, Bench(seed=seed))
    with Server(instrument, realtime=False, tcp=0) as server:
        thread = threading.Thread(target=server.run, name="simulated analyser", daemon=True)
        thread.start()
        try:
            host, port = server.addresses["tcp"].rsplit(":", 1)
            yield f"TCPIP::{host}::{port}::SOCKET"
        finally:
            server.stop()
            thread.join()
