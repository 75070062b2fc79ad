"""What holds for every test: Ctrl-C interrupts, linear algebra keeps to one core, bytecode is kept.

Tests run side by side: threads of a library that wait for each other would keep cores from them,
and how long an example takes says nothing. Without kept bytecode each of the some hundred programs
that they start compiles its imports, which doubles its processor time.
"""

import gc
import os
import signal
import subprocess
import sys
from itertools import islice

import pytest
from hypothesis import settings

# Before anything loads numpy; what a test starts inherits it.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# A screen that scrolls smoothly is drawn ten times, and waited for.
os.environ.setdefault("TEXTUAL_ANIMATIONS", "none")
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
gc.disable()  # until all tests are collected


# Every day draws other examples: twenty a day are many before long.
settings.register_profile("side by side", deadline=None, max_examples=20)
settings.load_profile("side by side")


def pytest_configure():
    # A shell starts what it puts in the background deaf to it, and children take that over.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    """Half of the workers begin with files of slow tests, which mostly wait; the others compute.

    Each worker gets as many tests, in their order, and takes some of others over at the end, where
    a core would wait for a slow one alone. The first ones get the tests of the analysis.
    """
    workers = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    waiting = list(dict.fromkeys(i.path for i in items if i.get_closest_marker("slow")))
    rest = iter([item for item in items if item.path not in waiting])
    half, size = workers // 2, -(-len(items) // workers)
    ordered = []
    for worker in range(workers):
        first = set(waiting[worker - half :: workers - half]) if worker >= half else set()
        block = [item for item in items if item.path in first]
        ordered += [*block, *islice(rest, max(size - len(block), 0))]
    items[:] = [*ordered, *rest]


def pytest_collection_finish():
    """What collecting has made stays to the end: no search for garbage goes through it.

    And searches are rarer. Of 8.7 s of some tests, most of them of the screen, they took 2.3 s;
    of 6.9 s they take 0.5 s. Collecting itself takes 3.9 s without them, 4.6 s with them.
    """
    gc.freeze()
    gc.set_threshold(10_000)
    gc.enable()


@pytest.fixture
def small_disk(tmp_path):
    """A disk of 64 KiB; mounting one takes root."""
    place = tmp_path / "disk"
    place.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(place)]
    try:
        done = subprocess.run(words, capture_output=True, text=True)
    except OSError as error:
        pytest.skip(f"no small disk can be mounted: {error}")
    if done.returncode:
        pytest.skip(f"no small disk can be mounted: {done.stderr.strip()}")
    try:
        yield place
    finally:
        subprocess.run(["umount", "--lazy", str(place)], check=True)


@pytest.fixture(scope="session")
def postgres():
    """A PostgreSQL server with an empty database `bench`."""
    from worlds.postgres_server import programs, running

    pytest.importorskip("psycopg")
    if programs() is None:
        pytest.skip("no PostgreSQL: neither initdb nor the package pgserver is there")
    with running() as found:
        found.sql("postgres", "CREATE DATABASE bench")
        yield found


@pytest.fixture
def postgres_url(postgres):
    """Address of that database, emptied."""
    postgres.sql("bench", "DROP SCHEMA IF EXISTS lashbench CASCADE")
    return postgres.url("bench")
