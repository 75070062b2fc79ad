"""From an instrument's address to a session on it, for the command line and the screens alike.

Owns how lock, history, connection, session and watchdog are put together and
taken apart again. It prints nothing and decides nothing about a measurement.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from daq.errors import LashbenchError

if TYPE_CHECKING:
    from daq.control import SessionControl
    from daq.hp35670a import HP35670A
    from daq.limits import Limits
    from daq.session_events import SessionEvent
    from daq.session_request import SessionRequest
    from daq.store import Store
    from daq.watchdog import Watchdog
    from sim.unit import Unit

__all__ = ["bench_session", "connect", "drives_hardware", "unit_limits"]


def drives_hardware(url: str) -> bool:
    """Whether something outside of this program may move when that address is measured.

    Raises
    ------
    ConfigurationError
        If it is no address.
    """
    from daq.transports.address import HostedAddress, ReplayFile, parse_address

    return not isinstance(parse_address(url), HostedAddress | ReplayFile)


def unit_limits(unit: Unit) -> Limits:
    """What a unit may be driven with, as limits of a session."""
    from daq.limits import Limits

    limits = unit.limits
    return Limits(
        set_by=f"unit {unit.name}",
        source_vpk=limits.source_vpk,
        source_offset_v=limits.source_offset_v,
        start_hz=limits.start_hz,
        stop_hz=limits.stop_hz,
    )


def connect(
    url: str,
    unit: Unit,
    transcript: Path | None = None,
    fault: Callable[[str], None] | None = None,
) -> HP35670A:
    """Open the instrument at an address; ``sim:`` is a simulated one with the unit behind it.

    Parameters
    ----------
    transcript
        New file that records the dialogue.
    fault
        Told if that file takes no more.

    Raises
    ------
    ConfigurationError, LinkError, InputError
        As `daq.transports.open.open_transport`.
    """
    from daq.hp35670a import HP35670A
    from daq.transports.open import TransportFactory, open_transport

    factories: dict[str, TransportFactory] = {}
    if url.strip().startswith("sim:"):
        from sim.loopback import open_loopback

        factories["sim"] = open_loopback(unit)
    return HP35670A(open_transport(url, factories, record=transcript, fault=fault))


def bench_session(
    url: str,
    unit: Unit,
    history: Path,
    request: SessionRequest,
    control: SessionControl,
    transcript: Path | None = None,
) -> Generator[SessionEvent, None, None]:
    """Run a session and yield what it tells; close the iterator to end it early.

    On hardware a watchdog stands by from before the first volt until the
    source is proven off; where it never is, the watchdog goes on trying when this ends.

    Raises
    ------
    LashbenchError
        Before the first record: if history, lock or instrument cannot be had.
        After the last: the fault that ended the session.
    """
    from daq.bench_lock import BenchLock
    from daq.session import Session
    from daq.session_events import CheckLine, Opened, Warned
    from daq.store import Store
    from daq.watchdog import Watchdog

    is_real = drives_hardware(url)
    reopen: Callable[[], HP35670A] | None = (lambda: connect(url, unit)) if is_real else None
    faults: list[str] = []
    with ExitStack() as stack:
        store = stack.enter_context(Store(history, create=request.resume is None))
        lock = stack.enter_context(BenchLock(history, instrument=url))
        analyser = connect(url, unit, transcript, faults.append)
        # The watchdog opens the instrument anew, which must be free by then.
        watch = stack.enter_context(ExitStack())
        stack.callback(analyser.close)
        session = Session(analyser, store, request, control, reopen)
        with closing(session.run()) as events:
            for event in events:
                if isinstance(event, Opened) and is_real:
                    measurement = event.measurement
                    watchdog = Watchdog(url, history, measurement, lock.descriptor)
                    watch.callback(watchdog.dismiss)
                if isinstance(event, CheckLine) and event.name == "source" and is_real:
                    # It is an analyser that may drive, and not something else that keeps silent.
                    watch.pop_all()
                    watch.callback(_stand_down, watchdog, store, measurement)
                while faults:
                    yield Warned(faults.pop(0))
                yield event


def _stand_down(watchdog: Watchdog, store: Store, measurement: int) -> None:
    """Dismiss it where the source is proven off, as the history says; else leave it to its work."""
    from daq.analyser import SourceState

    state = None
    with suppress(LashbenchError):
        state = store.measurement(measurement).source_state
    if state is SourceState.CONFIRMED_OFF:
        watchdog.dismiss()
    else:
        watchdog.leave()
