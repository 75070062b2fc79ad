"""The band of a sweep: start, stop, centre and span, kept consistent on their grid.

Owns the rounding of frequencies (1/64 Hz; start and centre down, stop and
span up) and what follows when one of the four is set. It plans no points.
"""

from __future__ import annotations

import math

from sim.analyser35670a.errors import ScpiError
from sim.analyser35670a.parts import InstrumentCore
from sim.analyser35670a.settings import Mode
from sim.analyser35670a.units import Quantity

__all__ = [
    "GRID_HZ",
    "band",
    "check_manual",
    "check_start",
    "check_stop",
    "get_centre",
    "get_span",
    "highest_hz",
    "set_centre",
    "set_span",
]

GRID_HZ = 1.0 / 64.0
_SLACK = 1e-9
_OUT_OF_RANGE = "Out of range: value not changed."


def _down(hz: float) -> float:
    return math.floor(hz / GRID_HZ + _SLACK) * GRID_HZ


def _up(hz: float) -> float:
    return math.ceil(hz / GRID_HZ - _SLACK) * GRID_HZ


def highest_hz(instrument: InstrumentCore) -> float:
    """Upper end of the band: half with four channels, double with one in FFT mode."""
    if instrument.settings.get("INP#", 4):
        return 25600.0
    single = instrument.settings.mode is not Mode.SINE and not instrument.settings.get("INP#", 2)
    return 102400.0 if single else 51200.0


def _lowest_hz(instrument: InstrumentCore) -> float:
    return GRID_HZ if instrument.settings.mode is Mode.SINE else 0.0


def band(instrument: InstrumentCore) -> tuple[float, float]:
    """Start and stop of the present mode, Hz."""
    settings = instrument.settings
    return settings.get("FREQ:STAR").value, settings.get("FREQ:STOP").value


def _put(instrument: InstrumentCore, start_hz: float, stop_hz: float) -> None:
    lowest, highest = _lowest_hz(instrument), highest_hz(instrument)
    if not (lowest <= start_hz and stop_hz <= highest and stop_hz - start_hz >= GRID_HZ / 2):
        raise ScpiError(-222, _OUT_OF_RANGE)
    instrument.settings.put("FREQ:STAR", Quantity(start_hz, "HZ"))
    instrument.settings.put("FREQ:STOP", Quantity(stop_hz, "HZ"))


def check_start(instrument: InstrumentCore, _numbers: tuple[int, ...], asked: Quantity) -> Quantity:
    """Round down. [S] The stop stays where it can; otherwise the span goes along."""
    start, stop = band(instrument)
    new = _down(asked.value)
    fixed_span = instrument.settings.mode is not Mode.SINE
    if fixed_span or new >= stop:
        span = stop - start
        stop = min(new + span, highest_hz(instrument))
    _put(instrument, new, stop)
    return Quantity(new, "HZ")


def check_stop(instrument: InstrumentCore, _numbers: tuple[int, ...], asked: Quantity) -> Quantity:
    """Round up; the start is held and becomes the anchor."""
    start, stop = band(instrument)
    new = _up(asked.value)
    if new <= start:
        # [S] A band cannot end below its start: the start goes along, as far as it can.
        start = max(new - (stop - start), _lowest_hz(instrument))
    _put(instrument, start, new)
    instrument.settings.put("FREQ:SPAN:LINK", "STAR")
    return Quantity(new, "HZ")


def get_span(instrument: InstrumentCore) -> float:
    """Stop minus start, Hz."""
    start, stop = band(instrument)
    return stop - start


def get_centre(instrument: InstrumentCore) -> float:
    """Middle of the band, on the grid, Hz."""
    start, stop = band(instrument)
    return _down((start + stop) / 2.0)


def set_span(instrument: InstrumentCore, asked: Quantity) -> None:
    """Round up; the anchor (start or centre) is held. Decades and octaves with log spacing only."""
    start, _stop = band(instrument)
    settings = instrument.settings
    if asked.unit in ("DEC", "OCT"):
        if settings.mode is not Mode.SINE or settings.get("SWE:SPAC") != "LOG":
            raise ScpiError(-131)
        base = 10.0 if asked.unit == "DEC" else 2.0
        if not 0.0 < asked.value <= 64.0:
            raise ScpiError(-222, _OUT_OF_RANGE)
        span = start * (base**asked.value - 1.0)
    else:
        span = asked.value
    if not GRID_HZ <= span <= highest_hz(instrument):
        raise ScpiError(-222, _OUT_OF_RANGE)
    span = _up(span)
    if settings.mode is Mode.FFT:
        span = _fft_span(instrument, span)
    if settings.get("FREQ:SPAN:LINK") == "CENT":
        start = _down(get_centre(instrument) - span / 2.0)
    _put(instrument, start, start + span)


def _fft_span(instrument: InstrumentCore, span: float) -> float:
    """The next wider of the spans that halve from the widest."""
    widest = highest_hz(instrument)
    halvings = max(0, min(19, math.floor(math.log2(widest / span) + _SLACK)))
    return float(widest / 2**halvings)


def set_centre(instrument: InstrumentCore, asked: Quantity) -> None:
    """Round down; the span stays."""
    span = get_span(instrument)
    centre = _down(asked.value)
    start = _down(centre - span / 2.0)
    _put(instrument, start, start + span)
    instrument.settings.put("FREQ:SPAN:LINK", "CENT")


def check_manual(
    instrument: InstrumentCore, _numbers: tuple[int, ...], asked: Quantity
) -> Quantity:
    """A manual point must lie within the band. [S] Rounded to the source's grid."""
    start, stop = band(instrument)
    new = round(asked.value / GRID_HZ) * GRID_HZ
    if not start <= new <= stop:
        raise ScpiError(-222, _OUT_OF_RANGE)
    return Quantity(new, "HZ")
