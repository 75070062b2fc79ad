"""How often the measurement that a diagnosis recommends breaks a tie.

Hides single causes, drawn at random, in sweeps of one level: what a bench in a
hurry takes, and what leaves rivals. Where the diagnosis proposes a measurement
and one of the two that it is to part is the truth, that sweep is made of the
same machine, both are simulated through it, and the one that explains it
better is told. Every set is kept as a line of JSON, and the shares go into their
block of docs/blind-study.md.

    python tests/campaigns/ties.py [sets] [seed] [lines.jsonl]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from blind_study import CACHE, PAGE, wilson
from hidden import EVERY_EFFECT, Hidden, hide
from kept import Kept, drawn_seed
from yardsticks.page import replace_block

from analysis.candidate import Candidate, form_candidates
from analysis.diagnosis import Diagnosis, diagnose_response
from analysis.likelihood import HEAT
from analysis.observation import observe
from analysis.placement import groups_along
from analysis.population import simulate_groups

LEVEL_VPK = 2.5
GROUPS = 6
CLEAR = 2.0 * HEAT
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


def outcome(number: int, seed: int) -> dict:
    """What is kept of one set."""
    rng = np.random.default_rng([seed, number])
    unit, effect = str(rng.choice(["adss", "edss"])), str(rng.choice(EVERY_EFFECT))
    hidden = hide(unit, (effect,), rng, (LEVEL_VPK,))
    found = diagnose_response(hidden.response, hidden.unit, cache=CACHE, seed=number)
    proposal = found.next_measurement
    return {
        "seed": seed,
        "number": number,
        "unit": unit,
        "effect": effect,
        "verdict": found.verdict.word,
        "asked": None if proposal is None else list(proposal.separates),
        "expected_sigma": None if proposal is None else proposal.expected_sigma,
        "lead": None if proposal is None else parted(hidden, found, rng),
    }


def block(kept: Kept) -> list[str]:
    """The shares as Markdown."""
    known = kept.outcomes
    leads = [one["lead"] for one in known if one["lead"] is not None]
    clear, wrong = sum(lead > CLEAR for lead in leads), sum(lead < -CLEAR for lead in leads)
    return [
        f"{len(known)} sets, seeds {kept.seeds}.",
        "",
        "| question | answer |",
        "| --- | --- |",
        "| a further measurement was proposed | "
        f"{wilson(sum(one['asked'] is not None for one in known), len(known))} |",
        "| what is hidden was one of the two to be parted, of those | "
        f"{wilson(len(leads), sum(one['asked'] is not None for one in known))} |",
        f"| after it, what is hidden led clearly | {wilson(clear, len(leads))} |",
        f"| after it, the other one led clearly | {wilson(wrong, len(leads))} |",
    ]


def main(sets: int = 12, seed: int | None = None, lines: str = "build/ties.jsonl") -> None:
    """Print each set, and write the shares."""
    seed, kept = drawn_seed(seed), Kept(lines)
    print(f"seed {seed}, {sets} sets", flush=True)
    for number in range(sets):
        if not kept.has(seed, number):
            kept.add(outcome(number, seed))
            print(kept.outcomes[-1], flush=True)
    text = block(kept)
    replace_block("ties", text, PAGE)
    print("\n".join(text))


if __name__ == "__main__":
    main(*(int(a) for a in sys.argv[1:3]), *sys.argv[3:4])
