"""A response that looks like a mistake: on the screen, in the history and in a report."""

import json
import re
import sqlite3
from dataclasses import replace

import numpy as np
import pytest
from outputs.screen import operated
from outputs.screen import run as drive

from daq.configs import sample_path
from daq.formats import read_response, write_response
from daq.store import Store
from sim.unit import load_unit
from tui import cli
from tui.measurements.stored_answers import kept_estimate

CURE = "multiply phase_deg by 57.29578"
PLAN = ["--level", "2.5", "--start", "100", "--stop", "180", "--points", "21"]
SHORT = ["--settle-cycles", "3", "--integrate-cycles", "3"]


def radians(response):
    angle = np.radians(np.angle(response.gain))
    return replace(response, gain=np.abs(response.gain) * np.exp(1j * angle))


@pytest.fixture
def mistaken(tmp_path):
    """A history that holds one measurement with its phase in radians."""
    db = tmp_path / "bench.db"
    words = ["measure", "--unit", "adss", "--instrument", "sim:?ratio=0.3&seed=1"]
    assert cli.main([*words, *PLAN, *SHORT, "--db", str(db), "--quiet"]) == 0
    with sqlite3.connect(db) as opened:
        rows = opened.execute("SELECT id, gain_re, gain_im FROM points").fetchall()
        for key, real, imag in rows:
            gain = complex(real, imag)
            turned = abs(gain) * np.exp(1j * np.radians(np.angle(gain)))
            opened.execute(
                "UPDATE points SET gain_re = ?, gain_im = ? WHERE id = ?",
                (turned.real, turned.imag, key),
            )
    return db


def first_line(page):
    found = re.search(r'<ul class="actions"><li>(.*?)</li>', page.read_text(), re.DOTALL)
    return found[1]


def test_report_warns_first_and_gives_no_number(tmp_path, capsys):
    sweep, page = tmp_path / "sweep.csv", tmp_path / "page.html"
    write_response(radians(read_response(sample_path("adss-sweep"))), sweep)
    assert cli.main(["report", str(sweep), "--unit", "adss", "--out", str(page)]) == 0
    assert CURE in capsys.readouterr().err
    assert CURE in first_line(page)
    (block,) = re.findall(r'id="lashbench-report">(.*?)</script>', page.read_text(), re.DOTALL)
    data = json.loads(block)
    assert data["estimate"] is None
    assert data["diagnosis"] is None
    assert CURE in data["remarks"]["input"]


def test_screen_refuses_with_remedy_until_accepted(mistaken):
    """Key A accepts the response as it is."""

    async def way():
        async with operated(mistaken, size=(120, 40)) as op:
            desk = op.app.desk
            desk.measurement, desk.unit = 1, load_unit("adss")
            op.app.go(5)
            await op.sees("NO ESTIMATE: the phase is likely in radians", "A: take it as it is")
            assert "0.310" not in op.screen
            await op.press("a")
            await op.sees("No advice before a diagnosis", "warning: the phase is likely in radians")
            assert "0.310" not in op.screen

    drive(way)
    with Store(mistaken, read_only=True) as store:
        kept = kept_estimate(store, 1, load_unit("adss"))
    assert kept["refuted"]
    assert CURE in kept["warnings"][0]


def test_screen_diagnoses_doubtful_response_only_if_accepted(mistaken):
    async def way():
        async with operated(mistaken, size=(120, 40)) as op:
            desk = op.app.desk
            desk.measurement, desk.unit = 1, load_unit("adss")
            op.app.go(6)
            await op.press("d")
            await op.sees("NO DIAGNOSIS", "the phase is likely in radians", "A: take it as it is")

    drive(way)


@pytest.fixture
def loose(tmp_path):
    """Limits that the ARF of any sweep of the unit passes."""
    path = tmp_path / "loose.toml"
    path.write_text('schema = 1\nname = "loose"\n[acceptance]\narf_hz = { upper = 1000 }\n')
    return str(path)


def test_history_passes_no_doubtful_features(mistaken, loose, capsys):
    words = ["history", "--db", str(mistaken), "--estimate", "none", "--judge", loose, "--json"]
    assert cli.main(words) == 7
    (row,) = json.loads(capsys.readouterr().out)["measurements"]
    (item,) = row["judgement"]["items"]
    assert (item["verdict"], CURE in item["reason"]) == ("UNDECIDED", True)


def test_extract_passes_no_noise_or_half_sweep(loose, tmp_path, capsys):
    whole = read_response(sample_path("adss-sweep"))
    path = tmp_path / "sweep.h5"
    for said, code in [
        ({"excitation": "noise"}, 7),
        ({"state": "interrupted"}, 7),
        ({"state": "complete"}, 0),
    ]:
        write_response(replace(whole, provenance={**whole.provenance, **said}), path)
        assert cli.main(["extract", str(path), "--judge", loose]) == code, said
        assert ("UNDECIDED by limits loose" in capsys.readouterr().out) == (code == 7)


def test_history_estimates_no_doubtful_response(mistaken, capsys):
    assert cli.main(["history", "--db", str(mistaken), "--json"]) == 0
    out, err = capsys.readouterr()
    (row,) = json.loads(out)["measurements"]
    assert row["contribution_ratio"] is None
    assert "gives no estimate: the phase is likely in radians" in err
