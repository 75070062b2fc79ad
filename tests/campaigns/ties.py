"""How often the measurement that a diagnosis recommends breaks a tie.

Hides single causes, drawn at random, in sweeps of one level: what a bench in a
hurry takes, and what leaves rivals. Where the diagnosis proposes a measurement
and one of the two that it is to part is the truth, that sweep is made of the
same machine, both are simulated through it, and the one that explains it
better is told.

    python tests/campaigns/ties.py [sets] [seed]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from blind_study import CACHE, wilson
from hidden import EVERY_EFFECT, Hidden, hide

from analysis.candidate import Candidate, form_candidates
from analysis.diagnosis import Diagnosis, diagnose_response
from analysis.observation import observe
from analysis.placement import groups_along
from analysis.population import simulate_groups

LEVEL_VPK = 2.5
GROUPS = 6
CLEAR = 20.0
"""Log-likelihood from which on the diagnosis itself calls a lead no tie."""


def parted(hidden: Hidden, found: Diagnosis, rng: np.random.Generator) -> float | None:
    """By how much the truth leads after the proposed sweep; None where it is not one of the two."""
    proposal = found.next_measurement
    true = tuple(sorted(effect.id for effect in hidden.effects))
    known = {one.effects: one.candidate for one in found.verdict.judged}
    pair = [tuple(n.split("+")) if n != "none" else () for n in proposal.separates]
    if true not in pair:
        return None
    (other,) = (key for key in pair if key != true)
    seen = observe(hidden.measured(proposal.plan, rng)).with_noise(found.observation.noise_v)
    rivals: list[Candidate] = [known[true], known[other]]
    groups = [group for rival in rivals for group in groups_along(rival, GROUPS, rng)]
    runs = simulate_groups(hidden.unit, groups, seen, rng)
    starts = {rival.hypothesis.effects: rival.best.place for rival in rivals}
    formed = form_candidates(hidden.unit, seen, runs, starts)
    return formed[true].best.log_likelihood - formed[other].best.log_likelihood


def main(sets: int = 12, seed: int | None = None) -> None:
    """Print each set and the shares."""
    seed = int(np.random.SeedSequence().entropy % 2**32) if seed is None else seed
    print(f"seed {seed}, {sets} sets", flush=True)
    leads: list[float] = []
    for number in range(sets):
        rng = np.random.default_rng([seed, number])
        unit, effect = str(rng.choice(["adss", "edss"])), str(rng.choice(EVERY_EFFECT))
        hidden = hide(unit, (effect,), rng, (LEVEL_VPK,))
        found = diagnose_response(hidden.response, hidden.unit, cache=CACHE, seed=number)
        proposal = found.next_measurement
        lead = None if proposal is None else parted(hidden, found, rng)
        asked = "nothing" if proposal is None else " or ".join(proposal.separates)
        told = "" if lead is None else f", truth leads by {lead:.0f}"
        print(f"{number} {unit} {effect}: {found.verdict.word}, asks {asked}{told}", flush=True)
        if lead is not None:
            leads.append(lead)
    clear = sum(lead > CLEAR for lead in leads)
    wrong = sum(lead < -CLEAR for lead in leads)
    print(f"the truth leads clearly: {wilson(clear, len(leads))}")
    print(f"the other leads clearly: {wilson(wrong, len(leads))}")


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:3]))
