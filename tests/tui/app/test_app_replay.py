"""Recorded sessions on screen: what is read, in which order, and how it is shown."""

import asyncio

import numpy as np
import pytest
from outputs.screen import text_of

from daq.configs import sample_path
from daq.errors import InputError
from daq.store import Store
from tui.app.state.recording import read_recording
from tui.app.state.replay import ReplayApp
from tui.cli import main


@pytest.fixture(scope="module")
def history(tmp_path_factory):
    db = tmp_path_factory.mktemp("replay") / "bench.db"
    words = ["measure", "--unit", "adss", "--instrument", "sim:", "--db", str(db)]
    plan = ["--level", "2.5", "--start", "120", "--stop", "160", "--points", "9"]
    short = ["--settle-cycles", "3", "--integrate-cycles", "3"]
    assert main([*words, *plan, *short]) == 0
    assert main([*words, "--resume", "1", "--remeasure", "130:140"]) == 0
    return db


def test_session_replays_in_order_with_superseded_points(history):
    recording = read_recording(history)
    with Store(history, read_only=True) as store:
        every = store.points(1, superseded=True)
    points = [entry.point for entry in recording.entries if entry.point is not None]
    assert [point.id for point in points] == [point.id for point in every]
    assert len(points) == 12
    moments = [entry.at_s for entry in recording.entries]
    assert moments == sorted(moments)
    assert recording.simulated
    assert any(entry.text.startswith("check: source") for entry in recording.entries)


def test_response_replay_takes_its_cycle_time():
    recording = read_recording(sample_path("adss-sweep"))
    hertz = np.array([entry.point.point.frequency_hz for entry in recording.entries])
    steps = np.diff([0.0, *(entry.at_s for entry in recording.entries)])
    cycles = steps * hertz
    np.testing.assert_allclose(cycles, cycles[0])
    assert cycles[0] >= 1


@pytest.mark.parametrize(("name", "text"), [("x.csv", "no table"), ("x.jsonl", "{}")])
def test_invalid_recording_is_refused(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InputError):
        read_recording(path)
    with pytest.raises(InputError):
        read_recording(tmp_path / "not-there.db")


def test_missing_measurement_is_refused(history, capsys):
    assert main(["replay", str(history), "--id", "9"]) == 2
    assert main(["replay", str(history), "--speed", "0"]) == 2
    assert main(["replay", str(history)]) == 2
    assert "needs a terminal" in capsys.readouterr().err


def marks_of_gain(screen):
    """Filled circles in the plot of the gain; one level has no letter."""
    return screen.partition("gain, dB")[2].partition("phase, deg")[0].count("●")


def test_the_replay_plays_pauses_and_ends(history):
    async def way():
        app = ReplayApp(read_recording(history), speed=1e-3)
        async with app.run_test(size=(80, 24)) as pilot:
            await pilot.pause()
            assert "REPLAY, no instrument | SIMULATED | measurement 1" in text_of(app)
            assert ", 0 points" in text_of(app)
            without = marks_of_gain(text_of(app))
            await pilot.press("space")
            assert "PAUSED" in text_of(app)
            held_s = app.at_s
            await pilot.press("+", "+")
            assert app.speed == pytest.approx(4e-3)
            await pilot.pause(0.3)
            assert app.at_s == held_s
            await pilot.press("space", "E")
            screen = text_of(app)
            assert ", 9 points" in screen
            assert "END" in screen
            # Nine points, and one in the legend.
            assert (without, marks_of_gain(screen)) == (0, 10)
            await pilot.press("comma")
            assert app.at_s < app.recording.duration_s

    asyncio.run(way())
