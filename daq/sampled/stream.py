"""A converter that runs block by block: what goes out next, what came in, nothing forgotten.

Owns the sine, its ramps and the recording; a device asks `exchange` for each block of its clock.
It knows no device and starts no thread.
"""

from __future__ import annotations

import threading

import numpy as np
from numpy.typing import NDArray

__all__ = ["StreamConverter"]


class StreamConverter:
    """The `Converter` protocol for devices with a callback; used by two threads.

    Parameters
    ----------
    name
        Of the device, for its identity.
    rate_hz
        Frames per second.
    full_scale_v
        Volts that digital full scale gives at the output.
    inputs_v
        Volts that digital full scale stands for at inputs 1 and 2.
    """

    def __init__(
        self, name: str, rate_hz: float, full_scale_v: float, inputs_v: tuple[float, float]
    ) -> None:
        self.name = "".join(sign for sign in name if sign.isascii() and sign not in ",\"'")
        self.rate_hz, self.full_scale_v = rate_hz, full_scale_v
        self._inputs_v = np.asarray(inputs_v)
        self._lock = threading.Lock()
        self._level = self._offset = self._aim_level = self._aim_offset = self._slew = 0.0
        self._turns = 0.0
        self._hz = rate_hz / 48.0
        self._next: tuple[float, int] | None = None
        self._parts: list[NDArray[np.float64]] = []
        self._missing = 0
        self._lost = self._over = 0

    # ------------------------------------------------------------ for the device

    def exchange(self, came: NDArray[np.float64], lost: int = 0) -> NDArray[np.float64]:
        """Take one block of inputs, give as long a block of output, both in parts of full scale.

        Parameters
        ----------
        came
            Shape (n, 2).
        lost
            Frames that the device could not deliver or take before this block.
        """
        with self._lock:
            count = len(came)
            self._lost += lost if self._missing else 0
            out = np.empty(count)
            done = 0
            while done < count:
                size = count - done
                begins = self._frames_to_zero() if self._next is not None else None
                if begins is not None and begins == 0:
                    self._hz, self._missing = self._next  # type: ignore[misc]
                    self._next, self._turns = None, 0.0
                    self._parts, self._lost, self._over = [], lost, 0
                elif begins is not None:
                    size = min(size, begins)
                out[done : done + size] = self._made(size)
                self._keep(came[done : done + size])
                done += size
            return out / self.full_scale_v

    def _frames_to_zero(self) -> int:
        """Until the sine passes zero upwards; at once where there is none."""
        if self._level == 0.0:
            return 0
        left = (1.0 - self._turns % 1.0) % 1.0
        return int(round(left * self.rate_hz / self._hz))

    def _made(self, count: int) -> NDArray[np.float64]:
        steps = np.arange(1, count + 1)
        turns = self._turns + self._hz / self.rate_hz * np.arange(count)
        self._turns = float((self._turns + self._hz / self.rate_hz * count) % 1.0)
        most = np.inf if self._slew == 0 else self._slew / self.rate_hz
        level = _approach(self._level, self._aim_level, most, steps)
        offset = _approach(self._offset, self._aim_offset, most, steps)
        self._level, self._offset = float(level[-1]), float(offset[-1])
        return np.asarray(level * np.sin(2 * np.pi * turns) + offset)

    def _keep(self, came: NDArray[np.float64]) -> None:
        part = came[: self._missing]
        if len(part):
            self._over |= sum(1 << i for i in (0, 1) if np.abs(part[:, i]).max() >= 0.999)
            self._parts.append(part * self._inputs_v)
            self._missing -= len(part)

    # ------------------------------------------------------------ for the interpreter

    def aim(self, level_vpk: float, offset_v: float, slew_v_per_s: float) -> None:
        """Head for a level and an offset."""
        with self._lock:
            self._aim_level, self._aim_offset, self._slew = level_vpk, offset_v, slew_v_per_s

    def now(self) -> tuple[float, float]:
        """Level and offset of the frame that was made last."""
        with self._lock:
            return self._level, self._offset

    def step(self, frequency_hz: float, frames: int) -> None:
        """Begin this frequency at the next zero of the sine, and record from there."""
        with self._lock:
            self._next, self._parts, self._missing = (frequency_hz, frames), [], 0

    def recorded(self) -> int:
        """Frames that are in."""
        with self._lock:
            return 0 if self._next is not None else sum(map(len, self._parts))

    def frames(self, first: int, count: int) -> NDArray[np.float64]:
        """Recorded volts, shape (count, 2)."""
        with self._lock:
            if len(self._parts) > 1:
                self._parts = [np.concatenate(self._parts)]
            return self._parts[0][first : first + count]

    def trouble(self) -> tuple[int, int]:
        """Frames lost, and inputs that were overdriven."""
        with self._lock:
            return self._lost, self._over

    def halt(self) -> None:
        """Give up a recording."""
        with self._lock:
            self._next, self._missing, self._parts = None, 0, []


def _approach(now: float, aim: float, most: float, steps: NDArray[np.int_]) -> NDArray[np.float64]:
    """From here towards there, at most so much a frame."""
    if now == aim:
        return np.full(len(steps), aim)
    if not np.isfinite(most):
        return np.full(len(steps), aim)
    return now + np.sign(aim - now) * np.minimum(most * steps, abs(aim - now))
