"""What the paper printed: its tables and findings, read from the bundled file.

Owns the published numbers and nothing computed from them.
"""

from __future__ import annotations

import tomllib
from typing import Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from daq.configs import config_path
from daq.errors import ConfigurationError

__all__ = ["Finding", "PaperNumbers", "PublishedRow", "UnitName", "load_paper"]

UnitName = Literal["ADSS", "EDSS"]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class PublishedRow(_Section):
    """Features of one servo: a row of Table 2, frequencies in Hz, gains in dB."""

    unit: UnitName
    ratio_percent: int
    b1_deg: float
    b2_deg: float
    arf_db: float
    arf_hz: float
    rf_db: float | None = None
    rf_hz: float


class Finding(_Section):
    """Least error index (section 4), damping and reduction of frequencies (section 5)."""

    unit: UnitName
    error_index_hz: float
    error_index_ratio_percent: int
    zeta_arf: float
    zeta_rf: float
    reduction_arf_percent: float
    reduction_rf_percent: float


class PaperNumbers(BaseModel):
    """All published numbers that a reproduction is held against."""

    model_config = ConfigDict(extra="forbid", strict=False, frozen=True)

    schema_: Literal[1]
    simulated: tuple[PublishedRow, ...]
    measured: tuple[PublishedRow, ...]
    findings: tuple[Finding, ...]

    def rows(self, unit: UnitName) -> tuple[PublishedRow, ...]:
        """Simulated rows of one unit, in the order of Table 2."""
        return tuple(row for row in self.simulated if row.unit == unit)

    def row(self, unit: UnitName, ratio_percent: int) -> PublishedRow:
        """One simulated row; KeyError if Table 2 has none such."""
        for row in self.rows(unit):
            if row.ratio_percent == ratio_percent:
                return row
        raise KeyError((unit, ratio_percent))

    def measured_row(self, unit: UnitName) -> PublishedRow:
        """The measured features of one unit."""
        return next(row for row in self.measured if row.unit == unit)

    def finding(self, unit: UnitName) -> Finding:
        """What sections 4 and 5 conclude for one unit."""
        return next(finding for finding in self.findings if finding.unit == unit)


def load_paper() -> PaperNumbers:
    """Read the bundled numbers.

    Raises
    ------
    ConfigurationError
        If the installation lacks the file or it is damaged.
    """
    path = config_path("paper", "table2")
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
        document["schema_"] = document.pop("schema", None)
        return PaperNumbers.model_validate(document)
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, ValidationError) as error:
        raise ConfigurationError(
            f"{path}: the published numbers cannot be read ({error}); reinstall lashbench"
        ) from error
