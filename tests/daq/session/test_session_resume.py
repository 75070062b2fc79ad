"""A measurement taken up again, to finish it or to measure a band once more."""

import numpy as np
import pytest
from instruments.fake_analyser import FakeAnalyser, known_gain
from instruments.session_runs import Watch, again, measured, new, of

from daq.analyser import Identity, SourceState
from daq.control import SessionControl
from daq.errors import InputError, MeasurementError
from daq.session import Session
from daq.session_events import CheckLine, PointStored, Warned
from daq.store import Store


def test_resuming_complete_measurement_only_checks_source(store):
    measured(store)
    analyser = FakeAnalyser()
    events = measured(store, again(1), analyser)
    assert (events[-1].state, events[-1].points) == ("complete", 18)
    assert analyser.driven == []
    assert [line.name for line in of(CheckLine, events)][-1] == "source"


def test_missing_measurement_cannot_be_resumed(store):
    with pytest.raises(InputError, match="measurement 5 is not in"):
        list(Session(FakeAnalyser(), store, again(5)).run())


def test_point_cut_by_kill_is_marked(store):
    # A killed program leaves its measurement as it last wrote it.
    run = Session(FakeAnalyser(), store, new()).run()
    for event in run:
        if isinstance(event, PointStored) and event.done == 12:
            break
    copy = Store(store.path)
    before = copy.measurement(1)
    assert before.source_state is SourceState.ON
    events = measured(copy, again(1))
    assert events[-1].state == "complete"
    flags = {(p.source_vpk, p.requested_hz): p.point.flags for p in copy.points(1)}
    assert [key for key, flag in flags.items() if flag] == [(1.0, 130.0)]
    copy.close()
    run.close()


def test_remeasured_band_supersedes_and_keeps_old_points(store):
    measured(store)
    analyser = FakeAnalyser(gain=lambda f: 2.0 * known_gain(f))
    events = measured(store, again(1, remeasure_hz=(115.0, 135.0)), analyser)
    assert events[0].done == 14
    assert [e.stored.requested_hz for e in of(PointStored, events)] == [120.0, 130.0] * 2
    assert (events[-1].state, events[-1].points) == ("complete", 18)
    response = store.response(1)
    inside = (response.frequency_hz > 115.0) & (response.frequency_hz < 135.0)
    expected = np.array([known_gain(f) for f in response.frequency_hz])
    np.testing.assert_allclose(response.gain, np.where(inside, 2.0, 1.0) * expected)
    every = store.points(1, superseded=True)
    assert len(every) == 22
    assert sum(p.superseded_by is not None for p in every) == 4


def test_empty_band_changes_nothing(store):
    measured(store)
    analyser = FakeAnalyser()
    measured(store, again(1, remeasure_hz=(300.0, 400.0)), analyser)
    assert analyser.driven == []


def test_unrepeatable_run_in_point_is_reported(store):
    control = SessionControl()
    Watch(Session(FakeAnalyser(), store, new(), control), 5, control.stop).run()
    changed = FakeAnalyser(gain=lambda f: 1.1 * known_gain(f))
    events = measured(store, again(1), changed)
    (warning,) = of(Warned, events)
    assert "5 points came again within 0.83 dB" in warning.text
    assert "conditions are not those of before" in warning.text
    assert [e.kind for e in store.events(1)].count("warning") == 1


@pytest.mark.parametrize("points", [0, 2, 100])
def test_shorter_run_in_can_be_requested(store, points):
    control = SessionControl()
    Watch(Session(FakeAnalyser(), store, new(), control), 14, control.stop).run()
    analyser = FakeAnalyser()
    measured(store, again(1, run_in_points=points), analyser)
    lead = [100.0, 110.0, 120.0, 130.0, 140.0][5 - min(points, 5) :]
    assert analyser.driven[1:] == [(1.0, f) for f in [*lead, 150.0, 160.0, 170.0, 180.0]]


def test_changed_settings_are_reported(store):
    control = SessionControl()
    Watch(Session(FakeAnalyser(), store, new(), control), 5, control.stop).run()
    events = measured(store, again(1), FakeAnalyser(readback={"SWE:STIM": "6 CYCLE"}))
    assert "SWE:STIM reads 6 CYCLE, and read 5 CYCLE" in of(Warned, events)[0].text


def test_resume_notes_other_and_refuses_simulated_instrument(store):
    control = SessionControl()
    Watch(Session(FakeAnalyser(), store, new(), control), 5, control.stop).run()
    other = Identity("HEWLETT-PACKARD", "35670A", "MY2", "A.1", ("1D2",))
    simulated = Identity("HEWLETT-PACKARD", "35670A", "SIM", "A.1", ("1D2",), simulated=True)
    with pytest.raises(MeasurementError, match="begun on a real instrument"):
        list(Session(FakeAnalyser(identity=simulated), store, again(1)).run())
    events = measured(store, again(1), FakeAnalyser(identity=other))
    assert any(line.verdict == "note" and "MY1" in line.text for line in of(CheckLine, events))
    assert store.measurement(1).instrument.serial == "MY1"
