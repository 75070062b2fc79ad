"""What a report is made of, without simulating: a response, an estimate, a diagnosis."""

from types import SimpleNamespace

import numpy as np
import pytest
from worlds import synthetic
from worlds.untrained import Untrained

import analysis.diagnosis.diagnose as diagnosis_module
import analysis.diagnosis.search as search_module
from analysis.emulation.likelihood import TEMPERATURE
from analysis.emulation.parameter_posterior import ParameterPosterior
from analysis.inference.refine import Refined
from daq.frf import FrequencyResponse
from sim.unit import load_unit

LEVELS, FREQUENCIES = synthetic.LEVELS, synthetic.FREQUENCIES
ADSS = load_unit("adss")
NASTY = "</script><script>alert(1)</script>\"'><img src=x onerror=alert(2)> & $\\frac$ \x00 ünd\n2"

ESTIMATE = {
    "unit": "ADSS",
    "contribution_ratio": {"value": 0.3, "std": 0.02, "interval95": [0.26, 0.34]},
    "b1_deg": {"value": 0.2079, "std": 0.0139, "interval95": [0.18, 0.236]},
    "b2_deg": {"value": 0.0462, "std": 0.0013, "interval95": [0.0436, 0.0488]},
    "b_t_deg": {"value": 0.066, "std": 0.0},
    "error_index": {
        "ratio": [0.0, 0.25, 0.5, 0.75, 1.0],
        "hz": [4.0, 1.0, 3.0, 6.0, 9.0],
        "std_hz": [1.0, 0.5, None, 1.0, 1.0],
        "minimum_ratio": 0.25,
    },
    "warnings": ["the model leaves 2.0 standard deviations"],
}


def response(**words: object) -> FrequencyResponse:
    """An anti-resonance at 130 Hz and a resonance at 150 Hz at two levels."""
    frequency = np.tile(FREQUENCIES, len(LEVELS))
    s = 1j * frequency

    def pair(f0: float) -> np.ndarray:
        return s**2 + 2 * 0.02 * f0 * s + f0**2

    gain = 0.3 * pair(130.0) / pair(150.0)
    noise = np.random.default_rng(1).standard_normal((2, len(gain))) * 0.005
    provenance = {
        "kind": "measured",
        "operator": "A. B.",
        "notes": "warm",
        "serial": "SN 7",
        "started": "2026-01-02T03:04:05+00:00",
        "instrument": {"maker": "HP", "model": "35670A", "serial": "1", "revision": "A.0"},
        "configurations": {"unit": "schema = 1", "bench": "# bench"},
    }
    return FrequencyResponse.from_arrays(
        frequency,
        np.repeat(LEVELS, len(FREQUENCIES)),
        gain * (1 + noise[0] + 1j * noise[1]),
        unit=str(words.pop("unit", "ADSS")),
        gain_std_db=0.05,
        phase_std_deg=0.3,
        direction="up",
        settle_cycles=20,
        integrate_cycles=30,
        from_rest=False,
        provenance=provenance | words,
    )


def sharpened(unit, candidate, *_):
    """What all its runs would tell of a candidate: where it is, sharply."""
    d = len(candidate.best.place)
    return ParameterPosterior(candidate.best.place, 0.02**2 * np.eye(d))


def diagnosis(
    monkeypatch: pytest.MonkeyPatch,
    hidden: tuple[str, ...],
    judged: list[tuple[str, ...]],
):
    """A real diagnosis of a synthetic world in which some effects are hidden.

    But for runs of what is proposed and of what is named: these would be simulated, and of another
    world.
    """
    rng = np.random.default_rng(3)
    place = np.array([0.5, *([0.6] if hidden else [])])
    seen = synthetic.observation(synthetic.read(hidden, place, rng))
    candidates = [synthetic.candidate(seen, effects) for effects in [(), *judged]]
    posterior = Untrained()
    # The network knows whether anything is hidden, and not what.
    log_prior = {one.hypothesis.effects: 0.0 for one in candidates}
    log_prior[()] = -5.0 if hidden else 5.0
    log_odds = {
        one.hypothesis.effects: one.best.log_likelihood / TEMPERATURE
        + log_prior[one.hypothesis.effects]
        for one in candidates
    }
    refined = Refined(candidates, posterior.summary(seen, {}), log_prior, log_odds)
    monkeypatch.setattr(diagnosis_module, "observe", lambda response: seen)
    monkeypatch.setattr(diagnosis_module, "Posterior", SimpleNamespace(find=lambda *_: posterior))
    monkeypatch.setattr(search_module, "refine", lambda *_, **__: refined)
    monkeypatch.setattr(diagnosis_module, "propose_measurement", lambda *_, **__: None)
    monkeypatch.setattr(search_module, "refine_parameters", sharpened)
    return diagnosis_module.diagnose_response(response(), ADSS)
