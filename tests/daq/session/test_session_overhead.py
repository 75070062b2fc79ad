"""The bound on what a session costs per point; the benchmark prints the distribution."""

import time

from instruments.fake_analyser import FakeAnalyser

from daq.limits import Limits
from daq.plan import SweepPlan, spaced_frequencies
from daq.session import Session
from daq.session_events import PointStored
from daq.session_request import SessionRequest
from daq.store import Store
from daq.store_records import MeasurementHeader


def test_point_costs_under_five_milliseconds_with_commit(tmp_path):
    plan = SweepPlan(spaced_frequencies(100.0, 200.0, 300), (1.0,))
    header = MeasurementHeader("ADSS", "", plan, "fake:", "test")
    moments = []
    with Store(tmp_path / "bench.db", create=True) as store:
        for event in Session(FakeAnalyser(), store, SessionRequest(header, (Limits("b"),))).run():
            if isinstance(event, PointStored):
                moments.append((time.perf_counter(), time.process_time()))
    count = len(moments) - 1
    wall_s, busy_s = (last - first for last, first in zip(moments[-1], moments[0], strict=True))
    assert count == 299
    assert busy_s / count < 2.5e-3
    assert wall_s / count < 5e-3
