"""Twenty runs of the fault campaign, over all drivers; `make faults` runs hundreds."""

from concurrent.futures import ThreadPoolExecutor
from itertools import chain
from types import SimpleNamespace

import pytest
from fault_bench.fault_cases import BENCHES, DISTURBANCES, Case, can_strike, draw_cases
from fault_bench.fault_child import drives, instrument_of, options, true_gain
from fault_bench.fault_runs import Campaign, Run, Stopwatch

from daq.analyser import SweepPoint
from daq.control import SessionControl
from daq.errors import InstrumentError
from daq.frf import PointFlag
from daq.hp35670a import HP35670A
from daq.plan import SweepPlan
from daq.session_events import PointStored
from daq.store import Store
from daq.store_records import MeasurementHeader
from sim.faults import PHASES
from sim.loopback import Loopback
from sim.models import model_of, models
from sim.unit import load_unit
from tui.bench import bench_session
from tui.measure_options import session_request

KINDS = (
    ("", "tcp", None, "sigint"),
    ("", "prologix_tcp", None, "kill"),
    ("", "loopback", None, "full-disk"),
    ("", "tcp", None, "read-only"),
    ("", "loopback", None, "held-briefly"),
    ("", "tcp", None, "intruder"),
    ("", "tcp", None, "birth"),
    ("", "tcp", None, "watchdog"),
    ("", "loopback", None, "frozen-sigterm"),
    ("", "loopback", None, "lock-link"),
    ("", "tcp", None, "foreign-cache"),
    ("", "ar488_pty", "truncated-block:phase=read-out,point=2", None),
    ("", "tcp", "dropped-connection:phase=sweep,point=5", None),
    ("", "loopback", "hardware-error:phase=sweep,point=9", None),
    ("sr785", "serial_pty", None, "kill"),
    ("sr785", "tcp", "lost-power:phase=sweep,point=15,seconds=0.3", None),
)
LONG_KINDS = (
    ("sr785", "tcp", None, "sigint"),
    ("sr785", "prologix_tcp", None, "intruder"),
    ("sr785", "ar488_pty", "truncated-block:phase=read-out,point=14", None),
    ("sr785", "loopback", "key-pressed:phase=sweep,point=15", None),
)
"""Done to the other instrument every day, or provoked by `test_faults.py`."""


def case(number, driver, wire, fault, disturbance):
    # Early enough that no program has come to its end before it is disturbed.
    return Case(number, driver, wire, fault, disturbance, after=2, delay_s=0.0, seed=number)


def was_struck(outcome):
    return outcome.fault_struck if outcome.case.fault else outcome.disturbed


def run_until_struck(campaign, planned):
    """On a busy machine a program may end before it is disturbed; such a run tells nothing."""
    for _ in range(3):
        outcome = campaign.run(planned)
        if outcome.wrongs or was_struck(outcome):
            break
    return outcome


def run_all(kinds):
    campaign = Campaign()
    with pytest.MonkeyPatch.context() as patch, ThreadPoolExecutor(4) as pool:
        # A hang is found all the same, and a busy machine is none.
        patch.setattr("fault_bench.fault_runs.END_S", 240.0)
        planned = [case(number, *kind) for number, kind in enumerate(kinds)]
        return list(pool.map(lambda one: run_until_struck(campaign, one), planned))


@pytest.fixture(scope="module")
def outcomes():
    return run_all(KINDS)


@pytest.mark.long
def test_campaign_on_other_instrument_keeps_promises():
    outcomes = run_all(LONG_KINDS)
    assert list(chain.from_iterable(outcome.wrongs for outcome in outcomes)) == []
    assert all(map(was_struck, outcomes))


@pytest.mark.slow
def test_campaign_finds_no_broken_promise(outcomes):
    assert list(chain.from_iterable(outcome.wrongs for outcome in outcomes)) == []


def test_every_planned_fault_occurred(outcomes):
    for outcome in outcomes:
        assert was_struck(outcome), outcome.case
    by_kind = {
        (o.case.wire, o.case.fault_name, o.case.disturbance): o.code
        for o in outcomes
        if o.case.driver == ""
    }
    assert by_kind["tcp", None, "sigint"] == 130
    assert by_kind["tcp", None, "birth"] is None
    assert by_kind["tcp", None, "watchdog"] == 0
    assert by_kind["loopback", None, "frozen-sigterm"] == 130
    assert by_kind["loopback", None, "lock-link"] == 2
    assert by_kind["tcp", None, "foreign-cache"] == 0
    assert by_kind["prologix_tcp", None, "kill"] is None
    assert by_kind["loopback", None, "full-disk"] == 1
    assert by_kind["tcp", None, "read-only"] == 2
    assert by_kind["loopback", None, "held-briefly"] == 0
    assert by_kind["loopback", "hardware-error", None] == 1


def test_foreign_level_ends_session_before_storing_point(tmp_path, monkeypatch):
    instrument, _ = instrument_of(None)
    connected = HP35670A(Loopback(instrument))
    monkeypatch.setattr("tui.bench.connect", lambda *_: connected)
    db, unit, stored, said = tmp_path / "bench.db", load_unit("adss"), [], []
    request = session_request(
        options(7), "adss", unit, "sim:", db,
        recipe=None, bench="default", resume=None, remeasure=None, run_in=None,
        remarks={"serial": "", "operator": "", "notes": ""},
    )  # fmt: skip

    def watch():
        for event in bench_session("sim:", unit, db, request, SessionControl()):
            said.append(event)
            if isinstance(event, PointStored):
                stored.append(event.stored.point)
                if len(stored) == 2:
                    instrument.listen(b"SOUR:VOLT 4 VPK\n", end=True)

    with pytest.raises(InstrumentError, match="source level .* reads back 4"):
        watch()
    assert len(stored) == 2
    assert said[-1].source_state == "confirmed-off"
    assert not drives(instrument)
    for point in stored:
        assert point.gain == pytest.approx(true_gain(point.frequency_hz, 1.0), rel=1e-6)


def test_judge_sees_driving_source_called_off(tmp_path):
    run = Run(None, case(1, "", "tcp", None, "sigint"), tmp_path)
    run.instrument.source.offset_v = 1.0
    verdict = {"code": 0, "said": "", "source": "confirmed-off", "driving": None, "struck": False}
    run.judge_end(SimpleNamespace(verdict=verdict, measurement=1, told=[]))
    assert "the source was called off and drives" in run.outcome.wrongs


def test_judge_sees_lost_changed_or_wrong_points(tmp_path):
    run = Run(None, case(1, "", "loopback", None, None), tmp_path)
    right = SweepPoint(150.0, true_gain(150.0, 1.0))
    spoilt = SweepPoint(160.0, 9.0 + 0j, flags=PointFlag.SPOILT)
    with Store(tmp_path / "bench.db", create=True) as store:
        measurement = store.begin(
            MeasurementHeader("U", "", SweepPlan((1.0,), (1.0,)), "sim:", "t")
        )
        kept = store.add_point(measurement, 1.0, 150.0, right)
        store.add_point(measurement, 1.0, 160.0, spoilt)
        told = [(kept.id, 1.0, 150.0, right.gain, 0)]
        run.judge_points(measurement, told)
        assert run.outcome.wrongs == []
        store.add_point(measurement, 2.0, 150.0, right)
    run.judge_points(measurement, [(kept.id, 1.0, 150.0, 1j, 0), (99, 1.0, 170.0, 1j, 0)])
    first, second, third = run.outcome.wrongs
    assert "told otherwise" in first
    assert "170 Hz and 1 V peak was told and is lost" in second
    assert "150 Hz and 2 V peak is wrong by a factor of" in third


def test_judge_excludes_only_waiting_for_processor():
    accounts = iter([2.0, 5.0, 0.0])  # the last: the program has ended
    program = SimpleNamespace(starved_s=lambda: next(accounts))
    watch = Stopwatch(program, SimpleNamespace(starved_s=lambda: 1.0))
    for _ in range(2):
        assert watch.own_s() == pytest.approx(watch.elapsed_s() - 3.0, abs=0.5)
    assert watch.starved_s == 3.0


def test_campaign_draws_every_fault_reproducibly():
    cases = list(draw_cases(800, 3))
    assert cases == list(draw_cases(800, 3)) != list(draw_cases(800, 4))
    struck = {(c.driver, c.wire, c.fault_name, c.disturbance) for c in cases}
    for driver, wire in BENCHES:
        for name in model_of(driver).faults:
            assert (driver, wire, name, None) in struck
        for name in DISTURBANCES:
            assert ((driver, wire, None, name) in struck) == can_strike(name, wire)
    phased = {(c.driver, c.fault_name, p) for c in cases if c.fault for p in PHASES if p in c.fault}
    assert len(phased) >= sum(3 * (len(model.faults) - 2) for model in models())
    for one in cases:
        if one.fault is not None:
            model_of(one.driver).parse_fault(one.fault)
