"""The frequency response: the one record that all floors pass to each other.

Measured and simulated responses are the same type and differ in provenance
only. A response is a flat table, one row per (source level, frequency); it
carries its own error bars and never interpolates, smooths or drops a row.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntFlag
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from daq.errors import InputError
from daq.plan import Direction

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "DB_PER_NEPER",
    "GAIN_STD_COMPONENTS",
    "GAIN_STD_IS",
    "FrequencyResponse",
    "PointFlag",
    "error_words",
]

DB_PER_NEPER = 20.0 / np.log(10.0)
"""20 log10(e): a relative change of 1 in magnitude, in dB."""

GAIN_STD_COMPONENTS = "gain_std_components"
"""Provenance key: over how many components `gain_std_db` counts the scatter.

Responses made here count it along the gain (1) and say so; files made elsewhere may count
both components of the reading (2). `GAIN_STD_IS` says the same in words, and comes first.
"""

GAIN_STD_IS = "gain_std_is"
"""Provenance key: what `gain_std_db` is, in words (see `error_words`)."""


def error_words(integrate_cycles: int, components: int = 1) -> str:
    """The words by which a file says that `gain_std_db` is cycle-to-cycle scatter.

    Parameters
    ----------
    integrate_cycles
        Cycles of the mean of which it is the standard error.
    components
        1: scatter along the gain; 2: of both components of the reading together.
    """
    along = "along the gain" if components == 1 else "of both components"
    return (
        f"cycle-to-cycle scatter {along}, standard error of the mean over {integrate_cycles} cycles"
    )


class PointFlag(IntFlag):
    """What is known to be odd about a point; 0 is a clean one."""

    OVERLOAD = 1
    """An input was overdriven while the point was taken."""
    HALF_RANGE_MISSED = 2
    """The input never reached half of its range: the reading is coarse."""
    NOT_PERIODIC = 4
    """The motion did not repeat from drive cycle to drive cycle."""
    RETAKEN = 8
    """The point was measured again after an interruption."""
    SPOILT = 16
    """The value must not be used; the session's events say why."""


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyResponse:
    """Response V_o/V_i of a servo, swept by sine at one or more source levels.

    All arrays have shape (rows,), one row per (level, frequency) in the order
    of the file or of the sweep.

    Parameters
    ----------
    frequency_hz
        Drive frequency, Hz.
    source_vpk
        Source level, V peak.
    gain
        Complex V_o/V_i. Where the phase is unknown the value is the real
        magnitude and `phase_known` is False.
    phase_known
        Whether the row has a phase.
    gain_std_db, phase_std_deg
        One standard error of the reading along the magnitude (dB) and across
        it (degrees); NaN where unknown.
    dc_v
        Mean of V_o over the integration, V; NaN where unknown.
    harmonic2, harmonic3
        Complex component of V_o at 2 and 3 times the drive frequency over the
        source level; NaN where unknown.
    flags
        `PointFlag` bits.
    unit
        Name of the unit under test.
    direction, settle_cycles, integrate_cycles, from_rest
        The procedure, None where unknown.
    provenance
        Where the data came from: at least ``kind`` ("measured" or "simulated").
    """

    frequency_hz: NDArray[np.float64]
    source_vpk: NDArray[np.float64]
    gain: NDArray[np.complex128]
    phase_known: NDArray[np.bool_]
    gain_std_db: NDArray[np.float64]
    phase_std_deg: NDArray[np.float64]
    dc_v: NDArray[np.float64]
    harmonic2: NDArray[np.complex128]
    harmonic3: NDArray[np.complex128]
    flags: NDArray[np.int64]
    unit: str
    direction: Direction | None = None
    settle_cycles: int | None = None
    integrate_cycles: int | None = None
    from_rest: bool | None = None
    provenance: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        rows = np.shape(self.frequency_hz)
        if len(rows) != 1:
            raise InputError("frequency response: the frequencies must be a flat list")
        for name in _ARRAYS:
            if np.shape(getattr(self, name)) != rows:
                raise InputError(
                    f"frequency response: {name} has shape {np.shape(getattr(self, name))}, "
                    f"the frequencies {rows}; give one value per row"
                )

    @classmethod
    def from_arrays(
        cls,
        frequency_hz: Any,
        source_vpk: Any,
        gain: Any,
        *,
        unit: str,
        phase_known: Any = None,
        gain_std_db: Any = None,
        phase_std_deg: Any = None,
        dc_v: Any = None,
        harmonic2: Any = None,
        harmonic3: Any = None,
        flags: Any = None,
        direction: Direction | None = None,
        settle_cycles: int | None = None,
        integrate_cycles: int | None = None,
        from_rest: bool | None = None,
        provenance: Mapping[str, Any] | None = None,
    ) -> FrequencyResponse:
        """Build a response; whatever is left out is recorded as unknown."""
        frequency = np.array(frequency_hz, dtype=float)
        rows = frequency.shape

        def filled(values: Any, default: Any, dtype: Any) -> Any:
            if values is None:
                return np.full(rows, default, dtype=dtype)
            return np.array(np.broadcast_to(np.asarray(values, dtype=dtype), rows))

        return cls(
            frequency_hz=frequency,
            source_vpk=filled(source_vpk, np.nan, float),
            gain=filled(gain, np.nan, complex),
            phase_known=filled(phase_known, True, bool),
            gain_std_db=filled(gain_std_db, np.nan, float),
            phase_std_deg=filled(phase_std_deg, np.nan, float),
            dc_v=filled(dc_v, np.nan, float),
            harmonic2=filled(harmonic2, np.nan, complex),
            harmonic3=filled(harmonic3, np.nan, complex),
            flags=filled(flags, 0, np.int64),
            unit=unit,
            direction=direction,
            settle_cycles=settle_cycles,
            integrate_cycles=integrate_cycles,
            from_rest=from_rest,
            provenance=MappingProxyType(dict(provenance or {})),
        )

    def __len__(self) -> int:
        return len(self.frequency_hz)

    @property
    def gain_db(self) -> NDArray[np.float64]:
        """20 log10 |V_o/V_i|, shape (rows,), dB."""
        with np.errstate(divide="ignore"):
            return 20.0 * np.log10(np.abs(self.gain))

    @property
    def phase_deg(self) -> NDArray[np.float64]:
        """Phase of V_o/V_i in (-180, 180] degrees, shape (rows,); NaN where unknown."""
        return np.where(self.phase_known, np.degrees(np.angle(self.gain)), np.nan)

    @property
    def levels_vpk(self) -> NDArray[np.float64]:
        """The distinct source levels, ascending, V peak."""
        return np.unique(self.source_vpk)

    @property
    def dc_offset_v(self) -> float:
        """Constant voltage that was added to the source, V; 0 where nothing says so.

        Raises
        ------
        InputError
            If the provenance states one that is no voltage.
        """
        stated = self.provenance.get("dc_offset_v", 0.0)
        number = isinstance(stated, int | float) and not isinstance(stated, bool)
        if not (number and np.isfinite(stated)):
            raise InputError(
                f"frequency response: dc_offset_v {stated!r} is no voltage; give it in V, or none"
            )
        return float(stated)

    def take(self, rows: Any) -> FrequencyResponse:
        """The response at some rows only (an index or boolean array over rows)."""
        picked = {name: getattr(self, name)[rows] for name in _ARRAYS}
        rest = {
            name: getattr(self, name)
            for name in self.__dataclass_fields__
            if name not in picked and name != "frequency_hz"
        }
        return FrequencyResponse(frequency_hz=self.frequency_hz[rows], **picked, **rest)

    def at_level(self, source_vpk: float) -> FrequencyResponse:
        """Rows of one source level, in ascending frequency.

        Raises
        ------
        InputError
            If no row has that level.
        """
        rows = np.flatnonzero(np.isclose(self.source_vpk, source_vpk, rtol=1e-9, atol=0.0))
        if rows.size == 0:
            raise InputError(
                f"source level {source_vpk} V is not in the data; it holds {self.levels_vpk} V"
            )
        return self.take(rows[np.argsort(self.frequency_hz[rows], kind="stable")])

    def to_frame(self) -> pd.DataFrame:
        """The response as a pandas table, for a notebook.

        Returns
        -------
        pandas.DataFrame
            One row per row, in the same order; the columns are `frequency_hz`
            (Hz), `source_vpk` (V peak), `gain_db` (dB), `phase_deg` (degrees),
            `gain_std_db` (dB), `phase_std_deg` (degrees), `gain` (complex),
            `dc_v` (V), `harmonic2`, `harmonic3` (complex) and `flags`. Unit,
            procedure and provenance are in its `attrs`. For xarray:
            ``frame.set_index(["source_vpk", "frequency_hz"]).to_xarray()``.

        Raises
        ------
        InputError
            If pandas is not installed; it comes with the extra ``frames``.
        """
        from daq.frames import frame_of

        return frame_of(self)


_ARRAYS = (
    "source_vpk",
    "gain",
    "phase_known",
    "gain_std_db",
    "phase_std_deg",
    "dc_v",
    "harmonic2",
    "harmonic3",
    "flags",
)
