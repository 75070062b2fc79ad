"""Options of ``lashbench report`` that make it a certificate.

Owns their names and help, and what a bench file adds. How they look is `analysis.report`'s.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from daq.errors import ConfigurationError, InputError

if TYPE_CHECKING:
    from analysis.report.certificate import Certificate
    from daq.limits import Bench

__all__ = ["NO_CERTIFICATE", "CertificateOptions"]

_MOST = 200


@Parameter(name="*", group=Group("Certificate"), negative=())
@dataclass(frozen=True, slots=True, kw_only=True)
class CertificateOptions:
    """The options; each is empty where it was not given."""

    number: Annotated[str, Parameter(help="Number of the report; from date and data, if not.")] = ""
    bench: Annotated[
        str | None,
        Parameter(help="Bench file with calibration, organisation and logo."),
    ] = None
    environment: Annotated[
        list[str] | None,
        Parameter(help="NAME=VALUE of a condition, as temperature='22.5 degC'; repeat it."),
    ] = None
    approver: Annotated[str, Parameter(help="Who approves the report.")] = ""

    def certificate(self, configurations: Mapping[str, Any]) -> Certificate:
        """What the options and the bench say.

        Parameters
        ----------
        configurations
            Of the measurement: its bench file counts where no other is named.

        Raises
        ------
        InputError
            If an option has no such form, or the bench file or its logo is wrong.
        """
        from analysis.report.certificate import Certificate
        from analysis.report.logo import logo_address
        from daq.configs import config_path
        from daq.limits import load_bench

        for name, text in (("--number", self.number), ("--approver", self.approver)):
            if not text.isprintable() or len(text) > _MOST:
                raise InputError(f"{name} {text[:40]!r} is not one line of up to {_MOST} letters")
        place = _bench_of(configurations) if self.bench is None else load_bench(self.bench)
        logo = ""
        if self.bench is not None and place is not None and place.report.logo is not None:
            # Beside the file that names it.
            logo = logo_address(config_path("benches", self.bench).parent / place.report.logo)
        instrument = None if place is None else place.instrument
        return Certificate(
            number=self.number,
            organisation="" if place is None else place.report.organisation or "",
            calibrated=None if instrument is None else instrument.calibrated,
            calibration_due=None if instrument is None else instrument.calibration_due,
            calibration_certificate="" if instrument is None else instrument.certificate or "",
            environment=_conditions(self.environment or ()),
            approver=self.approver,
            logo=logo,
        )


NO_CERTIFICATE = CertificateOptions()
"""None of them was given."""


def _conditions(settings: list[str] | tuple[()]) -> dict[str, str]:
    found: dict[str, str] = {}
    for setting in settings:
        name, equals, value = (part.strip() for part in setting.partition("="))
        if not (name and equals and value and setting.isprintable() and len(setting) <= _MOST):
            raise InputError(
                f"--environment {setting[:40]!r} is not NAME=VALUE; give for instance "
                "temperature='22.5 degC'"
            )
        if name in found:
            raise InputError(f"--environment {name} is given twice; give it once")
        found[name] = value
    return found


def _bench_of(configurations: Mapping[str, Any]) -> Bench | None:
    """The bench file that a measurement was made with; None where that cannot be read."""
    from pydantic import ValidationError

    from daq.limits import Bench
    from daq.untrusted.bounded_text import parse_toml

    try:
        return Bench.model_validate(parse_toml(str(configurations.get("bench") or "")))
    except (ValidationError, ValueError, ConfigurationError):
        return None


def is_pdf(path: Path) -> bool:
    """Whether a report is to be printed as PDF."""
    return path.suffix.lower() == ".pdf"
