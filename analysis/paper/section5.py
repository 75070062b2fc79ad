"""Section 5 of the paper recomputed: damping, the frequency it takes away, and what is left.

Owns the comparison. Equations (22) to (24) are in `analysis.resonance.half_power`. The
half-power points behind the printed damping ratio of ARF are not in print, so
that one number is taken as given and everything after it is computed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from analysis.paper.published import Finding, PaperNumbers, UnitName
from analysis.resonance.half_power import frequency_reduction, resonance_damping

__all__ = ["Section5", "section_5"]


@dataclass(frozen=True, slots=True)
class Section5:
    """Damping of one unit; frequencies in Hz, reductions in percent.

    Parameters
    ----------
    unit
        The unit.
    printed
        The paper's numbers.
    half_power_width_hz
        Distance of the half-power points that the printed zeta_AR stands for, (22).
    zeta_rf
        Damping ratio at RF from the printed zeta_AR and measured features, (23).
    reduction_arf_percent, reduction_rf_percent
        Frequency that the printed damping ratios take away, (24).
    misfit_arf_hz, misfit_rf_hz
        Simulated (printed, at the least error index) less measured feature.
    left_arf_hz, left_rf_hz
        The same after the simulated feature is lowered by its reduction.
    """

    unit: UnitName
    printed: Finding
    half_power_width_hz: float
    zeta_rf: float
    reduction_arf_percent: float
    reduction_rf_percent: float
    misfit_arf_hz: float
    misfit_rf_hz: float
    left_arf_hz: float
    left_rf_hz: float

    def to_json(self) -> dict[str, Any]:
        """Printed beside computed; the computed zeta_AR is null as its data are not in print."""
        return {
            "arf": {
                "zeta": {"published": self.printed.zeta_arf, "value": None},
                "half_power_width_hz": self.half_power_width_hz,
                "reduction_percent": {
                    "published": self.printed.reduction_arf_percent,
                    "value": self.reduction_arf_percent,
                },
                "misfit_hz": self.misfit_arf_hz,
                "misfit_left_hz": self.left_arf_hz,
            },
            "rf": {
                "zeta": {"published": self.printed.zeta_rf, "value": self.zeta_rf},
                "reduction_percent": {
                    "published": self.printed.reduction_rf_percent,
                    "value": self.reduction_rf_percent,
                },
                "misfit_hz": self.misfit_rf_hz,
                "misfit_left_hz": self.left_rf_hz,
            },
        }


def section_5(paper: PaperNumbers, unit: UnitName) -> Section5:
    """Recompute section 5 for one unit from the printed features and damping."""
    printed, measured = paper.finding(unit), paper.measured_row(unit)
    best = paper.row(unit, printed.error_index_ratio_percent)
    reduction_arf = frequency_reduction(printed.zeta_arf)
    reduction_rf = frequency_reduction(printed.zeta_rf)
    return Section5(
        unit=unit,
        printed=printed,
        half_power_width_hz=2.0 * printed.zeta_arf * measured.arf_hz,
        zeta_rf=resonance_damping(printed.zeta_arf, measured.arf_hz, measured.rf_hz),
        reduction_arf_percent=100.0 * reduction_arf,
        reduction_rf_percent=100.0 * reduction_rf,
        misfit_arf_hz=best.arf_hz - measured.arf_hz,
        misfit_rf_hz=best.rf_hz - measured.rf_hz,
        left_arf_hz=best.arf_hz * (1.0 - reduction_arf) - measured.arf_hz,
        left_rf_hz=best.rf_hz * (1.0 - reduction_rf) - measured.rf_hz,
    )
