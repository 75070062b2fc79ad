"""What a session costs per point beside the instrument: bookkeeping, journal, commit and flush.

Run as ``python tests/benchmarks/session_overhead.py [POINTS]``. The analyser
answers at once, so that all the time is the session's. Where the history lies
matters: the flush is the disk's.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from instruments.fake_analyser import FakeAnalyser  # noqa: E402

from daq.limits import Limits  # noqa: E402
from daq.plan import SweepPlan, spaced_frequencies  # noqa: E402
from daq.session import Session  # noqa: E402
from daq.session_events import PointStored  # noqa: E402
from daq.session_request import SessionRequest  # noqa: E402
from daq.store import Store  # noqa: E402
from daq.store_records import MeasurementHeader  # noqa: E402


def overhead_ms(points: int, history: Path) -> np.ndarray:
    """Time between one stored point and the next, ms, shape (points - 1,)."""
    plan = SweepPlan(spaced_frequencies(100.0, 200.0, points), (1.0,))
    header = MeasurementHeader("ADSS", "", plan, "fake:", "benchmark")
    moments = []
    with Store(history, create=True) as store:
        for event in Session(FakeAnalyser(), store, SessionRequest(header, (Limits("b"),))).run():
            if isinstance(event, PointStored):
                moments.append(time.perf_counter())
    return 1e3 * np.diff(moments)


def main() -> None:
    points = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    with tempfile.TemporaryDirectory(dir=".") as folder:
        took = overhead_ms(points, Path(folder) / "bench.db")
    shown = ", ".join(f"{value:.2f}" for value in np.quantile(took, [0.5, 0.9, 0.99, 1.0]))
    print(f"session overhead over {points} points: {shown} ms at 50, 90, 99 and 100 %")


if __name__ == "__main__":
    main()
