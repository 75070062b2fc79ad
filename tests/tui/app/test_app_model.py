"""The prediction under the points before a diagnosis: what units of the datasheet read."""

import shutil
import threading
import time
from pathlib import Path

import pytest
from outputs.screen import ESTIMATE, operated, quick_analyses, run

from tui.cli import main

TOLD = "the middle 68 % of 32 simulated units"


@pytest.fixture
def db(measured, tmp_path):
    """The same history for each test: an estimate that one keeps in it is not another's."""
    return Path(shutil.copy(measured, tmp_path / "bench.db"))


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Two complete sessions."""
    path = tmp_path_factory.mktemp("model") / "bench.db"
    words = ["measure", "--unit", "adss", "--db", str(path), "--instrument", "sim:?seed=1"]
    words += ["--level", "2.5", "--start", "120", "--stop", "160", "--points", "9"]
    words += ["--settle-cycles", "3", "--integrate-cycles", "3"]
    assert main(words) == main(words) == 0
    return path


def test_datasheet_band_is_shown_before_diagnosis(db):
    async def way():
        async with operated(db) as op:
            await op.press("7")
            await op.sees("#2: ADSS")
            await op.press("enter")
            screen = await op.sees("[5 Result]", "r = 0.310", "M: the model")
            assert "band datasheet" not in screen
            await op.press("m")
            await op.sees("band datasheet, r 0.31 +- 0.05", TOLD)
            await op.press("l")
            await op.sees("line #1 2.5 V")
            await op.press("l", "m")
            await op.pilot.pause()
            assert "band datasheet" not in op.screen
            assert "#1 2.5 V" not in op.screen

    run(way)


def test_band_is_remade_after_estimate(db):
    known = threading.Event()

    def estimate(response, unit, progress):
        known.wait(20.0)
        return ESTIMATE

    async def way():
        async with operated(db, analyses=quick_analyses(estimate=estimate)) as op:
            await op.press("7")
            await op.sees("#2: ADSS")
            await op.press("enter")
            await op.sees("[5 Result]", "estimating")
            await op.press("m")
            await op.sees("band datasheet, any r", "r anywhere from 0 to 1")
            known.set()
            await op.sees("band datasheet, r 0.31 +- 0.05")

    run(way)


def test_unwanted_band_ends(db):
    ended = threading.Event()

    def band(response, unit, estimate, progress):
        try:
            while True:
                progress(0.25, "simulating units of the datasheet")
                time.sleep(0.01)
        finally:
            ended.set()

    async def way():
        async with operated(db, analyses=quick_analyses(band=band)) as op:
            await op.press("7")
            await op.sees("#2: ADSS")
            await op.press("enter")
            await op.sees("[5 Result]", "r = 0.310")
            await op.press("m")
            await op.sees("simulating units of the datasheet 25 %", "M ends it")
            assert not ended.is_set()
            await op.press("m")
            assert ended.wait(10.0)
            await op.pilot.pause()
            assert "simulating units" not in op.screen

    run(way)
