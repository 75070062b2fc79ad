"""A lost connection: it is opened again to make the source safe, and only for that or a pause."""

import threading

import pytest
from instruments.fake_analyser import FakeAnalyser
from instruments.session_runs import OFF, UNCONFIRMED, UNKNOWN, request

from daq.control import SessionControl
from daq.errors import LinkError
from daq.session import Session


def test_lost_connection_is_reopened_for_safe_off(store):
    dead = FakeAnalyser({("point", 6): LinkError("cable pulled")}, safe=(OFF, UNKNOWN))
    fresh = FakeAnalyser()
    fresh.level_vpk = 0.5
    events, session = [], Session(dead, store, request(), reopen=lambda: fresh)

    def run():
        events.extend(session.run())

    with pytest.raises(LinkError):
        run()
    assert dead.closed
    assert fresh.log == [("make_safe",)]
    assert fresh.level_vpk == 0.0
    assert fresh.closed
    assert store.measurement(1).source_state is OFF
    assert "reconnected" in [event.kind for event in store.events(1)]


def test_lasting_connection_loss_leaves_source_unknown(store):
    def refuse():
        raise LinkError("no route")

    dead = FakeAnalyser({("point", 6): LinkError("cable pulled")}, safe=(OFF, UNKNOWN))
    with pytest.raises(LinkError, match="cable pulled"):
        list(Session(dead, store, request(), reopen=refuse).run())
    assert store.measurement(1).source_state is UNKNOWN


def test_connection_that_cannot_close_is_reopened(store):
    """Nor does it matter what opening it raises: going safe raises nothing."""
    faults = {("point", 6): LinkError("cable pulled")}
    dead, fresh = FakeAnalyser(faults, safe=(OFF, UNKNOWN)), FakeAnalyser()

    def broken():
        raise OSError("no space left on device")

    dead.close = broken
    with pytest.raises(LinkError, match="cable pulled"):
        list(Session(dead, store, request(), reopen=lambda: fresh).run())
    assert store.measurement(1).source_state is OFF
    dead = FakeAnalyser(faults, safe=(OFF, UNKNOWN))
    with pytest.raises(LinkError, match="cable pulled"):
        list(Session(dead, store, request(), reopen=broken).run())
    assert store.measurement(2).source_state is UNKNOWN


def test_answer_without_proof_causes_no_reconnection(store):
    def never():
        raise AssertionError("opened again")

    dead = FakeAnalyser({("point", 6): LinkError("gone")}, safe=(OFF, UNCONFIRMED))
    with pytest.raises(LinkError):
        list(Session(dead, store, request(), reopen=never).run())


def test_a_pause_survives_a_lost_connection(store):
    control = SessionControl()
    dead, fresh = FakeAnalyser(safe=(OFF, UNKNOWN)), FakeAnalyser()

    def hold():
        control.pause()
        threading.Timer(0.3, control.go_on).start()

    dead.faults[("point", 4)] = hold
    finished = list(Session(dead, store, request(), control, reopen=lambda: fresh).run())[-1]
    assert finished.state == "complete"
    assert fresh.closed
    assert fresh.driven[0][1] == 100.0
