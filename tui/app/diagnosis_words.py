"""A diagnosis for people: verdict, what to do next, causes with bars, departures as a grid.

Owns the wording and the order on the screen, from the document alone. It computes nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from textual.content import Content

from analysis.ensemble.datasheet_belief import believed_lines
from analysis.inference.exclusion import head_unseen, list_unseen
from analysis.observation.joint import sweep_lines
from analysis.selection.wording import verdict_words
from daq.untrusted.visible_text import visible_line
from tui.app.plot.palette import Palette
from tui.app.plot.tables import LEAST_TOLD, bar, datasheet_table, departure_grid
from tui.text.symbols import named_symbol, printed_unit

__all__ = ["diagnosis_lines", "next_sentence"]

_BAR = 12
"""Columns of a bar of probability."""


def diagnosis_lines(
    document: Mapping[str, Any], palette: Palette, width: int = 76, answer: Sequence[str] = ()
) -> list[Content]:
    """Every line about a diagnosis.

    Parameters
    ----------
    width
        Columns that the grid may take.
    answer
        Advice and backlash by the model that is accepted, put below the verdict.
    """
    lines = [
        _said(f"VERDICT: {document['verdict'].upper()}. {' '.join(verdict_words(document))}"),
        Content.styled(visible_line(f"NEXT: {next_sentence(document)}"), "bold"),
        *map(_said, answer),
        Content(""),
        *_causes(document, palette),
        Content(""),
        *_residuals(document),
        Content("Departures from the plain model, by level and band"),
        *departure_grid(document.get("residual") or (), palette, width),
    ]
    if document.get("shape"):
        lines.append(_said(f"left by the plain model: {document['shape']}"))
    lines += map(_said, sweep_lines(document.get("sweeps", ())))
    if known := datasheet_table(document.get("datasheet") or {}):
        lines += [Content(""), *map(_said, known)]
    lines += map(_said, believed_lines(document))
    lines += [_said(f"warning: {text}") for text in document.get("warnings", ())]
    if document.get("unseen"):
        lines += [Content(""), _said(head_unseen(document["verdict"]).capitalize())]
        lines += [_said(f" - {text}") for text in list_unseen(document["unseen"])]
    return lines


def next_sentence(document: Mapping[str, Any]) -> str:
    """What to do next, in one sentence."""
    proposed = document.get("next_measurement")
    if proposed:
        apart = " from ".join(proposed["separates"])
        sigma = _digits(proposed.get("expected_sigma"))
        return f"MEASURE THIS NEXT (key N): tells {apart}, {sigma} sigma expected."
    if document["causes"]:
        check = _catalogue(document["causes"][0]["effect"], "check")
        if check:
            return f"to make sure, {check}."
        return f"look at {document['causes'][0]['effect']} on the bench."
    if document["verdict"] == "consistent":
        return "nothing to mend; W in step 7 writes the report."
    return "look at the departures below, and measure again with more points where they are."


def _causes(document: Mapping[str, Any], palette: Palette) -> list[Content]:
    lines = [Content("Causes" if document["causes"] else "Causes: none named")]
    for cause in document["causes"]:
        lines.append(_barred(cause["probability"], cause["effect"], palette.colour(0)))
        lines += [_said(f"    {text}") for text in _sizes(cause["parameters"])]
        meaning = _catalogue(cause["effect"], "meaning").rstrip(".")
        if meaning:
            on_bench = _catalogue(cause["effect"], "bench_cause").rstrip(".")
            lines.append(_said(f"    {meaning}; on the bench: {on_bench}."))
            lines.append(_said(f"    To make sure: {_catalogue(cause['effect'], 'check')}."))
    told = [one for one in document.get("rivals") or () if one["probability"] >= LEAST_TOLD]
    if told:
        lines.append(Content("Rivals" if document["causes"] else "Sets judged"))
    for rival in told:
        names = " + ".join(rival["causes"]) or "no cause"
        remark = f" ({rival['remark']})" if rival.get("remark") else ""
        lines.append(_barred(rival["probability"], f"{names}{remark}", palette.grid))
    return lines


def _barred(probability: float, text: str, colour: str) -> Content:
    return Content.assemble(
        " ", (bar(probability, _BAR), colour), f" {probability:.2f}  {visible_line(text)}"
    )


def _sizes(parameters: Mapping[str, Any]) -> list[str]:
    """Each size with as many digits as its error allows, beside the datasheet."""
    lines = []
    for name, number in parameters.items():
        value, std = number.get("value"), number.get("std")
        unit = printed_unit(number.get("unit") or "")
        text = f"{named_symbol(name)} = {_with_error(value, std)}{unit}"
        known = number.get("datasheet")
        if known:
            text += f" (datasheet {known:.4g}{unit}"
            text += f": {100.0 * (value / known - 1.0):+.0f} %)" if value is not None else ")"
        lines.append(text)
    return lines


def _residuals(document: Mapping[str, Any]) -> list[Content]:
    before, after = document["baseline"], document["extended"]
    lines = [_said(f"residual before  {_residual(before)}")]
    gain = (document.get("gain") or {}).get("held_out_rms_ratio")
    if document["causes"]:
        left = "" if gain is None else f"; {100.0 * gain:.0f} % is left"
        lines.append(_said(f"residual after   {_residual(after)}{left}"))
    return lines


def _residual(part: Mapping[str, Any]) -> str:
    sigma, decibel = part.get("held_out_rms_sigma"), part.get("held_out_rms_db")
    return f"{_digits(sigma)} standard errors, {_digits(decibel)} dB (held-out levels)"


def _catalogue(effect: str, name: str) -> str:
    from sim.catalogue import CATALOGUE

    known = CATALOGUE.get(effect)
    return "" if known is None else str(getattr(known, name))


def _said(text: str) -> Content:
    return Content(visible_line(text))


def _with_error(value: float | None, std: float | None) -> str:
    """A value to two digits of its error."""
    if value is None:
        return "-"
    if not std or not math.isfinite(std):
        return f"{value:.3g}"
    digits = max(0, 1 - math.floor(math.log10(std)))
    if digits > 6 or abs(value) >= 1e6:
        return f"{value:.3g} +- {std:.2g}"
    return f"{value:.{digits}f} +- {std:.{digits}f}"


def _digits(value: float | None) -> str:
    return "-" if value is None else f"{value:.2g}"
