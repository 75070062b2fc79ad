"""Frequency responses as pandas tables, for those who work with them in a notebook.

Owns the names of the columns. pandas is an extra and is loaded only here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from daq.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["COLUMNS", "frame_of"]

COLUMNS = (
    "frequency_hz",
    "source_vpk",
    "gain_db",
    "phase_deg",
    "gain_std_db",
    "phase_std_deg",
    "gain",
    "dc_v",
    "harmonic2",
    "harmonic3",
    "flags",
)
"""Columns of a table, each an attribute of the response."""

_FACTS = ("unit", "direction", "settle_cycles", "integrate_cycles", "from_rest", "provenance")


def frame_of(response: object) -> pd.DataFrame:
    """One row per row of a response; see `daq.frf.FrequencyResponse.to_frame`.

    Parameters
    ----------
    response
        Has the `COLUMNS` as arrays, and what holds for all rows as other attributes.
    """
    try:
        import pandas as pd
    except ImportError as error:
        raise InputError(
            "a table needs pandas; install the extra: pip install 'lashbench[frames]'"
        ) from error
    # Copies: a table may be written to, a response may not.
    frame = pd.DataFrame({name: getattr(response, name).copy() for name in COLUMNS})
    frame.attrs = {name: _plain(getattr(response, name)) for name in _FACTS}
    return frame


def _plain(value: Any) -> Any:
    # pandas copies what goes with a table, which a read-only view does not allow.
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value
