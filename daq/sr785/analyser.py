"""The Stanford Research Systems SR785 as a swept-sine analyser.

Owns the state of the driver and the order of things: identify, prepare, level last, points, quiet
again, safe. What settings, words, sweeps and the safe-off recipe are is said in the modules beside
this one. Nothing here was watched on a real instrument; docs/sr785.md lists what to check first.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from daq.analyser import Identity, PointSettings, SourceState, SweepPoint
from daq.driving.driven import DrivenAnalyser
from daq.driving.safe_off import SafeOff
from daq.errors import LimitError, MeasurementError
from daq.sr785.dialogue import Dialogue
from daq.sr785.identity import identify
from daq.sr785.plan import Grid, grids_of, repeats_at
from daq.sr785.safe import make_safe, read_source
from daq.sr785.settings import MODELS, START
from daq.sr785.setup import SetUp, Timing, apply_all, enter_swept_sine, planned_settings
from daq.sr785.sweeps import Knowledge, measure, quiet
from daq.transports.base import Transport

__all__ = ["SR785"]


class SR785(DrivenAnalyser[Dialogue, SetUp]):
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
        self._timing = timing or Timing()
        dialogue = Dialogue(transport, self._timing.reply_s, self._timing.block_s)
        super().__init__(transport, dialogue)
        self._model: str | None = None
        self._knowledge = Knowledge()

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

    def _switch_off(self) -> SafeOff:
        return make_safe(self._transport, self.on_exchange, self._dialogue.interface)

    def _resynchronise(self) -> None:
        self._dialogue.recover()

    def _quiet(self) -> None:
        quiet(self._dialogue)

    def _sweeps(self, setup: SetUp, frequencies: Sequence[float]) -> list[Grid]:
        band_hz = setup.start_hz, setup.stop_hz
        if self._knowledge.data_survive is not False:
            grids = grids_of(frequencies, band_hz, setup.settings)
            if grids is not None:
                return grids
        return [repeats_at(hz, band_hz, setup.settings) for hz in frequencies]

    def _run(self, setup: SetUp, frequencies: Sequence[float]) -> Iterator[SweepPoint]:
        dialogue, sweeps = self._dialogue, self._sweeps(setup, frequencies)
        with self._driving() as guard:
            guard()
            yield from measure(dialogue, setup, self._timing, self._knowledge, sweeps, guard)
        dialogue.check("end of the sweep")
