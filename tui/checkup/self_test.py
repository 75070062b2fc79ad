"""The self-test: a short session on the simulated analyser, held against known answers.

Owns those answers. Driver, session, history and engine are the ones that every
measurement uses; nothing outside a temporary folder is touched.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from daq.errors import LashbenchError
from tui.checkup.finding import Finding, failed, passed

__all__ = ["KNOWN_DB", "TOLERANCE_DB", "check_itself"]

KNOWN_DB = {20.0: 5.98, 40.0: 0.02, 60.0: -4.46}
"""Gain of the paper's ADSS with 30 % of its play in stage 1, 2.5 V peak, by frequency in Hz."""

TOLERANCE_DB = 0.4
"""Beyond the scatter over the simulation's seeds, far below the effect of a wrong engine."""

SERVED = "sim:?ratio=0.3&seed=1"
_LEVEL_VPK = 2.5
_REMEDY = "set lashbench up again; if that does not help, report this line"


def check_itself(address: str = SERVED) -> Iterator[Finding]:
    """Measure three points on the simulated analyser and compare them."""
    began = time.perf_counter()
    try:
        state, gains = _measured_db(address)
    except LashbenchError as error:
        yield failed("self-test", f"the session failed: {error}", _REMEDY)
        return
    if state != "confirmed-off":
        yield failed("self-test", f"the source was left {state}", _REMEDY)
        return
    wrong = [
        f"{frequency:g} Hz reads {gains[frequency]:.2f} dB, {known:.2f} is right"
        if frequency in gains
        else f"{frequency:g} Hz was not measured"
        for frequency, known in KNOWN_DB.items()
        if abs(gains.get(frequency, float("inf")) - known) > TOLERANCE_DB
    ]
    if wrong:
        yield failed("self-test", "; ".join(wrong), _REMEDY)
        return
    elapsed = time.perf_counter() - began
    yield passed("self-test", f"a session on the simulated analyser reads right, {elapsed:.1f} s")


def _measured_db(address: str) -> tuple[str, dict[float, float]]:
    """The state of the source after the session, and the gain in dB by frequency in Hz."""
    from daq.control import SessionControl
    from daq.session_events import Finished
    from daq.store import Store
    from sim.unit import load_unit
    from tui.bench import bench_session
    from tui.measure_options import PlanOptions, session_request

    unit, state = load_unit("adss"), "unknown"
    options = PlanOptions(
        (_LEVEL_VPK,), min(KNOWN_DB), max(KNOWN_DB), len(KNOWN_DB),
        settle_cycles=20, integrate_cycles=20,
    )  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="lashbench-doctor-") as folder:
        history = Path(folder) / "self-test.db"
        request = session_request(
            options, "adss", unit, address, history,
            recipe=None, bench="default", resume=None, remeasure=None, run_in=None,
            remarks={"serial": "", "operator": "self-test", "notes": ""},
        )  # fmt: skip
        for event in bench_session(address, unit, history, request, SessionControl()):
            if isinstance(event, Finished):
                state = event.source_state.value
        with Store(history, read_only=True) as store:
            response = store.response(store.measurements()[-1].id)
    gains = zip(response.frequency_hz.tolist(), response.gain_db.tolist(), strict=True)
    return state, {round(frequency, 6): gain for frequency, gain in gains}
