"""From an instrument's address to a session on it, for the command line and the screens alike.

Owns how lock, history, connection, session and watchdog are put together and
taken apart again. It prints nothing and decides nothing about a measurement.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, closing, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Self, TypeVar

from daq.errors import Interrupted, LashbenchError, MeasurementError
from daq.servers.place import HistoryPlace

if TYPE_CHECKING:
    from daq.analyser import Analyser
    from daq.control import SessionControl
    from daq.driving.entry import Driver
    from daq.limits import Limits
    from daq.session import Session
    from daq.session.bench_lock import BenchLock
    from daq.session.watchdog import Watchdog
    from daq.session_events import Finished, SessionEvent
    from daq.session_request import SessionRequest
    from daq.store import Store
    from daq.transports.base import Transport
    from daq.untrusted.bounded_calls import Aside
    from sim.unit import Unit

__all__ = ["bench_session", "connect", "connect_wire", "drives_hardware", "unit_limits"]

_LOCK_S = 60.0
"""Bound of having the bench's lock, which waits for the watchdog of a session that was killed."""
_Held = TypeVar("_Held")


def drives_hardware(url: str) -> bool:
    """Whether something outside of this program may move when that address is measured.

    Raises
    ------
    ConfigurationError
        If it is no address.
    """
    from daq.drivers import parse_instrument
    from daq.transports.address import HostedAddress, ReplayFile

    match parse_instrument(url):
        case HostedAddress(scheme=scheme):
            return scheme != "sim"
        case ReplayFile():
            return False
    return True


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
) -> Analyser:
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
        As `daq.drivers.open_analyser`.
    """
    from daq.drivers import driver_at, is_simulated, open_analyser
    from daq.transports.open import TransportFactory

    factories: dict[str, TransportFactory] = {}
    if is_simulated(url):
        from sim.loopback import open_loopback

        factories["sim"] = open_loopback(unit, scheme=driver_at(url)[0].scheme)
    return open_analyser(url, factories, record=transcript, fault=fault)


def connect_wire(url: str, unit: Unit, transcript: Path | None = None) -> tuple[Driver, Transport]:
    """The driver of an address and an open wire; parameters and errors are those of `connect`."""
    from daq.drivers import driver_at, is_simulated, parse_instrument
    from daq.transports.open import TransportFactory, open_transport

    driver, address = driver_at(url)
    factories: dict[str, TransportFactory] = {
        scheme: wire.open for scheme, wire in driver.wires.items()
    }
    if is_simulated(url):
        from sim.loopback import open_loopback

        factories["sim"] = open_loopback(unit, scheme=driver.scheme)
    parse_instrument(url, tuple(factories))
    return driver, open_transport(
        address, factories, record=transcript, gpib_address=driver.gpib_address
    )


def bench_session(
    url: str,
    unit: Unit,
    history: HistoryPlace,
    request: SessionRequest,
    control: SessionControl,
    transcript: Path | None = None,
) -> Generator[SessionEvent, None, None]:
    """Run a session and yield what it tells; close the iterator to end it early.

    On hardware a watchdog stands by from before the first volt until the
    source is proven off. Where the session cannot prove that, it waits for the watchdog, which
    goes on trying, and its last record says what that one proved.

    Raises
    ------
    Interrupted
        Before the first record: if an end was asked for.
    LashbenchError
        Before the first record: if history, lock or instrument cannot be had.
        After the last: the fault that ended the session.
    """
    from daq.analyser import SourceState
    from daq.control import Cancelled
    from daq.session import Session
    from daq.session.bench_lock import BenchLock
    from daq.session.history import ANSWER_S
    from daq.session_events import CheckLine, Finished, Opened, SourceSafe, Warned
    from daq.store import Store
    from daq.untrusted.bounded_calls import Aside

    is_real = drives_hardware(url)
    reopen: Callable[[], Analyser] | None = (lambda: connect(url, unit)) if is_real else None
    faults: list[str] = []
    aside = Aside("history")
    with ExitStack() as stack:
        stack.callback(aside.end)
        place = _Place(aside, history, control, stack)
        try:
            store = place.held(
                lambda: Store(history, create=request.resume is None), Store.close, ANSWER_S
            )
            lock = place.held(
                lambda: BenchLock(history, instrument=url), BenchLock.release, _LOCK_S
            )
        except Cancelled as cut:
            raise Interrupted(f"{cut}; nothing was driven") from cut
        # The watchdog opens the instrument anew, which must be free by then.
        watched = stack.enter_context(_Watched(url, history, lock, place) if is_real else _Alone())
        analyser = connect(url, unit, transcript, faults.append)
        stack.callback(analyser.close)
        session = Session(analyser, store, request, control, reopen, watched.watch, aside)
        watched.session, watched.store = session, store
        with closing(session.run()) as events:
            for event in events:
                if isinstance(event, Opened):
                    watched.measures(event.measurement)
                if isinstance(event, CheckLine) and event.name == "source":
                    # It is an analyser that may drive, and not something else that keeps silent.
                    watched.may_drive = True
                while faults:
                    yield Warned(faults.pop(0))
                if isinstance(event, Finished) and watched.goes_on(event):
                    yield Warned(
                        f"the source is {event.source_state.value}; the watchdog opens the "
                        "instrument anew and goes on trying; waiting for it, an interrupt ends that"
                    )
                    analyser.close()
                    for text in watched.waited(control):
                        yield Warned(text)
                    event = replace(event, source_state=SourceState(watched.proven))
                    session.finished = event
                    yield SourceSafe(event.source_state)
                yield event


class _Place:
    """History and lock of a session, had and let go of in bounded time."""

    def __init__(
        self, aside: Aside, history: HistoryPlace, control: SessionControl, stack: ExitStack
    ) -> None:
        self._aside = aside
        self._history = history
        self._control = control
        self._stack = stack

    def held(
        self, get: Callable[[], _Held], let_go: Callable[[_Held], None], bound_s: float
    ) -> _Held:
        """Have something that lies on the history's file system, until the session's end."""
        from daq.session.history import answered

        got = answered(
            self._aside, get, str(self._history), bound_s=bound_s, look=self._control.check
        )
        self._stack.callback(self._leave, lambda: let_go(got))
        return got

    def answered(self, call: Callable[[], _Held]) -> _Held:
        """Ask the history something."""
        from daq.session.history import answered

        return answered(self._aside, call, str(self._history))

    def _leave(self, let_go: Callable[[], None]) -> None:
        # The system lets go of what cannot be let go of here, with the end of the process.
        if not self._aside.is_stuck:
            with suppress(MeasurementError):
                self.answered(let_go)


class _Alone:
    """What lives and dies with the session needs nobody to stand by."""

    def __init__(self) -> None:
        self.watch: Watchdog | None = None
        self.session: Session | None = None
        self.store: Store | None = None
        self.measurement = 0
        self.may_drive = False
        self.proven = "unknown"
        """What was proven of the source when the session was over."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing is left to be done."""

    def measures(self, measurement: int) -> None:
        """The measurement has its number."""
        self.measurement = measurement

    def goes_on(self, finished: Finished) -> bool:
        """Whether somebody tries on where the session could not prove the source off."""
        return False

    def waited(self, control: SessionControl) -> Iterator[str]:
        """Wait for what is proven then, and say it."""
        yield from ()


class _Watched(_Alone):
    """A watchdog for the length of a session, and what becomes of it at the end."""

    def __init__(self, url: str, history: HistoryPlace, lock: BenchLock, place: _Place) -> None:
        from daq.session.watchdog import Watchdog

        super().__init__()
        self._place = place
        self._watchdog = self.watch = Watchdog(url, history, lock.descriptor)

    def measures(self, measurement: int) -> None:
        super().measures(measurement)
        self._watchdog.measures(measurement)

    def goes_on(self, finished: Finished) -> bool:
        return self.may_drive and finished.source_state.value != "confirmed-off"

    def waited(self, control: SessionControl) -> Iterator[str]:
        asked = control.asked
        said = self._watchdog.see_to_it(lambda: control.asked == asked)
        self.proven = said or self.proven
        yield (
            f"the watchdog: source {said}"
            if said
            else ("the watchdog has not said yet what became of the source; the history will tell")
        )

    def __exit__(self, *_: object) -> None:
        """Dismiss it where the source is proven off, as the history says; else leave it to work."""
        from daq.analyser import SourceState

        if not self.may_drive:
            self._watchdog.dismiss()
            return
        finished = None if self.session is None else self.session.finished
        is_off = finished is not None and finished.source_state is SourceState.CONFIRMED_OFF
        said = None
        store = self.store
        if store is not None:
            with suppress(LashbenchError):
                said = self._place.answered(lambda: store.measurement(self.measurement))
        if said is not None and said.source_state is SourceState.CONFIRMED_OFF:
            self._watchdog.dismiss()
        elif finished is not None and is_off:
            text = f"the session ended, which its history did not take then: {finished.reason}"
            self._watchdog.write_down(finished.source_state.value, text)
        else:
            self._watchdog.leave()
