"""The diagnosis from the paper's numbers in lines of text.

Owns wording and columns only.
"""

from __future__ import annotations

import numpy as np

from analysis.ensemble.datasheet_belief import believed_lines
from analysis.paper_diagnosis.document import parameters, residual
from analysis.paper_diagnosis.pairs import CHAIN, DISSIPATION, LOADS, VISCOUS
from analysis.paper_diagnosis.posterior import Belief, Judged, index_of
from analysis.paper_diagnosis.result import PaperFindings
from analysis.selection.wording import hidden_words
from sim.catalogue import CATALOGUE

__all__ = ["summarise"]

_TITLES = {
    "ratio-free": "with the contribution ratio unknown",
    "ratio-as-measured": "with ratio and total backlash as the microscope saw them",
}


def summarise(diagnosis: PaperFindings) -> list[str]:
    """All lines: measurement, verdict and what it rests on for each state of knowledge."""
    values = diagnosis.reading.values
    lines = [
        f"{diagnosis.unit}, measured: ARF {values[0]:.0f} Hz {values[1]:.1f} dB, "
        f"RF {values[2]:.0f} Hz {values[3]:.1f} dB"
        + (f", half-power width {values[4]:.1f} Hz" if np.isfinite(values[4]) else "")
    ]
    lines += believed_lines(diagnosis.believed)
    for name, belief in diagnosis.beliefs.items():
        lines += ["", f"{_TITLES[name]}: {belief.word}. {_sentence(belief)}"]
        lines.append(f"  {hidden_words(belief.baseline.probability)}")
        lines += _wrong(belief) + _index(belief) + _damping(belief) + _sets(belief)
    lines += ["", "the plain model, swept otherwise (error index of a single run, Hz)"]
    for name, agreement in diagnosis.procedures.items():
        index = index_of(agreement)
        lines.append(f"  {name:<12}{index.expected:6.1f} +- {index.expected_std:.1f}")
    if diagnosis.next_measurement is not None:
        proposal = diagnosis.next_measurement
        lines += [
            "",
            f"to tell {proposal.separates[0]} from {proposal.separates[1]} "
            f"({proposal.expected_sigma:.1f} sigma expected):",
            f"  {proposal.command}",
        ]
    return lines + [f"warning: {text}" for text in diagnosis.warnings]


def _sentence(belief: Belief) -> str:
    name = _name(belief.best)
    if belief.word == "consistent":
        return "Nothing beyond scatter and tolerance is needed."
    if belief.word == "unexplained":
        return "No set of known causes gives such numbers."
    if belief.word == "explained":
        return f"{name} explains it."
    return f"{name} may explain it, but so may others."


def _wrong(belief: Belief) -> list[str]:
    lines = ["  measured less simulated        plain model    " + _name(belief.best)]
    pairs = zip(residual(belief.baseline.agreement), residual(belief.best.agreement), strict=True)
    for before, after in pairs:
        lines.append(
            f"    {before['quantity']:<22}{before['mean']:+8.1f} {before['unit']} "
            f"({before['sigma']:+.1f} sigma){after['mean']:+8.1f} {after['unit']} "
            f"({after['sigma']:+.1f} sigma)"
        )
    for effect, values in parameters(belief.best.agreement).items():
        sizes = ", ".join(
            f"{name} = {v['value']:.3g} +- {v['std']:.1g}"
            + ("" if v["unit"] == "1" else f" {v['unit']}")
            for name, v in values.items()
        )
        lines.append(f"  {effect}: {sizes}. {CATALOGUE[effect].meaning}")
    return lines


def _index(belief: Belief) -> list[str]:
    before, after = (index_of(one.agreement) for one in (belief.baseline, belief.best))
    over_all, over_all_std = belief.expected_index()
    return [
        f"  error index of a single run: {before.expected:.1f} +- {before.expected_std:.1f} Hz for "
        f"the plain model, {after.expected:.1f} +- {after.expected_std:.1f} Hz for the best set, "
        f"{over_all:.1f} +- {over_all_std:.1f} Hz over all sets by probability; two runs of the "
        f"best differ by {after.floor:.1f} Hz"
    ]


def _damping(belief: Belief) -> list[str]:
    alone = belief.damping_alone
    if alone is None:
        return []
    mean, std = alone.agreement.moments()
    index = index_of(alone.agreement)
    word = "cannot be ruled out" if belief.damping_is_enough else "is not enough"
    return [
        f"  missing damping alone {word} (probability {belief.probability_of_only(VISCOUS):.2f}): "
        f"{_name(alone)} at ratio {mean[0]:.2f} +- {std[0]:.2f}, "
        f"error index {index.expected:.1f} +- {index.expected_std:.1f} Hz, "
        f"{100.0 * alone.probability_of_worse:.2g} % of its own runs agree worse",
        f"  part of the answer, by probability: something takes energy out of the motion "
        f"{belief.probability_of_any(DISSIPATION):.2f}; the load is heavier or carries more than "
        f"the datasheet says {belief.probability_of_any(LOADS):.2f}; the measuring chain is off "
        f"{belief.probability_of_any(CHAIN):.2f}",
    ]


def _sets(belief: Belief) -> list[str]:
    lines = ["  sets by probability (and share of their own runs that agree worse, %):"]
    named = {id(one) for one in (belief.best, *belief.rivals)}
    for one in belief.judged:
        if id(one) in named:
            mark = "" if one.adequate else ", unlike its own runs"
            worse = 100.0 * one.probability_of_worse
            lines.append(f"    {one.probability:6.3f}  {_name(one)}  ({worse:.2g}{mark})")
    found = list(belief.inclusion().items())[:5]
    lines.append("  causes by probability: " + ", ".join(f"{e} {p:.2f}" for e, p in found))
    return lines


def _name(judged: Judged) -> str:
    return " + ".join(judged.effects) or "nothing hidden"
