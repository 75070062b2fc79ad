"""What hangs between source and inputs: the device under test, as the analyser meets it.

Owns the protocol of a device under test and a linear one with a known answer.
A real one is `sim.response.SteppedServo`; anything with the same `dwell` will
do. Nothing here measures.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

__all__ = ["Dwell", "LinearPlant", "Plant", "PlantDwell"]


class Dwell(Protocol):
    """What one dwell at one frequency brought.

    `source_cycles` (cycles,): complex amplitude of each integrate cycle at
    the source, V peak. `output_cycles` (cycles, 4): Fourier coefficients of
    the output per cycle, harmonics 0 to 3, V. The two peaks are the largest
    magnitudes seen, V.
    """

    @property
    def source_cycles(self) -> NDArray[np.complex128]: ...  # noqa: D102

    @property
    def output_cycles(self) -> NDArray[np.complex128]: ...  # noqa: D102

    @property
    def output_peak_v(self) -> float: ...  # noqa: D102

    @property
    def source_peak_v(self) -> float: ...  # noqa: D102


class Plant(Protocol):
    """A device that carries its state on from dwell to dwell."""

    def dwell(
        self,
        frequency_hz: float,
        source_vpk: float,
        offset_v: float,
        settle_cycles: int,
        integrate_cycles: int,
    ) -> Dwell:
        """Drive for whole cycles; the first `settle_cycles` are not kept."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class PlantDwell:
    """A plain `Dwell`."""

    source_cycles: NDArray[np.complex128]
    output_cycles: NDArray[np.complex128]
    output_peak_v: float
    source_peak_v: float


@dataclass(frozen=True, slots=True)
class LinearPlant:
    """A linear device with a known answer, for tests and for checking a wire.

    Parameters
    ----------
    response
        Complex gain at a frequency in Hz.
    saturation_v
        Peak at which the output is reported to stop; it changes no cycle.
    """

    response: Callable[[float], complex]
    saturation_v: float = float("inf")

    def dwell(
        self,
        frequency_hz: float,
        source_vpk: float,
        offset_v: float,
        settle_cycles: int,
        integrate_cycles: int,
    ) -> PlantDwell:
        """Every cycle alike: gain times level, and the gain at 0 Hz times the offset."""
        gain, still = complex(self.response(frequency_hz)), complex(self.response(0.0))
        output = np.zeros((integrate_cycles, 4), dtype=complex)
        output[:, 0] = still.real * offset_v
        output[:, 1] = gain * source_vpk
        peak = abs(gain) * source_vpk + abs(still.real * offset_v)
        return PlantDwell(
            source_cycles=np.full(integrate_cycles, source_vpk, dtype=complex),
            output_cycles=output,
            output_peak_v=min(peak, self.saturation_v),
            source_peak_v=source_vpk + abs(offset_v),
        )
