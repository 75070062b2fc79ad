"""The reproduction in lines of text: tables first, then what does not agree.

Owns wording and columns. It computes nothing and prints nothing.
"""

from __future__ import annotations

import math

from analysis.paper.index_curves import IndexCurve
from analysis.paper.published import PublishedRow
from analysis.paper.result import ReproductionNumbers
from analysis.paper.table2 import Compared, ReproducedRow

__all__ = ["summarise"]

_HEAD = (
    "unit   ratio       printed      paper's scheme      runs    below     exact engine       shift"
    "       printed    scheme"
)
_UNITS = (
    "           %            Hz          Hz (1 std)        Hz        %       Hz (1 std)  Hz (1 std)"
    "           dB        dB"
)


def summarise(result: ReproductionNumbers) -> list[str]:
    """All lines: Table 2, error index, section 5, findings."""
    lines = [
        f"Table 2 by the paper's scheme (RK4, fixed 10 us, {result.paper_runs} runs a row) "
        f"and by the exact engine ({result.exact_runs} runs)",
        "",
    ]
    for title, name in (("ARF", "arf"), ("RF", "rf")):
        lines += [title, _HEAD, _UNITS]
        for row in result.rows:
            mark = "  plateau" if name == "rf" and row.plateau else ""
            lines.append(_line(row.published, getattr(row, name)) + mark)
        lines.append("")
    lines += _error_index(result) + [""] + _section_5(result) + ["", "What does not agree"]
    return lines + (_disagreements(result) or ["  nothing, within 99 % of single runs"])


def _line(row: PublishedRow, feature: Compared) -> str:
    printed_db = "-" if math.isnan(feature.published_db) else f"{feature.published_db:.1f}"
    runs = f"{feature.low_hz:.0f}-{feature.high_hz:.0f}"
    return (
        f"{row.unit:<6}{row.ratio_percent:>6}{feature.published_hz:>14.0f}"
        f"{feature.value_hz:>14.1f} ({feature.std_hz:.1f}){runs:>12}{feature.percentile:>7.0f}"
        f"{feature.exact_hz:>11.1f} ({feature.exact_std_hz:.1f}){feature.shift_hz:>+8.1f}"
        f" ({feature.shift_std_hz:.1f})"
        f"{printed_db:>13}{feature.value_db:>10.1f}"
    )


def _error_index(result: ReproductionNumbers) -> list[str]:
    lines = ["Error index (21), Hz (1 std), against the measured features"]
    for curve in result.index:
        ratios = "".join(f"{ratio:>12}" for ratio in curve.ratio_percent)
        lines.append(f"{curve.unit}, ratio %".ljust(24) + ratios + "       least")
        for title, name in (
            ("  printed features", "published"),
            ("  paper's scheme", "value"),
            ("  exact engine", "exact"),
        ):
            lines.append(_index_line(title, curve, name))
    return lines


def _index_line(title: str, curve: IndexCurve, name: str) -> str:
    index = getattr(curve, name)
    cells = "".join(
        f"{hz:>12.1f}" if name == "published" else f"{f'{hz:.1f} ({std:.1f})':>12}"
        for hz, std in zip(index.hz, index.std_hz, strict=True)
    )
    ratio, height = curve.minimum(index)
    return title.ljust(24) + cells + f"   {height:.1f} Hz at {ratio} %"


def _section_5(result: ReproductionNumbers) -> list[str]:
    lines = ["Section 5, printed / computed"]
    for part in result.section_5:
        printed = part.printed
        lines += [
            f"{part.unit}  zeta_AR {printed.zeta_arf:.3f} / - "
            f"(half-power width {part.half_power_width_hz:.1f} Hz)   "
            f"zeta_R {printed.zeta_rf:.3f} / {part.zeta_rf:.3f} (23)   "
            f"reduction of ARF {printed.reduction_arf_percent:.2f} / "
            f"{part.reduction_arf_percent:.2f} %, of RF {printed.reduction_rf_percent:.2f} / "
            f"{part.reduction_rf_percent:.2f} % (24)",
            f"      misfit of ARF {part.misfit_arf_hz:+.1f} Hz, {part.left_arf_hz:+.1f} Hz once "
            f"damped; of RF {part.misfit_rf_hz:+.1f} Hz, {part.left_rf_hz:+.1f} Hz once damped",
        ]
    return lines


def _disagreements(result: ReproductionNumbers) -> list[str]:
    lines = [line for row in result.rows for line in _row_disagreements(row)]
    for part in result.section_5:
        # Printed to three digits from features known to a hertz: 1.5 % is what rounding allows.
        if abs(part.zeta_rf / part.printed.zeta_rf - 1.0) > 0.015:
            lines.append(
                f"  {part.unit} zeta_R: equation (23) with the printed zeta_AR and features gives "
                f"{part.zeta_rf:.3f}, printed is {part.printed.zeta_rf:.3f}"
            )
    return lines


def _row_disagreements(row: ReproducedRow) -> list[str]:
    lines = []
    where = f"  {row.published.unit} {row.published.ratio_percent} %"
    for title, feature in (("ARF", row.arf), ("RF", row.rf)):
        if feature.differs_hz:
            lines.append(
                f"{where} {title}: printed {feature.published_hz:.0f} Hz, the paper's scheme gives "
                f"{feature.value_hz:.1f} Hz and single runs scatter by {feature.std_hz:.1f} Hz"
            )
        if feature.differs_db:
            lines.append(
                f"{where} {title} gain: printed {feature.published_db:.1f} dB, the paper's scheme "
                f"gives {feature.value_db:.1f} dB and single runs scatter by "
                f"{feature.std_db:.1f} dB"
            )
    if row.plateau:
        lines.append(
            f"{where} RF: a plateau, single runs put it anywhere from {row.rf.low_hz:.0f} to "
            f"{row.rf.high_hz:.0f} Hz"
        )
    return lines
