"""The diagnosis from the paper's numbers as one document.

Owns names and nesting: what ``diagnose`` says of a response, as far as it
applies to features, and the sections that only features have.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.estimate.backlash import backlash_of_places
from analysis.paper_diagnosis.evidence import Agreement
from analysis.paper_diagnosis.pairs import CHAIN, DISSIPATION, LOADS, VISCOUS
from analysis.paper_diagnosis.posterior import Belief, Judged, index_of
from analysis.paper_diagnosis.result import PaperFindings
from sim.catalogue import CATALOGUE
from sim.paper_scheme import PAPER_LEVEL_VPK

__all__ = ["document", "parameters", "residual"]

_QUANTITIES = ("arf-frequency", "arf-gain", "rf-frequency", "rf-gain", "arf-half-power-width")
_UNITS = ("Hz", "dB", "Hz", "dB", "Hz")
_GAINS = [1, 3]


def document(diagnosis: PaperFindings) -> dict[str, Any]:
    """Everything by name; the top level holds with the ratio unknown."""
    free = _section(diagnosis.free)
    proposal = diagnosis.next_measurement
    return {
        "unit": diagnosis.unit,
        "source": "paper",
        **free,
        "ratio_as_measured": None if diagnosis.known is None else _section(diagnosis.known),
        "procedures": {
            name: {
                "error_index": _index(agreement),
                "probability_of_worse": agreement.probability_of_worse(),
                "log_evidence": agreement.log_evidence,
            }
            for name, agreement in diagnosis.procedures.items()
        },
        **diagnosis.believed,
        "next_measurement": None if proposal is None else proposal.to_json(),
        "warnings": list(diagnosis.warnings),
        "elapsed_s": diagnosis.elapsed_s,
    }


def _section(belief: Belief) -> dict[str, Any]:
    """What is believed under one state of knowledge."""
    plain, best = belief.baseline.agreement, belief.best.agreement
    (base_sigma, base_db), (best_sigma, best_db) = _held_out(plain, best), _held_out(best, best)
    return {
        "verdict": belief.word,
        "causes": _causes(belief),
        "rivals": [
            {
                "causes": list(one.effects),
                "probability": one.probability,
                "probability_of_worse": one.probability_of_worse,
            }
            for one in belief.rivals
        ],
        "site": list(best.hypothesis.sites),
        "inclusion": belief.inclusion(),
        "kinds": {
            "loses-energy": belief.probability_of_any(DISSIPATION),
            "more-on-the-load": belief.probability_of_any(LOADS),
            "measuring-chain": belief.probability_of_any(CHAIN),
        },
        "anything_missing": 1.0 - belief.baseline.probability,
        "baseline": _model(belief.baseline, base_sigma, base_db),
        "extended": _model(belief.best, best_sigma, best_db),
        "gain": {"held_out_rms_ratio": best_sigma / base_sigma},
        "contribution_ratio": {
            "baseline": _ratio(plain),
            "extended": _ratio(best),
            "all_sets": dict(zip(("value", "std"), belief.ratio(), strict=True)),
        },
        **_stages(belief),
        "residual": residual(plain),
        "residual_after": residual(best),
        "error_index": _index_section(belief),
        "damping_alone": _damping_alone(belief),
    }


def _stages(belief: Belief) -> dict[str, Any]:
    """The backlash by stage of the accepted set, null where none is accepted."""
    names = ("b1_deg", "b2_deg", "b_t_deg")
    if belief.word not in ("consistent", "explained"):
        return dict.fromkeys(names)
    accepted = belief.baseline if belief.word == "consistent" else belief.best
    agreement, hypothesis = accepted.agreement, accepted.agreement.hypothesis
    unit = hypothesis.unit
    total = np.full(len(agreement.places), unit.backlash.b_t_deg)
    for at, (_, parameter) in enumerate(hypothesis.parameters):
        if parameter.name == "b_t_deg":
            total = np.array([hypothesis.values(place)[at] for place in agreement.places])
    told = backlash_of_places(unit, agreement.places[:, 0], total, agreement.weight).to_json()
    return {name: told[name] for name in names}


def parameters(agreement: Agreement) -> dict[str, dict[str, dict[str, Any]]]:
    """Fitted values by effect and name, each with its standard deviation and unit."""
    hypothesis = agreement.hypothesis
    mean, std = agreement.moments()
    values = hypothesis.values(mean)
    # Coordinates are logarithms of the values, stretched over their range.
    stds = values * (hypothesis.logs[:, 1] - hypothesis.logs[:, 0]) * std[1:]
    found: dict[str, dict[str, dict[str, Any]]] = {effect: {} for effect in hypothesis.effects}
    for (effect, parameter), value, error in zip(hypothesis.parameters, values, stds, strict=True):
        found[effect][parameter.name] = {
            "value": float(value),
            "std": float(error),
            "unit": parameter.symbol_of(hypothesis.unit),
        }
    return found


def _held_out(agreement: Agreement, yardstick: Agreement) -> tuple[float, float]:
    """Rms of each number's prediction from the others, in a yardstick's sigma and in dB.

    One drive level leaves nothing else to hold out. The plain model is measured in the extended
    one's sigma, or a model would look better by scattering more.
    """
    predicted, _ = agreement.held_out()
    _, std = yardstick.held_out()
    apart = agreement.reading.values - predicted
    return _rms(apart / std), _rms(apart[_GAINS])


def residual(agreement: Agreement) -> list[dict[str, Any]]:
    """Measured less predicted at the likeliest place: `mean` in `unit`, `sigma` in its std."""
    values, (mean, _) = agreement.reading.values, agreement.at_best
    departure = agreement.departure
    half = 0.5 * values[4] if np.isfinite(values[4]) else 0.0
    arf, rf = float(values[0]), float(values[2])
    band = {True: [arf - half, arf + half], False: [rf, rf]}
    return [
        {
            "band_hz": band[name.startswith("arf")],
            "source_vpk": PAPER_LEVEL_VPK,
            "quantity": name,
            "unit": _UNITS[k],
            "mean": float(values[k] - mean[k]),
            "sigma": float(departure[k]),
        }
        for k, name in enumerate(_QUANTITIES)
        if np.isfinite(values[k])
    ]


def _causes(belief: Belief) -> list[dict[str, Any]]:
    if belief.word not in ("explained", "ambiguous"):
        return []
    fitted = parameters(belief.best.agreement)
    probability = {one.effects: one.probability for one in belief.judged}

    def without(effect: str) -> float:
        return probability.get(tuple(e for e in fitted if e != effect), 0.0)

    return [
        {
            "effect": effect,
            "parameters": fitted[effect],
            "probability": belief.best.probability,
            "site": CATALOGUE[effect].site,
            "meaning": CATALOGUE[effect].meaning,
        }
        # First what costs most to leave out.
        for effect in sorted(fitted, key=without)
    ]


def _model(judged: Judged, sigma: float, db: float) -> dict[str, Any]:
    mean, std = judged.agreement.at_best
    return {
        "causes": list(judged.effects),
        "held_out_rms_sigma": sigma,
        "held_out_rms_db": db,
        "probability": judged.probability,
        "probability_of_worse": judged.probability_of_worse,
        "log_evidence": judged.agreement.log_evidence,
        "predicted": {
            name: {"value": float(mean[k]), "std": float(std[k]), "unit": _UNITS[k]}
            for k, name in enumerate(_QUANTITIES)
        },
    }


def _index_section(belief: Belief) -> dict[str, Any]:
    before, after = (index_of(one.agreement) for one in (belief.baseline, belief.best))
    over_all, over_all_std = belief.expected_index()
    return {
        "before": _index(belief.baseline.agreement),
        "after": _index(belief.best.agreement),
        "all_sets": {"expected_hz": over_all, "expected_std_hz": over_all_std},
        "fall_hz": {
            "value": before.expected - after.expected,
            "std": float(np.hypot(before.expected_std, after.expected_std)),
        },
    }


def _index(agreement: Agreement) -> dict[str, Any]:
    index = index_of(agreement)
    return {
        "hz": index.value,
        "std_hz": index.std,
        "expected_hz": index.expected,
        "expected_std_hz": index.expected_std,
        "floor_hz": index.floor,
        "ratio": float(agreement.best[0]),
    }


def _damping_alone(belief: Belief) -> dict[str, Any] | None:
    alone = belief.damping_alone
    if alone is None:
        return None
    return {
        "enough": belief.damping_is_enough,
        "causes": list(alone.effects),
        "parameters": parameters(alone.agreement),
        "contribution_ratio": _ratio(alone.agreement),
        "probability": belief.probability_of_only(VISCOUS),
        "probability_of_worse": alone.probability_of_worse,
        "log_evidence_behind_best": belief.behind(alone),
        "error_index": _index(alone.agreement),
        "residual": residual(alone.agreement),
    }


def _ratio(agreement: Agreement) -> dict[str, float]:
    mean, std = agreement.moments()
    return {"value": float(mean[0]), "std": float(std[0])}


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.nanmean(values**2)))
