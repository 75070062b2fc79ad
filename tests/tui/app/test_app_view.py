"""What the bench screen keeps and draws, without a session behind it."""

import dataclasses

import numpy as np
import pytest
from outputs.screen import DIAGNOSIS, operated, run, text_of

from analysis.inference.exclusion import ExclusionLimit
from daq import session_events as kinds
from daq.analyser import SourceState, SweepPoint
from daq.errors import InputError
from daq.frf import FrequencyResponse, PointFlag
from daq.plan import SweepPlan
from daq.store_records import StoredPoint
from tui.app.diagnosis_words import diagnosis_lines, next_sentence
from tui.app.plot.palette import Palette
from tui.app.plot.traces import legend, traces_of_points, traces_of_response
from tui.app.run_view import RunView, source_words
from tui.app.state.desk import plan_of_document

PLAN = SweepPlan((100.0, 110.0, 120.0), (1.5, 2.5))


def stored(hertz=100.0, level=1.5, gain=0.5 + 0j, flags=0, number=1):
    return StoredPoint(
        number, level, hertz, SweepPoint(hertz, gain, 0.2, 1.0, PointFlag(flags)), ""
    )


def told(*events, hold=False):
    run_view = RunView(hold=hold)
    run_view.begin()
    for event in events:
        run_view.take(event)
    return run_view


OPENED = kinds.Opened(7, PLAN, 0, 6, 12.0)
SOURCE_OFF = kinds.CheckLine("source", "pass", "confirmed off")


def test_trial_point_shows_source_on():
    assert told(OPENED).source_text == "SOURCE not asked yet"
    assert told(OPENED, SOURCE_OFF).source_text == "SOURCE ON at 1.5 V peak"
    held = told(OPENED, SOURCE_OFF, kinds.Paused(SourceState.CONFIRMED_OFF), hold=True)
    assert held.phase == "ready"
    assert held.source_text == "SOURCE OFF (confirmed)"


def test_time_left_after_pause_follows_run_in(tmp_path):
    first = kinds.PointStored(stored(), 1, 6, 2.0, 65.0)
    again = kinds.RunIn(1.5, first.stored.point, first.stored.point)
    second = kinds.PointStored(stored(110.0, number=2), 2, 6, 9.0, 60.0)
    begun = kinds.LevelStarted(1.5, 2)

    async def way():
        async with operated(tmp_path / "bench.db") as op:
            op.app.desk.run = told(OPENED, begun, first)
            op.app.go(4)
            await op.sees("1 of 6 points stored; 1:05 left, done ")
            op.app.desk.run = told(OPENED, begun, first, kinds.GoingOn(), begun, again)
            op.app.redraw_now()
            await op.sees("1 of 6 points stored; run-in, 1 points driven again; then 1:05")
            op.app.desk.run.take(second)
            op.app.redraw_now()
            await op.sees("2 of 6 points stored; 1:00 left, done ")
            op.app.desk.run.phase = "over"

    run(way)


@pytest.mark.parametrize("state", [SourceState.UNCONFIRMED, SourceState.UNKNOWN])
def test_unproven_source_off_states_the_remedy(state):
    assert "switch it off by hand" in told(OPENED, kinds.SourceSafe(state)).source_text


def test_source_found_on_states_remedy_without_level():
    assert source_words(SourceState.ON) == "SOURCE ON: switch it off by hand"


def test_session_lost_while_driving_leaves_source_unknown():
    view = told(OPENED, SOURCE_OFF, kinds.LevelStarted(2.5, 3))
    assert view.source_text == "SOURCE ON at 2.5 V peak"
    view.end(RuntimeError("gone"))
    assert view.source is SourceState.UNKNOWN
    assert not view.live


def test_pause_in_sweep_is_not_initial_hold():
    view = told(
        OPENED, SOURCE_OFF, kinds.Paused(SourceState.CONFIRMED_OFF), kinds.GoingOn(),
        kinds.LevelStarted(1.5, 3), kinds.PointStored(stored(), 1, 6, 0.5, 2.0),
        kinds.Paused(SourceState.CONFIRMED_OFF), hold=True,
    )  # fmt: skip
    assert view.phase == "paused"
    assert view.done == 1


def test_requested_stop_is_shown_until_done():
    view = told(OPENED, SOURCE_OFF, kinds.LevelStarted(2.5, 3))
    view.stop_asked = True
    assert view.source_text == "STOP REQUESTED, SOURCE ON at 2.5 V peak"


def test_remeasured_point_replaces_the_old_one():
    view = told(OPENED)
    view.preload([stored(gain=0.1 + 0j)])
    view.take(kinds.PointStored(stored(gain=0.9 + 0j, number=9), 1, 6, 0.5, 2.0))
    assert [point.id for point in view.points.values()] == [9]


def test_traces_break_at_spoilt_points_and_flags():
    """A trace does not cross a spoilt point. Flags differ by their shape."""
    points = [
        stored(100.0), stored(110.0, flags=PointFlag.OVERLOAD), stored(120.0, gain=complex("nan"),
        flags=PointFlag.SPOILT), stored(130.0, flags=PointFlag.NOT_PERIODIC), stored(140.0),
        stored(100.0, 2.5),
    ]  # fmt: skip
    low, high = traces_of_points(points, (1.5, 2.5))
    assert low.marks == ["\u25cf", "!", "?", "~", "\u25cf"]
    assert [(run.start, run.stop) for run in low.runs] == [(0, 2), (3, 5)]
    assert high.mark != low.mark
    words = legend([low, high])
    for word in ("\u25cf 1.5 V", "\u25a0 2.5 V", "! overload", "? spoilt", "~ not periodic"):
        assert word in words
    assert "coarse" not in words


def test_response_is_drawn_alone_and_as_reference():
    response = FrequencyResponse.from_arrays(
        [100.0, 110.0, 100.0, 110.0], [1.0, 1.0, 2.0, 2.0], [1, 10, 1, 1], unit="ADSS"
    )
    one, two = traces_of_response(response)
    np.testing.assert_allclose(one.gain_db, [0.0, 20.0])
    assert (one.name, two.name) == ("1 V", "2 V")
    assert all(trace.reference for trace in traces_of_response(response, "#3"))
    assert "line #3 1 V" in legend(traces_of_response(response, "#3"))


def test_proposed_plan_is_read_in_both_forms():
    whole = dataclasses.asdict(PLAN)
    assert plan_of_document(whole) == PLAN
    band = {"levels_vpk": [2.0], "start_hz": 100.0, "stop_hz": 120.0, "points": 3}
    assert plan_of_document(band).frequencies_hz == (100.0, 110.0, 120.0)
    for bad in ({}, {"levels_vpk": [2.0]}, band | {"levels_vpk": ["x"]}, band | {"points": 0}):
        with pytest.raises(InputError):
            plan_of_document(bad)


COLOURS = Palette("#000000", "#ffffff", "#333333", "#ff0000", ("#ffffff",), ("#222222",))


def told_of(document):
    return "\n".join(line.plain for line in diagnosis_lines(document, COLOURS))


def test_next_step_is_one_sentence():
    named = DIAGNOSIS | {"next_measurement": None}
    assert next_sentence(named).startswith("to make sure, compare what is mounted")
    consistent = named | {"verdict": "consistent", "causes": []}
    assert "nothing to mend" in next_sentence(consistent)
    assert "departures" in next_sentence(consistent | {"verdict": "unexplained"})


def test_departures_form_level_by_band_grid():
    parts = [
        {"band_hz": [120.0, 126.0], "source_vpk": 1.5, "quantity": "gain", "mean": 1.44,
         "sigma": 7.0},
        {"band_hz": [126.0, 132.0], "source_vpk": 3.0, "quantity": "phase", "mean": -12.3,
         "sigma": -2.5},
    ]  # fmt: skip
    lines = told_of(DIAGNOSIS | {"residual": parts}).splitlines()
    head = next(at for at, line in enumerate(lines) if line.startswith("Hz"))
    assert lines[head].split() == ["Hz", "120-126", "126-132"]
    assert lines[head + 1].split() == ["1.5", "V,", "dB", "+1.4!!", "\u00b7"]
    assert lines[head + 2].split() == ["3", "V,", "deg", "\u00b7", "-12.3!"]


def test_diagnosis_states_causes_rivals_and_next_sweep():
    text = told_of(DIAGNOSIS)
    assert "\nRivals\n" in text
    for words in (
        "VERDICT: AMBIGUOUS", "before  4.2 standard errors, 1.9 dB", "load-inertia",
        "load inertia J_L = 0.00310 +- 0.00010 kg\u00b7m\u00b2",
        "0.41  shaft-stiffness (needs a size outside its plausible range)",
        "MEASURE THIS NEXT",
        "To make sure: compare what is mounted with the drawing",
    ):  # fmt: skip
        assert words in text
    nothing = DIAGNOSIS | {"verdict": "unexplained", "causes": [], "rivals": [],
                           "next_measurement": None}  # fmt: skip
    text = told_of(nothing)
    assert "Causes: none named" in text
    assert "MEASURE THIS NEXT" not in text
    assert "unseen" not in text
    plain = {"causes": [], "probability": 0.7}
    judged = told_of(nothing | {"rivals": [plain, plain | {"probability": 0.004}]})
    assert judged.count("no cause") == 1
    assert "0.70  no cause" in judged
    load = ExclusionLimit("load-inertia", "J_L", "kg.m^2", 0.0026, 0.0029, 0.00275)
    size = "\n - load-inertia: J_L 0.0026 to 0.0029 kg.m^2"
    plain = nothing | {"verdict": "consistent", "unseen": [load.to_json()]}
    assert (
        f"\n\nSizes of causes that this sweep cannot exclude, one cause at a time{size}"
        in told_of(plain)
    )
    named = told_of(DIAGNOSIS | {"unseen": [load.to_json()]})
    assert (
        f"\n\nSizes of further causes that this sweep cannot exclude, one cause at a time{size}"
        in named
    )


def test_screen_is_complete_without_colour(tmp_path, monkeypatch):
    async def way():
        async with operated(tmp_path / "bench.db") as op:
            await op.connects("sim:")
            await op.sees("SIMULATED | SOURCE OFF (confirmed) | ADSS", "[2 Instrument]")
            strips = op.app.screen._compositor.render_strips()
            colours = {
                (segment.style.color, segment.style.bgcolor)
                for strip in strips for segment in strip if segment.style
            }  # fmt: skip
            for front, back in colours:
                for colour in (front, back):
                    if colour is not None:
                        red, green, blue = colour.get_truecolor()
                        assert max(red, green, blue) - min(red, green, blue) <= 1
                assert front is None or back is None or front != back

    monkeypatch.setenv("NO_COLOR", "1")
    run(way)


@pytest.mark.parametrize("size", [(60, 18), pytest.param((80, 24), marks=pytest.mark.long)])
def test_small_terminals_keep_banner_hint_and_keys(tmp_path, size):
    async def way():
        async with operated(tmp_path / "bench.db", size) as op:
            await op.connects("sim:")
            await op.plans()
            await op.checks()
            await op.press("ctrl+n", "s")
            await op.sees("complete", "SIMULATED | SOURCE OFF (confirmed)", "^x STOP", "> ")
            await op.press("f1")
            await op.sees("Step 4: sweep", "starts the sweep")
            await op.press("escape", "ctrl+p")
            await op.press(*"stop")
            await op.sees("Source: stop")
            assert text_of(op.app)

    run(way)
