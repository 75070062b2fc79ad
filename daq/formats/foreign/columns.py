"""Arrays of a foreign file by what they hold, and how the file is refused for one of them.

Owns the look-up of a quantity among its units. It converts no quantity and never
guesses what an array holds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from daq.errors import FileFormatError
from daq.formats.believable import disbelief

__all__ = ["Columns"]


@dataclass(frozen=True, slots=True)
class Columns:
    """Arrays of a foreign file by what they hold.

    Parameters
    ----------
    path
        The file, for messages.
    held
        Array of shape (rows,) for each quantity; NaN where a cell is empty.
    place
        Where a row stands, for messages: ``"line 12"``.
    provenance
        What else is known of the file.
    unit
        Name of the unit under test.
    """

    path: Path
    held: Mapping[str, NDArray[Any]]
    place: Callable[[int], str]
    provenance: Mapping[str, Any] = field(default_factory=dict)
    unit: str = "unknown"

    def refuse(self, row: int | np.intp, fault: str) -> NoReturn:
        """Refuse the file for what a row of it holds."""
        raise FileFormatError(f"{self.path}, {self.place(int(row))}: {fault}")

    def believe(self, name: str, values: NDArray[np.float64]) -> None:
        """Refuse the file for a value that cannot be, see `daq.formats.believable`."""
        if (found := disbelief(name, values)) is not None:
            self.refuse(*found)

    def one_of(self, names: Mapping[str, float]) -> NDArray[np.float64] | None:
        """The one column among several units of a quantity, converted; None where there is none.

        Raises
        ------
        FileFormatError
            If there are several, or one holds complex numbers.
        """
        found = [name for name in names if name in self.held]
        if len(found) > 1:
            raise FileFormatError(
                f"{self.path}: {' and '.join(found)} say the same; give one of them"
            )
        return None if not found else names[found[0]] * self.real(found[0])

    def real(self, name: str) -> NDArray[np.float64]:
        """A column of real numbers; infinite ones are refused."""
        values = np.asarray(self.held[name])
        if values.dtype.kind == "c":
            raise FileFormatError(
                f"{self.path}: {name} is a column of complex numbers; give --column "
                "gain_complex=COLUMN for a complex response"
            )
        values = values.astype(float)
        for row in np.flatnonzero(np.isinf(values)):
            self.refuse(row, f"{name} {values[row]} is not a finite number")
        return values
