"""What a converter can do, and the language in which it is asked: the same on every wire.

Owns the `Converter` protocol and the reading of messages to one. The language is a little SCPI, so
that the rules of every other instrument hold: one question at a time, an error queue, an event
register that tells of a power failure. It knows no device.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["CHANNELS", "MOST_FRAMES", "Converter", "Interpreter"]

CHANNELS = 2
MOST_FRAMES = 4_000_000
"""Frames of one recording: 83 s at 48 kHz."""
MOST_AT_ONCE = 32_768
"""Frames of one answer: half a megabyte."""
_QUEUE = 5
_POWER_ON, _EXECUTION, _COMMAND = 128, 16, 32


class Converter(Protocol):
    """One output and two inputs with a common clock.

    The output is ``level sin(2 pi f t) + offset``; level and offset move at the slew rate, or at
    once where it is 0. Frames are pairs of volts.
    """

    name: str
    rate_hz: float
    full_scale_v: float

    def aim(self, level_vpk: float, offset_v: float, slew_v_per_s: float) -> None:
        """Head for a level and an offset."""
        ...

    def now(self) -> tuple[float, float]:
        """Level and offset at the output now."""
        ...

    def step(self, frequency_hz: float, frames: int) -> None:
        """Begin this frequency at a zero of the sine, and record so many frames from there."""
        ...

    def recorded(self) -> int:
        """Frames of the recording that are in."""
        ...

    def frames(self, first: int, count: int) -> NDArray[np.float64]:
        """Recorded volts, shape (count, 2)."""
        ...

    def trouble(self) -> tuple[int, int]:
        """Frames lost, and inputs that were overdriven (bits 0 and 1), in the recording."""
        ...

    def halt(self) -> None:
        """Give up a recording; the output goes on."""
        ...


class Interpreter:
    """Executes messages on a converter; `run` gives the reply, None where there is none."""

    def __init__(self, converter: Converter, serial: str = "0") -> None:
        self._converter = converter
        self._serial = serial
        self.begin()

    def begin(self) -> None:
        """As after power came."""
        self._level = self._offset = self._slew = 0.0
        self._errors: deque[str] = deque()
        self._events = _POWER_ON
        self._mark = 0
        self._steps, self._stepped = 0, (0.0, 0)

    def run(self, message: bytes) -> bytes | None:
        """Execute one message of one command."""
        header, _, rest = message.decode("latin-1").strip().partition(" ")
        arguments = [part.strip() for part in rest.split(",")] if rest.strip() else []
        try:
            reply = self._run(header.upper(), arguments)
        except LookupError:
            self._refuse(_COMMAND, '-113,"Undefined header"')
            return None
        except ValueError as error:
            self._refuse(_EXECUTION, f'-222,"Data out of range; {error}"')
            return None
        return None if reply is None else reply + b"\n"

    def _refuse(self, event: int, entry: str) -> None:
        self._events |= event
        if len(self._errors) < _QUEUE:
            self._errors.append(entry)

    def _run(self, header: str, arguments: list[str]) -> bytes | None:
        converter = self._converter
        match header:
            case "*IDN?":
                return f"LASHBENCH,SAMPLED,{converter.name},{self._serial}".encode(
                    "ascii", "replace"
                )
            case "*OPT?":
                return b'""'
            case "*CLS":
                self._errors.clear()
                self._events = 0
            case "*RST":
                converter.halt()
                self._slew = self._level = self._offset = 0.0
                converter.aim(0.0, 0.0, 0.0)
            case "*ESR?":
                events, self._events = self._events, 0
                return b"%+d" % events
            case "SYST:ERR?":
                return (self._errors.popleft() if self._errors else '+0,"No error"').encode()
            case "STAT:USER:ENAB":
                self._mark = int(_number(arguments, 0, 32767))
            case "STAT:USER:ENAB?":
                return b"%+d" % self._mark
            case "CONF?":
                return f"{converter.rate_hz:.12E},{converter.full_scale_v:.12E}".encode()
            case "SOUR:SLEW":
                self._slew = _number(arguments, 0.0, 1e6)
            case "SOUR:VOLT":
                self._aim(_number(arguments, 0.0, converter.full_scale_v), self._offset)
            case "SOUR:OFFS":
                bound = converter.full_scale_v
                self._aim(self._level, _number(arguments, -bound, bound))
            case "SOUR:SLEW?" | "SOUR:VOLT?" | "SOUR:OFFS?":
                values = {"SLEW": self._slew, "VOLT": self._level, "OFFS": self._offset}
                return f"{values[header[5:9]]:+.12E}".encode()
            case "SOUR:NOW?":
                return ",".join(f"{value:+.12E}" for value in converter.now()).encode()
            case "ACQ:STEP":
                frames = int(_number(arguments[1:], 1, MOST_FRAMES))
                frequency = _number(arguments[:1], 1e-3, converter.rate_hz / 2)
                converter.step(frequency, frames)
                self._steps += 1
                self._stepped = frequency, frames
            case "ACQ:STEP?":
                frequency, frames = self._stepped
                return f"{self._steps:+d},{frequency:+.12E},{frames:+d}".encode()
            case "ACQ:HALT":
                converter.halt()
            case "ACQ?":
                return b"%+d" % converter.recorded()
            case "ACQ:TROU?":
                return b"%+d,%+d" % converter.trouble()
            case "ACQ:DATA?":
                first = int(_number(arguments[:1], 0, MOST_FRAMES))
                count = int(_number(arguments[1:], 1, MOST_AT_ONCE))
                if first + count > converter.recorded():
                    raise ValueError("not recorded yet")
                data = converter.frames(first, count).astype(">f8").tobytes()
                length = b"%d" % len(data)
                return b"#%d%s" % (len(length), length) + data
            case _:
                raise LookupError(header)
        return None

    def _aim(self, level_vpk: float, offset_v: float) -> None:
        if level_vpk + abs(offset_v) > self._converter.full_scale_v * (1 + 1e-9):
            raise ValueError("level and offset together exceed the full scale")
        self._level, self._offset = level_vpk, offset_v
        self._converter.aim(level_vpk, offset_v, self._slew)


def _number(arguments: list[str], low: float, high: float) -> float:
    if len(arguments) != 1:
        raise ValueError("one number was due")
    value = float(arguments[0])
    if not math.isfinite(value) or not low <= value <= high:
        raise ValueError(f"{value:g} is not within {low:g} to {high:g}")
    return value
