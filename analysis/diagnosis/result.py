"""What a diagnosis says: as one document for programs, and in words for a person.

Owns the wording and the names in the document. Nothing is computed here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from analysis.diagnosis.experiment_design import CLEAR_SIGMA, NextMeasurement
from analysis.diagnosis.harmonics import Harmonic, describe_harmonics
from analysis.diagnosis.prediction import prediction_document
from analysis.diagnosis.remaining_models import Model, backlash_document, backlash_lines
from analysis.diagnosis.residuals import Residual
from analysis.diagnosis.stages import Stage
from analysis.ensemble.datasheet_belief import believed_lines
from analysis.estimate.datasheet_posterior import DatasheetValue, datasheet_lines
from analysis.inference.exclusion import ExclusionLimit, head_unseen, list_unseen
from analysis.observation.joint import sweep_document, sweep_lines
from analysis.observation.observation import Observation
from analysis.selection.verdict import Judged, Verdict, is_within_tolerance
from analysis.selection.wording import how_sure
from sim.catalogue import CATALOGUE

__all__ = ["Cause", "Diagnosis", "Size"]


@dataclass(frozen=True, slots=True)
class Size:
    """The fitted value of one parameter of an effect, with one standard deviation.

    `datasheet`: what the unit has without the effect, None where its datasheet does not know.
    """

    name: str
    value: float
    std: float
    unit_symbol: str
    datasheet: float | None


@dataclass(frozen=True, slots=True)
class Cause:
    """One effect of the named set, with the probability of that set and of what says the same."""

    effect: str
    sizes: tuple[Size, ...]
    probability: float


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """What is wrong, why, how sure that is, and what it gains.

    `ratio_baseline`, `ratio_extended`: contribution ratio and its standard deviation under the
    plain and the extended model. `departures`: of the measurement from the plain model; `left`:
    from the set that stands first, named or refused. `shape`, `left_shape`: both in words.
    `harmonics`: where nothing explains it, those measured beside those of the set that stands
    first. `unseen`: how large each cause may be all the same where nothing is missing, or each
    other one beside what is named. `models`: every model that may be true with its backlash, the
    accepted or likeliest first. `believed`: what was believed of the datasheet
    (`analysis.ensemble.datasheet_belief`); `datasheet`: what the accepted model says of each value.
    `lent_by`: the unit whose posterior was used, where this
    one has none. `stages`: what each stage cost and led to. `simulated_s`: seconds of motion that
    were simulated for it.
    """

    unit: str
    verdict: Verdict
    causes: tuple[Cause, ...]
    ratio_baseline: tuple[float, float]
    ratio_extended: tuple[float, float]
    departures: tuple[Residual, ...]
    left: tuple[Residual, ...]
    shape: str
    left_shape: str
    next_measurement: NextMeasurement | None
    observation: Observation
    harmonics: tuple[Harmonic, ...] = ()
    unseen: tuple[ExclusionLimit, ...] = ()
    models: tuple[Model, ...] = ()
    believed: Mapping[str, Any] = field(default_factory=dict)
    datasheet: tuple[DatasheetValue, ...] = ()
    lent_by: str = ""
    stages: tuple[Stage, ...] = ()
    warnings: tuple[str, ...] = ()
    elapsed_s: float = 0.0
    simulated_s: float = 0.0

    @property
    def sites(self) -> tuple[str, ...]:
        """Where the named causes sit: "plant", "chain"; nowhere if none is named."""
        return tuple(sorted({CATALOGUE[cause.effect].site for cause in self.causes}))

    @property
    def site_probability(self) -> dict[str, float]:
        """What is believed of a fault in the "plant", in the "chain", in "both" or in "none"."""
        believed: dict[str, float] = dict.fromkeys(("plant", "chain", "both", "none"), 0.0)
        for one in self.verdict.judged:
            sites = [] if is_within_tolerance(one.candidate) else _sites(one)
            believed["none" if not sites else "both" if len(sites) > 1 else sites[0]] += (
                one.probability
            )
        return believed

    @property
    def extended(self) -> Judged:
        """The set that is named; the plain model, where none is."""
        return self.verdict.best if self.causes else self.verdict.baseline

    @property
    def held_out_sigma(self) -> tuple[float, float]:
        """Held-out rms of the plain and of the extended model in the extended one's sigma."""
        extended, base = self.extended.held_out, self.verdict.baseline.held_out
        return base.rms_against(extended.std), extended.rms_sigma

    @property
    def held_out_db(self) -> tuple[float, float]:
        """Held-out rms of the gain, dB, of the plain and of the extended model."""
        return self.verdict.baseline.held_out.rms_db, self.extended.held_out.rms_db

    @property
    def by_level(self) -> list[tuple[float, tuple[float, float], tuple[float, float]]]:
        """Each level, V, with what the plain and the extended model leave of it when not fitted.

        Root mean square of the gain, dB, and of the phase, deg; NaN of a phase that was not read.
        """
        return [
            (
                float(self.observation.source_vpk[level.start]),
                self.verdict.baseline.held_out.left(level),
                self.extended.held_out.left(level),
            )
            for level in self.observation.levels
        ]

    def to_json(self) -> dict[str, Any]:
        """The document of ``diagnose --json``."""
        sigma, db = self.held_out_sigma, self.held_out_db
        proposal, word = self.next_measurement, self.verdict.word
        return {
            "unit": self.unit,
            "verdict": word,
            "causes": [
                {
                    "effect": cause.effect,
                    "parameters": {
                        s.name: {
                            "value": s.value,
                            "std": s.std,
                            "unit": s.unit_symbol,
                            "datasheet": s.datasheet,
                        }
                        for s in cause.sizes
                    },
                    "probability": cause.probability,
                    "site": CATALOGUE[cause.effect].site,
                    "meaning": CATALOGUE[cause.effect].meaning,
                    "check": CATALOGUE[cause.effect].check,
                }
                for cause in self.causes
            ],
            "rivals": [
                {
                    "causes": list(one.effects),
                    "probability": one.probability,
                    "remark": self.verdict.remark(one),
                    "within_tolerance": is_within_tolerance(one.candidate),
                    "site": _sites(one),
                    "rival": one in self.verdict.rivals,
                }
                for one in self.verdict.judged
                if not self._is_named(one)
            ],
            "site": list(self.sites),
            "site_probability": self.site_probability,
            "first": {
                "causes": list(self.verdict.best.effects),
                "objection": self.verdict.best.objection,
                "misfit_sigma": self.verdict.best.misfit,
                "structure_sigma": self.verdict.best.structure,
            },
            "baseline": {"held_out_rms_sigma": sigma[0], "held_out_rms_db": db[0]},
            "extended": {"held_out_rms_sigma": sigma[1], "held_out_rms_db": db[1]},
            "gain": {"held_out_rms_ratio": sigma[1] / sigma[0]},
            **backlash_document(self.models, word, self.ratio_baseline, self.ratio_extended),
            "residual": [one.to_json() for one in self.departures],
            "residual_after": [one.to_json() for one in self.left],
            "shape": self.shape,
            "shape_after": self.left_shape,
            "harmonics": [one.to_json() for one in self.harmonics],
            "unseen": [one.to_json() for one in self.unseen],
            "by_level": [
                {"source_vpk": level, "baseline": _rms(plain), "extended": _rms(extended)}
                for level, plain, extended in self.by_level
            ],
            "sweeps": self._swept(),
            "prediction": prediction_document(
                self.observation, self.verdict.baseline, self.extended if self.causes else None
            ),
            **self.believed,
            "datasheet": {one.symbol: one.to_json() for one in self.datasheet},
            "misfit_sigma": {
                "baseline": self.verdict.baseline.misfit,
                "extended": self.extended.misfit,
            },
            "structure_sigma": {
                "baseline": self.verdict.baseline.structure,
                "extended": self.extended.structure,
            },
            "next_measurement": None if proposal is None else proposal.to_json(),
            "info": [one.to_json() for one in self.stages],
            "warnings": list(self.warnings),
            "elapsed_s": self.elapsed_s,
            "simulated_s": self.simulated_s,
        }

    def _is_named(self, one: Judged) -> bool:
        """Whether a set is the one that is named, or says the same: it is counted with that."""
        return bool(self.causes) and (one is self.verdict.best or self.verdict.is_equivalent(one))

    def _swept(self) -> list[dict[str, Any]]:
        return [sweep_document(plan) for plan, _ in self.observation.plans]

    def summary(self) -> list[str]:
        """Lines of text for a person."""
        lines = [f"{self.unit}: {self.verdict.word}. {_sentence(self)}"]
        lines += [f"  {text}" for text in how_sure(self.to_json())]
        for cause in self.causes:
            effect = CATALOGUE[cause.effect]
            sizes = ", ".join(_worded(size) for size in cause.sizes)
            lines.append(f"  {cause.effect} ({_WHERE[effect.site]}): {sizes}")
            lines.append(f"    {effect.meaning} On the bench: {effect.bench_cause}.")
            lines.append(f"    To make sure: {effect.check}.")
        lines += [f"  {text}" for text in sweep_lines(self._swept())]
        lines += [f"  {text}" for text in believed_lines(self.believed)]
        lines += [f"  {text}" for text in datasheet_lines(self.to_json())]
        lines += [f"  {text}" for text in backlash_lines(self.models, self.verdict.word)]
        sigma, db = self.held_out_sigma, self.held_out_db
        lines.append(
            f"  on levels not fitted, plain model    {sigma[0]:.2f} sigma, {db[0]:.2f} dB rms"
        )
        if self.causes:
            lines.append(
                f"  on levels not fitted, extended model {sigma[1]:.2f} sigma, {db[1]:.2f} dB rms"
            )
        for level, plain, extended in self.by_level:
            left = f"plain {_leaves(plain)}"
            if self.causes:
                left += f", extended {_leaves(extended)}"
            lines.append(f"    at {level:g} V: {left}")
        lines += self._departs()
        lines += self._sided()
        lines.append("  sets judged, by probability:")
        for one in self.verdict.judged:
            name = " + ".join(one.effects) or "nothing hidden"
            remark = self.verdict.remark(one)
            lines.append(
                f"    {one.probability:6.3f}  {name}" + (f"  ({remark})" if remark else "")
            )
        if self.next_measurement is not None:
            proposal = self.next_measurement
            lines.append(f"  {_proposed(proposal)}")
            lines.append(f"    {proposal.command}")
            lines.append("    and then diagnose the files of both measurements together")
        if self.unseen:
            lines.append(f"  {head_unseen(self.verdict.word)}:")
            lines += [f"    {text}" for text in list_unseen([u.to_json() for u in self.unseen])]
        lines.append(f"  motion simulated for this: {self.simulated_s:.0f} s")
        lines += [f"  warning: {text}" for text in self.warnings]
        return lines

    def _departs(self) -> list[str]:
        """How the measurement departs from the plain model, and from the set that stands first."""
        baseline, best = self.verdict.baseline, self.verdict.best
        shape = self.shape
        if not self.departures and baseline.refused:
            shape += f", yet it {baseline.objection}"
        lines = [f"  against the plain model: {shape}"]
        if best is not baseline:
            name = "the extended model"
            if not self.causes:
                name = f"{' + '.join(best.effects)}, the best model, which was rejected"
            lines.append(f"  against {name}: {self.left_shape}")
        if self.verdict.word == "unexplained":
            lines.append(f"  harmonics: {describe_harmonics(self.harmonics)}")
        return lines

    def _sided(self) -> list[str]:
        """What an operator asks first: whether it is the measuring chain or the mechanics."""
        word = self.verdict.word
        if word == "consistent":
            return []
        believed = sorted(self.site_probability.items(), key=lambda item: -item[1])
        shares = ", ".join(f"{_SIDES[side]} {p:.2f}" for side, p in believed if p >= _LEAST_TOLD)
        if word == "unexplained":
            shares = f"open; probabilities of the models that fit best: {shares}"
        return [f"  chain or mechanics: {shares}"]


_WHERE = {"plant": "in the mechanics", "chain": "in the measuring chain"}
_SIDES = {
    "plant": "mechanics",
    "chain": "measuring chain",
    "both": "both",
    "none": "nothing hidden",
}

_LEAST_TOLD = 0.005
"""What must be believed of a side to be told in two digits."""


def _sites(one: Judged) -> list[str]:
    """Where the causes of a set sit."""
    return sorted({CATALOGUE[effect].site for effect in one.effects})


def _rms(left: tuple[float, float]) -> dict[str, float]:
    return {"gain_db": left[0], "phase_deg": left[1]}


def _leaves(left: tuple[float, float]) -> str:
    gain_db, phase_deg = left
    return f"{gain_db:.2f} dB" + ("" if np.isnan(phase_deg) else f" and {phase_deg:.1f} deg")


def _sentence(diagnosis: Diagnosis) -> str:
    word, names = diagnosis.verdict.word, " with ".join(c.effect for c in diagnosis.causes)
    where = " and ".join(_WHERE[site] for site in diagnosis.sites)
    if word == "consistent":
        return "Nothing beyond tolerance is needed to explain this response."
    if word == "unexplained":
        return "Something is missing that no cause known here explains."
    explains = f"{names} ({where}) explains it with probability {diagnosis.verdict.probability:.2f}"
    rivals, best = diagnosis.verdict.rivals, diagnosis.verdict.best
    may = [one for one in rivals if not one.refused]
    if may:
        explains += f", but so may {_either(may, diagnosis.sites)}"
    # A rival that is refused explains nothing.
    for said, refused in (
        ("is likelier", [one for one in rivals if one.refused and one.score > best.score]),
        ("comes near", [one for one in rivals if one.refused and one.score < best.score]),
    ):
        if refused:
            explains += f"; {_either(refused)} {said}, and is no explanation"
    return f"{explains}."


def _either(sets: Sequence[Judged], sites: Sequence[str] | None = None) -> str:
    """Some sets in words, and where they sit, where that is elsewhere than at some sites."""
    return " or ".join(_set_in_words(one, sites) for one in sets)


def _set_in_words(one: Judged, sites: Sequence[str] | None) -> str:
    if not one.effects:
        return "nothing beyond tolerance"
    elsewhere = sites is not None and _sites(one) != list(sites)
    where = f" ({' and '.join(_WHERE[site] for site in _sites(one))})" if elsewhere else ""
    return " with ".join(one.effects) + where


def _proposed(proposal: NextMeasurement) -> str:
    one, other = proposal.separates
    minutes = f"{max(proposal.plan.duration_s / 60.0, 0.1):.2g} min"
    if proposal.expected_sigma < CLEAR_SIGMA:
        others = "".join(f" or {name}" for name, _ in proposal.others)
        return (
            f"no sweep within the limits is likely to tell {one} from {other}{others}; the best of "
            f"them ({proposal.expected_sigma:.1f} sigma expected, {minutes}):"
        )
    told = [f"{other} ({proposal.expected_sigma:.1f} sigma expected)"]
    told += [f"{name} ({sigma:.1f})" for name, sigma in proposal.others if sigma >= CLEAR_SIGMA]
    left = [f"{name} ({sigma:.1f})" for name, sigma in proposal.others if sigma < CLEAR_SIGMA]
    untold = f", though hardly from {' or '.join(left)}" if left else ""
    return f"to tell {one} from {' and '.join(told)}{untold}, in {minutes}:"


def _worded(size: Size) -> str:
    symbol = "" if size.unit_symbol == "1" else f" {size.unit_symbol}"
    known = "" if size.datasheet is None else f" (datasheet {size.datasheet:.4g}{symbol})"
    return f"{size.name} = {size.value:.4g} +- {size.std:.2g}{symbol}{known}"
