"""The Stanford Research Systems SR785 as a swept-sine analyser.

Owns the state of the driver and the order of things: identify, prepare, level last, points, quiet
again, safe. What settings, words, sweeps and the safe-off recipe are is said in the modules beside
this one. Nothing here was watched on a real instrument; docs/sr785.md lists what to check first.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence

from daq.analyser import Identity, PointSettings, SourceState, SweepPoint
from daq.driving.safe_off import SafeOff
from daq.errors import LashbenchError, LimitError, MeasurementError
from daq.sr785.dialogue import Dialogue
from daq.sr785.identity import identify
from daq.sr785.plan import Grid, grids_of, repeats_at
from daq.sr785.safe import make_safe, read_source
from daq.sr785.settings import MODELS, START
from daq.sr785.setup import SetUp, Timing, apply_all, enter_swept_sine, planned_settings
from daq.sr785.sweeps import Knowledge, measure, quiet
from daq.transports.base import Transport

__all__ = ["SR785"]

_LOCK_PATIENCE_S = 6.0
"""How long going safe waits for an exchange of another thread to end before it goes on anyway."""


class SR785:
    """The `Analyser` protocol over any `Transport`.

    Parameters
    ----------
    transport
        Open wire to the instrument; closed with the driver.
    timing
        Bounds of waits.

    Notes
    -----
    Evenly spaced frequencies are swept in one go. Any others, and all where the instrument gives
    no variance (an SR780) or loses its data when a display is changed, are measured one by one in
    sweeps too narrow to matter, between which the source stops.
    """

    def __init__(self, transport: Transport, *, timing: Timing | None = None) -> None:
        self.safe_off: SafeOff | None = None
        """What the last run of the safe-off recipe did, step by step."""
        self._timing = timing or Timing()
        self._transport = transport
        self._dialogue = Dialogue(transport, self._timing.reply_s, self._timing.block_s)
        self._model: str | None = None
        self._knowledge = Knowledge()
        self._setup: SetUp | None = None
        self._times_made_safe = 0

    @property
    def on_wait(self) -> Callable[[], None] | None:
        """Called at least five times a second while an operation is waited for; may raise.

        A reply that does not come is not interrupted: it has a bound of its own.
        """
        return self._dialogue.on_wait

    @on_wait.setter
    def on_wait(self, look: Callable[[], None] | None) -> None:
        self._dialogue.on_wait = look

    @property
    def on_exchange(self) -> Callable[[float], None] | None:
        """Told before each exchange how long it may take at most, s; must not raise."""
        return self._dialogue.on_exchange

    @on_exchange.setter
    def on_exchange(self, told: Callable[[float], None] | None) -> None:
        self._dialogue.on_exchange = told

    @property
    def wire_lacks(self) -> tuple[str, ...]:
        """What the way to the instrument turned out not to have, such as a serial poll."""
        return tuple(getattr(self._transport, "lacks", ()))

    def identify(self) -> Identity:
        """Ask who is there, and refuse anything but an SR785 or SR780."""
        with self._dialogue.lock:
            found = identify(self._dialogue)
        self._model = found.model
        if MODELS[found.model].variances is None:
            # Nothing tells the error of a point but repeating it.
            self._knowledge.data_survive = False
        return found

    def prepare(
        self, start_hz: float, stop_hz: float, settings: PointSettings
    ) -> Mapping[str, str]:
        """Set everything but level and offset, read it back, and return what was read.

        Raises
        ------
        LimitError
            If any value is outside the instrument's range; nothing was sent.
        InstrumentError
            If the instrument complains or reads back something else.
        """
        if self._model is None:
            self.identify()
        numbers = MODELS[self._model or "SR785"]
        table = planned_settings(start_hz, stop_hz, settings, numbers)
        known, self._setup = self._setup, None
        dialogue = self._dialogue
        with dialogue.lock:
            if known is None or not dialogue.trusted:
                scale = enter_swept_sine(dialogue, numbers)
            else:
                scale = known.scale
            read_back = apply_all(dialogue, table)
            dialogue.trusted = True
        self._setup = SetUp(settings, start_hz, stop_hz, tuple(table), numbers, scale)
        return read_back

    def sweep(self, frequencies_hz: Sequence[float]) -> Iterator[SweepPoint]:
        """Drive the source and yield each point as soon as it is sure, in the order given.

        Closing the generator early stops the sweep and takes level and offset to 0.

        Raises
        ------
        MeasurementError
            At once if `prepare` has not been called since the last trouble; in the run if the
            source was made safe from elsewhere.
        LimitError
            At once if a frequency is outside the band that was prepared.
        """
        frequencies = [float(frequency_hz) for frequency_hz in frequencies_hz]
        setup = self._setup
        if setup is None or not self._dialogue.trusted:
            raise MeasurementError("the analyser is not set up; prepare it before the sweep")
        for frequency_hz in frequencies:
            START.command(frequency_hz)
            if not setup.start_hz <= frequency_hz <= setup.stop_hz:
                raise LimitError(
                    f"frequency {frequency_hz:g} Hz is outside the prepared band of "
                    f"{setup.start_hz:g} to {setup.stop_hz:g} Hz; nothing was sent"
                )
        return self._run(setup, frequencies)

    def source_state(self) -> SourceState:
        """What a read-back says of the source now."""
        with self._dialogue.lock:
            return read_source(self._dialogue)

    def make_safe(self) -> SourceState:
        """Run the safe-off recipe and say what could be proven; see `safe_off` for the steps.

        May be called twice and from any thread, and never raises.
        """
        self._times_made_safe += 1
        self._setup = None
        # An exchange of another thread is let finish, so that its reply is not taken for
        # ours; one that hangs longer than its own bound is not waited for.
        held = self._dialogue.lock.acquire(timeout=_LOCK_PATIENCE_S)
        try:
            self._dialogue.trusted = False
            interface = self._dialogue.interface
            self.safe_off = make_safe(self._transport, self.on_exchange, interface)
        finally:
            if held:
                self._dialogue.lock.release()
        return self.safe_off.state

    def close(self) -> None:
        """Let go of the connection; does not touch the source."""
        self._transport.close()

    def _sweeps(self, setup: SetUp, frequencies: Sequence[float]) -> list[Grid]:
        band_hz = setup.start_hz, setup.stop_hz
        if self._knowledge.data_survive is not False:
            grids = grids_of(frequencies, band_hz, setup.settings)
            if grids is not None:
                return grids
        return [repeats_at(hz, band_hz, setup.settings) for hz in frequencies]

    def _run(self, setup: SetUp, frequencies: Sequence[float]) -> Iterator[SweepPoint]:
        dialogue, times = self._dialogue, self._times_made_safe

        def guard() -> None:
            if self._times_made_safe != times:
                raise MeasurementError("the source was made safe while the sweep ran; it ends here")
            if self.on_wait is not None:
                self.on_wait()

        sweeps = self._sweeps(setup, frequencies)
        try:
            guard()
            yield from measure(dialogue, setup, self._timing, self._knowledge, sweeps, guard)
        except BaseException as error:
            # The first fault is the one to report; the session makes safe in any case.
            with contextlib.suppress(LashbenchError):
                if not isinstance(error, LashbenchError):
                    dialogue.recover()  # an interrupt may have come between question and answer
                quiet(dialogue)
            dialogue.trusted = False
            raise
        quiet(dialogue)
        dialogue.check("end of the sweep")
