"""What a diagnosis says: as one document for programs, and in words for a person.

Owns the wording and the names in the document. Nothing is computed here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from analysis.misfit import Departure
from analysis.next_measurement import NextMeasurement
from analysis.observation import Observation
from analysis.swept import sweep_document, sweep_lines
from analysis.verdict import Judged, Verdict
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

    `ratio_baseline`, `ratio_extended`: contribution ratio and its standard
    deviation under the plain and the extended model. `departures`: of the
    measurement from the plain model; `left`: from the extended one.
    `cut_short`: whether a search that found no explanation did not try every set that was worth
    it, for what it may simulate. `simulated_s`: seconds of motion that were simulated for it.
    """

    unit: str
    verdict: Verdict
    causes: tuple[Cause, ...]
    ratio_baseline: tuple[float, float]
    ratio_extended: tuple[float, float]
    departures: tuple[Departure, ...]
    left: tuple[Departure, ...]
    shape: str
    next_measurement: NextMeasurement | None
    observation: Observation
    cut_short: bool = False
    warnings: tuple[str, ...] = ()
    elapsed_s: float = 0.0
    simulated_s: float = 0.0

    @property
    def sites(self) -> tuple[str, ...]:
        """Where the named causes sit: "plant", "chain"; nowhere if none is named."""
        return tuple(sorted({CATALOGUE[cause.effect].site for cause in self.causes}))

    @property
    def held_out_sigma(self) -> tuple[float, float]:
        """Held-out rms of the plain and of the extended model in the extended one's sigma."""
        best, base = self.verdict.best.held_out, self.verdict.baseline.held_out
        return base.rms_against(best.std), best.rms_sigma

    @property
    def held_out_db(self) -> tuple[float, float]:
        """Held-out rms of the gain, dB, of the plain and of the extended model."""
        return self.verdict.baseline.held_out.rms_db, self.verdict.best.held_out.rms_db

    def to_json(self) -> dict[str, Any]:
        """The document of ``diagnose --json``."""
        sigma, db = self.held_out_sigma, self.held_out_db
        proposal = self.next_measurement
        return {
            "unit": self.unit,
            "verdict": self.verdict.word,
            "causes": [
                {
                    "effect": cause.effect,
                    "parameters": {
                        s.name: {"value": s.value, "std": s.std, "unit": s.unit_symbol}
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
                }
                for one in self.verdict.judged
                if sorted(one.effects) != sorted(cause.effect for cause in self.causes)
            ],
            "site": list(self.sites),
            "baseline": {"held_out_rms_sigma": sigma[0], "held_out_rms_db": db[0]},
            "extended": {"held_out_rms_sigma": sigma[1], "held_out_rms_db": db[1]},
            "gain": {"held_out_rms_ratio": sigma[1] / sigma[0]},
            "contribution_ratio": {
                "baseline": _uncertain(self.ratio_baseline),
                "extended": _uncertain(self.ratio_extended),
            },
            "residual": [one.to_json() for one in self.departures],
            "residual_after": [one.to_json() for one in self.left],
            "shape": self.shape,
            "sweeps": self._swept(),
            "misfit_sigma": {
                "baseline": self.verdict.baseline.misfit,
                "extended": self.verdict.best.misfit,
            },
            "structure_sigma": {
                "baseline": self.verdict.baseline.structure,
                "extended": self.verdict.best.structure,
            },
            "next_measurement": None if proposal is None else proposal.to_json(),
            "warnings": list(self.warnings),
            "elapsed_s": self.elapsed_s,
            "simulated_s": self.simulated_s,
        }

    def _swept(self) -> list[dict[str, Any]]:
        return [sweep_document(plan) for plan, _ in self.observation.plans]

    def summary(self) -> list[str]:
        """Lines of text for a person."""
        lines = [f"{self.unit}: {self.verdict.word}. {_sentence(self)}"]
        for cause in self.causes:
            effect = CATALOGUE[cause.effect]
            sizes = ", ".join(_worded(size) for size in cause.sizes)
            lines.append(f"  {cause.effect} ({_WHERE[effect.site]}): {sizes}")
            lines.append(f"    {effect.meaning} On the bench: {effect.bench_cause}.")
            lines.append(f"    To make sure: {effect.check}.")
        lines += [f"  {text}" for text in sweep_lines(self._swept())]
        base, extended = self.ratio_baseline, self.ratio_extended
        lines.append(f"  contribution ratio, plain model      {base[0]:.3f} +- {base[1]:.3f}")
        if self.causes:
            lines.append(
                f"  contribution ratio, extended model   {extended[0]:.3f} +- {extended[1]:.3f}"
            )
        sigma, db = self.held_out_sigma, self.held_out_db
        lines.append(
            f"  on levels not fitted, plain model    {sigma[0]:.2f} sigma, {db[0]:.2f} dB rms"
        )
        if self.causes:
            lines.append(
                f"  on levels not fitted, extended model {sigma[1]:.2f} sigma, {db[1]:.2f} dB rms"
            )
        lines.append(f"  against the plain model: {self.shape}")
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
        lines.append(f"  motion simulated for this: {self.simulated_s:.0f} s")
        lines += [f"  warning: {text}" for text in self.warnings]
        return lines


_CLEAR_SIGMA = 2.0
"""What a further sweep has to part two sets by, to be worth its while."""

_WHERE = {"plant": "in the mechanics", "chain": "in the measuring chain"}


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
        explains += f", but so may {_either(may)}"
    # A rival that is refused explains nothing.
    for said, refused in (
        ("is likelier", [one for one in rivals if one.refused and one.score > best.score]),
        ("comes near", [one for one in rivals if one.refused and one.score < best.score]),
    ):
        if refused:
            explains += f"; {_either(refused)} {said}, and is no explanation"
    return f"{explains}."


def _either(sets: Sequence[Judged]) -> str:
    return " or ".join(" with ".join(one.effects) or "nothing beyond tolerance" for one in sets)


def _proposed(proposal: NextMeasurement) -> str:
    one, other = proposal.separates
    if proposal.expected_sigma < _CLEAR_SIGMA:
        return (
            f"no sweep within the limits is likely to tell {one} from {other}; the best of them "
            f"({proposal.expected_sigma:.1f} sigma expected):"
        )
    return f"to tell {one} from {other} ({proposal.expected_sigma:.1f} sigma expected):"


def _uncertain(pair: tuple[float, float]) -> dict[str, float]:
    return {"value": pair[0], "std": pair[1]}


def _worded(size: Size) -> str:
    symbol = "" if size.unit_symbol == "1" else f" {size.unit_symbol}"
    known = "" if size.datasheet is None else f" (datasheet {size.datasheet:.4g}{symbol})"
    return f"{size.name} = {size.value:.4g} +- {size.std:.2g}{symbol}{known}"
