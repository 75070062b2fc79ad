"""Ensembles on a cluster: a real scheduler and two workers on loopback."""

import os
import signal
import subprocess
import sys
import time
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from analysis.ensemble.machine import Machine
from analysis.ensemble.model import Hypothesis
from analysis.ensemble.run_cache import run_families
from analysis.ensemble.runs import Group, Population, simulate_groups
from analysis.execution.dask_executor import ClusterExecutor
from analysis.execution.executor import LocalExecutor
from analysis.observation.observation import unread
from daq.errors import AnalysisError, InputError, LinkError
from daq.plan import SweepPlan
from sim.effects import EffectSetting
from sim.engine.effort import counting
from sim.unit import load_unit

pytestmark = pytest.mark.skipif(find_spec("distributed") is None, reason="needs distributed")

BEGIN = "import sys; from distributed.cli.dask_{0} import main; sys.argv[0] = 'dask-{0}'; main()"
QUIET = {"DASK_LOGGING__DISTRIBUTED": "error", "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "0"}


def patient(address):
    """A machine that is busy with other things answers late."""
    return ClusterExecutor(address, connect_s=60.0, workers_s=60.0)


def begin(role, *words):
    return subprocess.Popen(
        [sys.executable, "-c", BEGIN.format(role), *words], env={**os.environ, **QUIET},
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


def begin_worker(address):
    return begin("worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard",
                 "--host", "127.0.0.1")  # fmt: skip


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    """Address of a scheduler without workers."""
    import json

    file = tmp_path_factory.mktemp("dask") / "scheduler.json"
    process = begin("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard",
                    "--scheduler-file", str(file))  # fmt: skip
    try:
        deadline = time.monotonic() + 60.0
        while not file.exists() or not file.read_text().strip():
            assert process.poll() is None, "the scheduler ended"
            assert time.monotonic() < deadline, "the scheduler did not start"
            time.sleep(0.05)
        time.sleep(0.1)
        yield json.loads(file.read_text())["address"]
    finally:
        process.kill()
        process.wait()


@pytest.fixture(scope="module")
def workers(scheduler):
    """The scheduler's address and two workers on this machine."""
    import cloudpickle
    from distributed import Client

    # Workers cannot import this file: what they are to do travels whole.
    cloudpickle.register_pickle_by_value(sys.modules[__name__])
    both = [begin_worker(scheduler) for _ in range(2)]
    try:
        with Client(scheduler, timeout=60.0, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=120.0)
        yield scheduler, both
    finally:
        for one in both:
            one.kill()
            one.wait()


def square(task):
    """Says where it ran, and takes long enough to be interrupted."""
    number, folder, seconds = task
    mark = Path(folder) / f"{number}-{os.getpid()}-{time.monotonic_ns()}"
    mark.touch()
    time.sleep(seconds)
    return number**2, os.getpid()


def refuse(task):
    if task == 3:
        raise AnalysisError("task 3 carries no answer")
    time.sleep(0.05)
    return task


def test_missing_workers_error_says_how_to_start(scheduler):
    with pytest.raises(LinkError, match="dask worker"):
        ClusterExecutor(scheduler, connect_s=60.0, workers_s=0.5)


def test_error_returns_unchanged_and_stops_rest(workers):
    address, _ = workers
    with patient(address) as cluster:
        with pytest.raises(AnalysisError, match="task 3 carries no answer"):
            cluster.each(refuse, list(range(8)))
        # The connection is as good as before.
        assert cluster.each(refuse, [1, 2]) == [1, 2]


class StopError(Exception):
    """Somebody pressed Ctrl-C."""


def test_cluster_runs_are_bit_equal_to_local(workers):
    address, _ = workers
    plan = SweepPlan((120.0, 150.0), (1.5, 2.5), settle_cycles=2, integrate_cycles=3)
    families = [
        [Machine(ratio, seed) for seed, ratio in enumerate((0.2, 0.5, 0.7))],
        [
            Machine(
                0.4,
                5,
                deviations=(("k_s1", 0.004),),
                effects=(EffectSetting("shaft-hardening", {"h": 1e4}),),
            )
        ],
    ]
    seen = unread(plan, 5e-4)
    unit = load_unit("adss")
    with patient(address) as cluster, counting() as spent_there:
        there = run_families(unit, families, seen, executor=cluster)
    with counting() as spent_here:
        here = run_families(unit, families, seen)
    np.testing.assert_array_equal(there.channels(seen), here.channels(seen))
    assert there.machines == here.machines
    # What workers simulate counts here.
    assert spent_there.simulated_s == pytest.approx(spent_here.simulated_s)
    assert spent_here.simulated_s == pytest.approx(4 * plan.duration_s)
    # So does what it is worth, which is more for a shaft that hardens.
    assert spent_there.worth_s == pytest.approx(spent_here.worth_s)
    assert spent_here.worth_s > 5 * plan.duration_s


def test_search_on_cluster_makes_local_runs(workers):
    address, _ = workers
    unit, plan = load_unit("edss"), SweepPlan((60.0,), (2.5,), settle_cycles=1, integrate_cycles=2)
    groups = [
        Group(Hypothesis(unit, effects), np.array([0.2, 0.6]), np.full(len(effects), 0.6))
        for effects in ((), ("load-inertia",), (), ("shaft-damping",))
    ]

    def runs(executor):
        rng = np.random.default_rng(3)
        return simulate_groups(unit, groups, unread(plan, 5e-4), rng, executor)

    with patient(address) as cluster:
        there = runs(cluster)
    here = runs(None)
    assert set(there) == set(here) == {(), ("load-inertia",), ("shaft-damping",)}
    for key, population in here.items():
        for field in Population.__slots__:
            np.testing.assert_array_equal(getattr(there[key], field), getattr(population, field))


def test_cancelled_work_is_not_begun(workers, tmp_path):
    address, _ = workers

    def progress(share):
        raise StopError

    with patient(address) as cluster, pytest.raises(StopError):
        cluster.each(square, [(number, str(tmp_path), 0.2) for number in range(40)], progress)
    time.sleep(0.8)
    begun = len(list(tmp_path.iterdir()))
    assert begun < 10
    time.sleep(0.6)
    assert len(list(tmp_path.iterdir())) == begun


def test_another_edition_on_a_worker_is_refused(workers, monkeypatch):
    address, _ = workers
    known = metadata.version
    monkeypatch.setattr(
        metadata, "version", lambda name: "0.0.0" if name == "lashbench" else known(name)
    )
    with (
        patient(address) as cluster,
        pytest.raises(AnalysisError, match="this is 0.0"),
    ):
        cluster.each(refuse, [1])


def test_an_address_without_a_scheduler_is_refused():
    with pytest.raises(LinkError, match="no Dask scheduler answers"):
        ClusterExecutor("127.0.0.1:9", connect_s=1.0)


@pytest.mark.parametrize(
    "address", ["ftp://nowhere:1", "localhost", "tcp://127.0.0.1", "", "[bad", "here:port"]
)
def test_invalid_address_is_refused_before_connecting(address, monkeypatch):
    # A client that was begun would take twenty seconds to end, and print a traceback.
    monkeypatch.setattr("distributed.Client", None)
    with pytest.raises(InputError, match="is no address of a Dask scheduler"):
        ClusterExecutor(address)


def test_local_results_keep_order_until_an_error(tmp_path):
    told = []
    local = LocalExecutor(2)
    tasks = [(n, str(tmp_path), 0.05 * (n == 2)) for n in (2, 3, 4)]
    assert [r[0] for r in local.each(square, tasks, told.append)] == [4, 9, 16]
    assert told == pytest.approx([1 / 3, 2 / 3, 1.0])
    begun = len(list(tmp_path.iterdir()))

    def progress(share):
        raise StopError

    with pytest.raises(StopError):
        local.each(square, [(n, str(tmp_path), 0.05) for n in range(40)], progress)
    assert len(list(tmp_path.iterdir())) - begun < 8


# The last: it leaves one worker.
def test_lost_worker_costs_only_its_task(workers, tmp_path):
    address, both = workers
    tasks = [(number, str(tmp_path), 0.15) for number in range(24)]
    told = []

    def progress(share):
        told.append(share)
        if len(told) == 6:
            os.kill(both[0].pid, signal.SIGKILL)

    with patient(address) as cluster:
        results = cluster.each(square, tasks, progress)
    assert [r[0] for r in results] == [n**2 for n in range(24)]
    assert {r[1] for r in results} == {one.pid for one in both}, "both workers took part"
    assert told == pytest.approx(np.arange(1, 25) / 24)
    ran: dict[int, list[tuple[int, int]]] = {}
    for mark in tmp_path.iterdir():
        number, worker, when = map(int, mark.name.split("-"))
        ran.setdefault(number, []).append((when, worker))
    twice = [sorted(of) for of in ran.values() if len(of) > 1]
    # What the lost worker had in hand, or had done and not handed over: nobody else's, and not
    # what had been fetched.
    assert all([worker for _, worker in of] == [both[0].pid, both[1].pid] for of in twice)
    assert len(twice) <= sum(worker == both[0].pid for of in ran.values() for _, worker in of) - 1
