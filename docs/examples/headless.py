"""Measure without a screen: python headless.py [INSTRUMENT], the simulated one if left out."""

import sys
from contextlib import closing
from pathlib import Path

from analysis.resonance import extract, summary
from daq.control import SessionControl
from daq.limits import load_bench
from daq.plan import SweepPlan, spaced_frequencies
from daq.session_events import Finished, PointStored
from daq.session_request import SessionRequest
from daq.store import Store
from daq.store_records import MeasurementHeader
from sim.unit import load_unit
from tui.bench import bench_session, unit_limits

instrument = sys.argv[1] if len(sys.argv) > 1 else "sim:?ratio=0.3"
history = Path("lab.db")
unit = load_unit("adss")
plan = SweepPlan(spaced_frequencies(110.0, 170.0, 31), levels_vpk=(2.5, 4.0))
header = MeasurementHeader(unit.name, "SN 7", plan, instrument, "headless.py")
request = SessionRequest(header, limits=(load_bench().bounds(), unit_limits(unit)))

# Leaving the loop early, by whatever way, ends the session with the source off.
with closing(bench_session(instrument, unit, history, request, SessionControl())) as events:
    for event in events:
        match event:
            case PointStored():
                point = event.stored.point
                print(event.done, "of", event.total, point.frequency_hz, abs(point.gain))
            case Finished():
                print(f"{event.state}, source {event.source_state.value}")
                number = event.measurement

with Store(history, read_only=True) as store:
    response = store.response(number)
print("\n".join(summary(extract(response))))
