"""Short measurements with the verb `measure`, for the tests of what becomes of them."""

import signal

from daq.session_events import PointStored

SHORT = ["--level", "2.5", "--start", "130", "--stop", "170", "--points", "5"]
QUICK = ["--settle-cycles", "3", "--integrate-cycles", "4"]
STATES = {"confirmed-off", "unconfirmed", "unknown"}


def measuring(*words, url="sim:?ratio=0.3&seed=1", unit="adss", plan=SHORT):
    return ["measure", "--unit", unit, "--instrument", url, *plan, *QUICK, *words]


def at_point(monkeypatch, number, act):
    """Do something as soon as a point is told."""
    from tui.commands import measure

    whole = measure.tell_event

    def tell(event, console):
        whole(event, console)
        if isinstance(event, PointStored) and event.done == number:
            act()

    monkeypatch.setattr(measure, "tell_event", tell)


def stopped(run, monkeypatch, points=2):
    with monkeypatch.context() as patch:
        at_point(patch, points, lambda: signal.raise_signal(signal.SIGINT))
        assert run(*measuring("--serial", "S"))[0] == 130
