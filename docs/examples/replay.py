"""Record what crosses the wire, then run the same session again from the record alone."""

from contextlib import closing
from pathlib import Path

import numpy as np

from daq.control import SessionControl
from daq.frf import FrequencyResponse
from daq.plan import SweepPlan, spaced_frequencies
from daq.session_request import SessionRequest
from daq.store import Store
from daq.store_records import MeasurementHeader
from sim.unit import load_unit
from tui.bench import bench_session, unit_limits


def measure(instrument: str, history: Path, transcript: Path | None = None) -> FrequencyResponse:
    """One session on an instrument."""
    unit = load_unit("adss")
    plan = SweepPlan(spaced_frequencies(110.0, 170.0, 13), levels_vpk=(2.5,))
    header = MeasurementHeader(unit.name, "SN 7", plan, instrument, "replay.py")
    request = SessionRequest(header, limits=(unit_limits(unit),))
    control = SessionControl()
    with closing(bench_session(instrument, unit, history, request, control, transcript)) as events:
        for _ in events:
            pass
    with Store(history, read_only=True) as store:
        return store.response(store.measurements()[-1].id)


first = measure("sim:?ratio=0.3", Path("first.db"), transcript=Path("wire.jsonl"))
again = measure("replay:wire.jsonl", Path("again.db"))
print(f"{len(again)} points, the same to the last bit: {np.array_equal(first.gain, again.gain)}")
