"""The same measurement over every wire, and what becomes of it when its program is killed."""

import json
import os
import random
import signal
import socket
import time

import numpy as np
import pytest
from instruments.bench_server import (
    WIRES,
    gimbal_analyser,
    linear_analyser,
    served,
    simulated,
    wires_of,
)
from instruments.fake_analyser import known_gain
from instruments.killed import (
    begun,
    check_kept,
    end,
    killed_after,
    source_state,
    start,
    wait_for_watchdog,
)

from daq.analyser import SourceState
from daq.drivers import DRIVERS
from daq.errors import MeasurementError
from daq.frf import PointFlag
from daq.hp35670a.setup import Timing
from daq.session.bench_lock import BenchLock
from daq.store import Store
from sim.instrument.plant import LinearPlant
from tui import cli

PLAN = ["--level", "1.5", "--level", "2.5", "--start", "130", "--stop", "170", "--points", "5"]
NUMBERS = (130.0, 170.0, 5, 3, 4, 1.5, 2.5)
QUICK = ["--settle-cycles", "3", "--integrate-cycles", "4"]


def measure(db, url, *words) -> int:
    plan = [] if "--resume" in words else [*PLAN, *QUICK]
    return cli.main(
        ["measure", "--unit", "adss", "--instrument", url, *plan, "--db", str(db), "--yes", *words]
    )


def test_every_wire_gives_equal_points(tmp_path):
    db = tmp_path / "bench.db"
    assert measure(db, "sim:?ratio=0.3&seed=4") == 0
    for wire in WIRES:
        with served(gimbal_analyser(seed=4), wire) as url:
            assert measure(db, url) == 0
    with Store(db) as store:
        first, *others = ([p.point for p in store.points(m.id)] for m in store.measurements())
        readbacks = [m.readback for m in store.measurements()]
    assert len(first) == 10
    assert len(others) == len(WIRES)
    for other in others:
        assert other == first
    assert all(readback == readbacks[0] for readback in readbacks)


@pytest.mark.long
def test_all_wires_of_drivers_give_equal_points(tmp_path):
    """Known ones, within what the instrument prints; of the preset to the last bit, see above."""
    for driver in (driver.scheme for driver in DRIVERS if driver.scheme):
        db = tmp_path / f"{driver}.db"
        for wire in wires_of(driver):
            with served(simulated(driver, LinearPlant(known_gain)), wire, driver) as url:
                words = [
                    "measure",
                    "--unit",
                    "adss",
                    "--instrument",
                    url,
                    *PLAN[2:-1],
                    "12",
                    *QUICK,
                ]
                assert cli.main([*words, "--db", str(db), "--yes"]) == 0
        with Store(db) as store:
            found = [store.response(m.id) for m in store.measurements()]
        assert len(found) == len(wires_of(driver))
        for response in found:
            true = np.array([known_gain(hz) for hz in response.frequency_hz])
            np.testing.assert_allclose(response.gain, true, rtol=2e-5)
            # Single bins come as text, whole traces in binary where the wire has it.
            np.testing.assert_allclose(response.gain, found[0].gain, rtol=1e-6)


@pytest.mark.parametrize(
    "driver",
    ["", *(pytest.param(one.scheme, marks=pytest.mark.long) for one in DRIVERS if one.scheme)],
)
def test_adapter_with_late_eoi_measures(tmp_path, driver):
    """Its instrument sees no EOI: a line feed must end each message."""
    box = simulated(driver, LinearPlant(known_gain))
    with served(box, "prologix_pty", driver, dialect="ar488-late-eoi") as url:
        assert measure(tmp_path / "bench.db", url) == 0
    assert box.driven_v == 0.0


@pytest.mark.parametrize("flow", ["hardware", pytest.param("software", marks=pytest.mark.long)])
def test_flow_control_follows_the_address(tmp_path, flow):
    with served(simulated("sr785", LinearPlant(known_gain)), "serial_pty", "sr785") as url:
        assert measure(tmp_path / "bench.db", f"{url}?baud=19200&flow={flow}") == 0


def test_another_seed_gives_other_points(tmp_path):
    db = tmp_path / "bench.db"
    for seed in (4, 5):
        assert measure(db, f"sim:?ratio=0.3&seed={seed}") == 0
    with Store(db) as store:
        first, second = ([p.point.gain for p in store.points(i)] for i in (1, 2))
    assert not np.any(np.array(first) == np.array(second))


@pytest.mark.parametrize(
    ("driver", "wire"),
    [
        ("", "tcp"),
        pytest.param("", "prologix_pty", marks=pytest.mark.long),
        pytest.param("sr785", "serial_pty", marks=pytest.mark.long),
    ],
)
def test_random_kill_9_loses_no_point(tmp_path, driver, wire):
    """Two kills of one measurement, then on to the end: equal to an unbroken one."""
    chance = random.Random(wire)
    db = tmp_path / "bench.db"
    with served(simulated(driver, LinearPlant(known_gain)), wire, driver) as url:
        assert measure(db, url) == 0
        told = []
        for points in (chance.randrange(0, 6), chance.randrange(0, 4)):
            after = chance.uniform(0.0, 0.05 if points else 0.3)
            left = killed_after(points, after, url, db, begun(db, 2), NUMBERS)
            assert not left.done
            told += left.told
            if begun(db, 2):
                check_kept(db, 2, told)
        assert end(start(url, db, begun(db, 2), NUMBERS)).done
        check_kept(db, 2, told)
    with Store(db) as store:
        unbroken, resumed = store.response(1), store.response(2)
        assert store.measurement(2).state == "complete"
        assert len(store.points(2, superseded=True)) == 10
    # One instrument takes a part of a sweep at frequencies that differ in the last digits.
    np.testing.assert_allclose(resumed.gain, unbroken.gain, rtol=1e-4 if driver else 0)
    np.testing.assert_allclose(
        resumed.frequency_hz, unbroken.frequency_hz, rtol=1e-4 if driver else 0
    )
    assert not np.any(resumed.flags & ~int(PointFlag.RETAKEN))


@pytest.mark.parametrize("driver", [driver.scheme for driver in DRIVERS])
def test_watchdog_switches_source_off_after_kill(tmp_path, driver):
    db = tmp_path / "bench.db"
    with served(simulated(driver, LinearPlant(known_gain)), driver=driver) as url:
        process = start(url, db, 0, (130.0, 170.0, 400, 3, 4, 2.0))
        first = process.stdout.readline()
        process.kill()
        end(process)
        assert first
        assert "source confirmed-off" in wait_for_watchdog(db, 1)
        assert source_state(url) is SourceState.CONFIRMED_OFF
        with Store(db) as store:
            found = store.measurement(1)
        assert found.source_state is SourceState.CONFIRMED_OFF
        assert (found.state, found.ended) == ("interrupted", None)


def test_watchdog_continues_after_unproven_source_off(tmp_path, monkeypatch, capsys):
    """The instrument is silent for longer than the session waits, and answers then."""
    monkeypatch.setattr("daq.hp35670a.analyser.Timing", lambda: Timing(reply_s=0.5, block_s=1.0))
    monkeypatch.setattr("daq.hp35670a.safe._BUDGET_S", 0.5)
    db, silent = tmp_path / "bench.db", "silence:point=3,seconds=8"
    short = ["--level", "1", "--start", "130", "--stop", "170", "--points", "9", *QUICK]
    with served(linear_analyser(known_gain, [silent])) as url:
        words = ["measure", "--unit", "adss", "--instrument", url, "--db", str(db), "--yes"]
        assert cli.main([*words, *short]) != 0
        told = capsys.readouterr().err
        assert "warning: the source is unknown; the watchdog opens the instrument anew" in told
        assert "warning: the watchdog: source confirmed-off" in told
        assert "1 point kept, source confirmed off" in told.splitlines()[-1]
        assert "without proving the source off; source confirmed" in wait_for_watchdog(db, 1, 60.0)
        with Store(db) as store:
            assert store.measurement(1).source_state is SourceState.CONFIRMED_OFF
        with BenchLock(db):
            assert source_state(url) is SourceState.CONFIRMED_OFF


@pytest.mark.parametrize("wire", ["prologix_pty", pytest.param("tcp", marks=pytest.mark.long)])
def test_returning_adapter_is_found_again(tmp_path, capsys, wire):
    """It breaks off, is away for a while, has lost its settings, and is another device then."""
    db, away = tmp_path / "bench.db", "link-away:point=3,seconds=3"
    box = linear_analyser(known_gain, [away])
    with served(box, wire) as url:
        assert measure(db, url) == 3
        told = capsys.readouterr().err
        assert "source confirmed off" in told.splitlines()[-1]
        assert box.driven_v == 0.0
        with Store(db) as store:
            assert "reconnected" in [event.kind for event in store.events(1)]
        assert measure(db, url, "--resume", "1") == 0


@pytest.mark.slow
def test_later_proof_of_watchdog_is_reported(tmp_path, capsys):
    """The gateway is away for longer than the session waits."""
    db, away = tmp_path / "bench.db", "link-away:point=3,seconds=11"
    box = linear_analyser(known_gain, [away])
    with served(box) as url:
        assert measure(db, url, "--json") == 3
        said = capsys.readouterr()
    assert "warning: the source is unknown; the watchdog opens the instrument" in said.err
    assert "warning: the watchdog: source confirmed-off" in said.err
    assert "source confirmed off" in said.err.splitlines()[-1]
    assert json.loads(said.out)["source_state"] == "confirmed-off"
    assert box.driven_v == 0.0
    with Store(db) as store:
        assert store.measurement(1).source_state is SourceState.CONFIRMED_OFF


def test_watchdog_ends_without_an_analyser(tmp_path, monkeypatch, capsys):
    """Somebody gave a wrong address: the next session must not wait."""
    monkeypatch.setattr("daq.hp35670a.analyser.Timing", lambda: Timing(reply_s=0.3, block_s=1.0))
    monkeypatch.setattr("daq.hp35670a.safe._BUDGET_S", 0.5)
    db = tmp_path / "bench.db"
    short = ["--level", "1", "--start", "130", "--stop", "170", "--points", "9", *QUICK]
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"TCPIP::127.0.0.1::{silent.getsockname()[1]}::SOCKET"
        words = ["measure", "--unit", "adss", "--instrument", url, "--db", str(db), "--yes"]
        assert cli.main([*words, *short]) == 4
        assert "SOURCE OFF UNKNOWN" in capsys.readouterr().err
        with BenchLock(db, patience_s=0.2):
            pass


@pytest.mark.parametrize(
    "driver",
    ["", *(pytest.param(one.scheme, marks=pytest.mark.long) for one in DRIVERS if one.scheme)],
)
def test_next_start_finds_driving_source_without_watchdog(tmp_path, capsys, driver):
    db = tmp_path / "bench.db"
    box = simulated(driver, LinearPlant(known_gain))
    with served(box, driver=driver) as url:
        process = start(url, db, 0, (130.0, 170.0, 400, 3, 4, 2.0))
        process.stdout.readline()
        # Both at once, as when the machine dies: neither may see the other's end and act.
        os.kill(process.pid, signal.SIGSTOP)
        children = _children(process.pid)
        for child in children:
            child.kill()
        process.kill()
        end(process)
        assert len(children) == 1
        # Asking over the wire would start the SR785's ramp to zero.
        assert box.driven_v > 0.0
        with Store(db) as store:
            assert store.measurement(1).source_state is SourceState.ON
        short = ["--level", "1", "--start", "130", "--stop", "170", "--points", "3", *QUICK]
        words = ["measure", "--unit", "adss", "--instrument", url, "--db", str(db), "--yes"]
        assert cli.main([*words, *short]) == 0
    assert "note  source: was found driving, or free to drive" in capsys.readouterr().err


class _Process:
    def __init__(self, number: int) -> None:
        self.number = number

    def kill(self) -> None:
        import os
        import signal

        os.kill(self.number, signal.SIGKILL)


def _children(parent: int) -> list[_Process]:
    from pathlib import Path

    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if int(fields[1]) == parent:
            found.append(_Process(int(status.parent.name)))
    return found


def test_two_sessions_do_not_share_a_bench(tmp_path):
    db = tmp_path / "bench.db"
    with served(linear_analyser(known_gain)) as url:
        process = start(url, db, 0, (130.0, 170.0, 400, 3, 4, 2.0))
        process.stdout.readline()
        began = time.monotonic()
        with pytest.raises(MeasurementError, match=rf"another session \(process {process.pid}\)"):
            BenchLock(db)
        assert time.monotonic() - began < 1.0
        assert measure(db, url) == 1
        process.terminate()
        end(process)


def test_instrument_in_use_refuses_another_history(tmp_path, capsys):
    with served(linear_analyser(known_gain)) as url:
        process = start(url, tmp_path / "bench.db", 0, (130.0, 170.0, 400, 3, 4, 2.0))
        process.stdout.readline()
        short = ["--level", "1", "--start", "130", "--stop", "170", "--points", "3", *QUICK]
        other = ["--instrument", url, "--db", str(tmp_path / "other.db"), "--yes"]
        assert cli.main(["measure", "--unit", "adss", *other, *short]) == 1
        told = capsys.readouterr().err
        assert f"(process {process.pid}, history {tmp_path / 'bench.db'}) is measuring on" in told
        assert source_state(url) is SourceState.ON
        process.terminate()
        end(process)
        assert cli.main(["measure", "--unit", "adss", *other, *short]) == 0


def test_watchdog_shares_lock_and_removes_it(tmp_path):
    db = tmp_path / "bench.db"
    with served(linear_analyser(known_gain)) as url:
        process = start(url, db, 0, (130.0, 170.0, 400, 3, 4, 2.0))
        process.stdout.readline()
        process.kill()
        end(process)
        # Whoever comes next waits for the watchdog and finds the source off.
        with BenchLock(db):
            with Store(db) as store:
                assert "watchdog" in [event.kind for event in store.events(1)]
            assert source_state(url) is SourceState.CONFIRMED_OFF
    assert not db.with_name("bench.db-lock").exists()


def test_released_lock_can_be_taken_again(tmp_path):
    db = tmp_path / "bench.db"
    for _ in range(3):
        with BenchLock(db) as lock:
            assert lock.descriptor > 2
            with pytest.raises(MeasurementError, match="another session"):
                BenchLock(db)


def test_lock_of_dead_owner_has_bounded_wait(tmp_path):
    db = tmp_path / "bench.db"
    with BenchLock(db):
        db.with_name("bench.db-lock").write_text("999999999\n")
        with pytest.raises(MeasurementError, match="watchdog of a session that was killed"):
            BenchLock(db, patience_s=0.3)
