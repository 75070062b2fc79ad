"""An analyser without a wire that can fail in every way, for tests of the session alone."""

import time
from collections.abc import Callable

import numpy as np

from daq.analyser import Identity, PointSettings, SourceState, SweepPoint
from daq.errors import BenchTimeout
from daq.frf import PointFlag


def known_gain(frequency_hz: float) -> complex:
    """A resonance whose value at any frequency is known."""
    s = 1j * frequency_hz / 140.0
    return 0.3 * (s * s + 0.05 * s + 0.8) / (s * s + 0.1 * s + 1.2)


class FakeAnalyser:
    """The `Analyser` protocol over a known response.

    Parameters
    ----------
    faults
        What happens, by the moment it happens at: "identify", "source_state",
        "prepare", "safe", "safe-end", "close", ("point", n) before point n of
        the whole life of this analyser, ("after", n) after it was yielded. A
        fault is an exception to raise or a function to call.
    gain
        The response.
    point_s
        Wall time of a point.
    safe
        What `make_safe` can prove, one after the other; the last one stays.
    """

    def __init__(
        self,
        faults=None,
        gain: Callable[[float], complex] = known_gain,
        *,
        point_s: float = 0.0,
        safe=(SourceState.CONFIRMED_OFF,),
        found: SourceState = SourceState.UNCONFIRMED,
        identity: Identity | None = None,
        readback=None,
        flags=None,
    ) -> None:
        self.on_wait = None
        self.faults = dict(faults or {})
        self.log: list[tuple] = []
        self.level_vpk = 0.0
        self.driven: list[tuple[float, float]] = []
        """Level and frequency of every point that was driven, trial and run-in included."""
        self.points = 0
        self.closed = False
        self._gain = gain
        self._point_s = point_s
        self._safe = list(safe)
        self._found = found
        self._identity = identity or Identity("HEWLETT-PACKARD", "35670A", "MY1", "A.1", ("1D2",))
        self._readback = readback or {"SWE:STIM": "5 CYCLE"}
        self._flags = flags or {}
        self._settings: PointSettings | None = None

    def _strike(self, moment) -> None:
        fault = self.faults.pop(moment, None)
        if isinstance(fault, BaseException):
            raise fault
        if fault is not None:
            fault()

    def wait(self, seconds: float, bound_s: float = 5.0) -> None:
        """Wait as a driver does: bounded, and looking at `on_wait`."""
        began = time.monotonic()
        if self.on_wait is not None:
            self.on_wait()
        while time.monotonic() - began < seconds:
            if self.on_wait is not None:
                self.on_wait()
            if time.monotonic() - began > bound_s:
                raise BenchTimeout("the fake waited too long")
            time.sleep(0.002)

    def identify(self) -> Identity:
        self.log.append(("identify",))
        self._strike("identify")
        return self._identity

    def prepare(self, start_hz, stop_hz, settings):
        self.log.append(("prepare", settings.source_vpk))
        self._strike("prepare")
        assert self.level_vpk == 0.0, "set up while the source drives"
        self._settings = settings
        return self._readback

    def sweep(self, frequencies_hz):
        assert self._settings is not None, "not prepared"
        self.log.append(("sweep", tuple(frequencies_hz)))
        return self._run(list(frequencies_hz), self._settings)

    def _run(self, frequencies, settings):
        try:
            self.level_vpk = settings.source_vpk
            for frequency_hz in frequencies:
                self.points += 1
                self._strike(("point", self.points))
                self.wait(self._point_s)
                self.driven.append((settings.source_vpk, frequency_hz))
                yield SweepPoint(
                    frequency_hz,
                    self._gain(frequency_hz),
                    0.01,
                    0.05,
                    self._flags.get(self.points, PointFlag(0)),
                    (1e-6, 1e-5),
                )
                self._strike(("after", self.points))
        finally:
            self.level_vpk = 0.0
            self._strike("close")

    def source_state(self):
        self.log.append(("source_state",))
        self._strike("source_state")
        return self._found

    def make_safe(self):
        self.log.append(("make_safe",))
        self._strike("safe")
        self.level_vpk = 0.0
        self._settings = None
        self._strike("safe-end")
        return self._safe.pop(0) if len(self._safe) > 1 else self._safe[0]

    def close(self):
        self.closed = True


def gains(response, level: float) -> np.ndarray:
    """Gains of one level by frequency."""
    return response.at_level(level).gain
