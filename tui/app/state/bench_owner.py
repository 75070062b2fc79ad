"""The one worker that holds the instrument: connecting, sessions, switching the source off.

Owns what runs on that thread. It draws nothing: all it knows goes out as
messages, and all that reaches a running session is its control.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from contextlib import closing, suppress
from typing import TYPE_CHECKING

from textual.message import Message

from daq.analyser import SourceState
from daq.errors import LashbenchError
from daq.servers.place import HistoryPlace
from tui.app.messages import (
    InstrumentFailed,
    InstrumentFound,
    InstrumentsListed,
    SessionEnded,
    SessionPreloaded,
    SessionRefused,
    SessionTold,
    SourceStopped,
)

if TYPE_CHECKING:
    from daq.control import SessionControl
    from daq.session_request import SessionRequest
    from daq.store_records import StoredPoint
    from sim.unit import Unit

__all__ = ["find_instruments", "look_at", "run_session", "stop_source"]

Post = Callable[[Message], object]
"""Hands a message to the application from any thread."""

_LOG = logging.getLogger("lashbench.bench")


def look_at(post: Post, url: str, unit: Unit) -> None:
    """Connect, ask who is there and what the source does, and let go again; drives nothing."""
    from tui.bench import connect

    try:
        with closing(connect(url, unit)) as analyser:
            identity = analyser.identify()
            source = analyser.source_state()
    except Exception as error:
        _log(error, "looking at %s", url)
        post(InstrumentFailed(url, error))
        return
    post(InstrumentFound(url, identity, source))


def stop_source(post: Post, url: str, unit: Unit) -> None:
    """Run the safe-off recipe where no session does."""
    from tui.bench import connect

    try:
        with closing(connect(url, unit)) as analyser:
            state = analyser.make_safe()
    except Exception as error:
        _log(error, "switching off the source at %s", url)
        post(SourceStopped(SourceState.UNKNOWN, str(error)))
        return
    post(SourceStopped(state, url))


def run_session(
    post: Post,
    url: str,
    unit: Unit,
    history: HistoryPlace,
    asked: Callable[[], SessionRequest],
    control: SessionControl,
) -> None:
    """Run a session to its end and tell every record of it; what is asked is read first."""
    from tui.bench import bench_session

    try:
        request = asked()
        if request.resume is not None:
            post(SessionPreloaded(_stored_points(history, request.resume)))
    except Exception as fault:
        _log(fault, "beginning a session on %s", url)
        post(SessionRefused(fault))
        return
    error: Exception | None = None
    try:
        with closing(bench_session(url, unit, history, request, control)) as events:
            for event in events:
                post(SessionTold(event))
    except Exception as fault:
        _log(fault, "session on %s", url)
        error = fault
    post(SessionEnded(error))


def find_instruments(post: Post) -> None:
    """List what could be an instrument on this machine; opens none of them."""
    found: list[tuple[str, str]] = []
    notes: list[str] = []
    try:
        from serial.tools.list_ports import comports

        found += [
            (f"prologix:{port.device}?addr=11", f"serial port, {port.description or 'no name'}")
            for port in comports()
        ]
    except Exception as error:  # whatever a platform's port listing raises is no reason to end
        notes.append(f"serial ports cannot be listed ({error})")
    try:
        found += [(name, "VISA resource") for name in _visa_resources()]
    except Exception as error:  # back ends raise bare Exception, ValueError, OSError
        notes.append(f"VISA resources cannot be listed ({' '.join(str(error).split())})")
    post(InstrumentsListed(found, notes))


def _stored_points(history: HistoryPlace, measurement: int) -> list[StoredPoint]:
    from daq.store import Store

    with Store(history, read_only=True) as store:
        return store.points(measurement)


def _visa_resources() -> list[str]:
    """Names of VISA resources of a kind that can be opened here."""
    import warnings

    import pyvisa

    from daq.errors import ConfigurationError
    from daq.transports.address import parse_address

    names = []
    with warnings.catch_warnings():
        # It warns of optional packages that would find more.
        warnings.simplefilter("ignore")
        manager = pyvisa.ResourceManager()
        for name in manager.list_resources():
            with suppress(ConfigurationError):
                parse_address(name)
                names.append(name)
        manager.close()
    return names


def _log(error: Exception, doing: str, *about: object) -> None:
    if isinstance(error, LashbenchError):
        _LOG.warning(f"{doing}: %s", *about, error)
    else:
        _LOG.error(doing, *about, exc_info=error)
