"""How often the measurement that a diagnosis recommends breaks a tie.

Hides single causes, drawn at random, in sweeps of one level: what a bench in a
hurry takes, and what leaves rivals. Where the diagnosis proposes a measurement
that sweep is made of the same machine, and both are diagnosed together, as a
user would. Every set is kept as a line of JSON, and the shares go into their
block of docs/blind-study.md.

    python tests/campaigns/ties.py [sets] [seed] [lines.jsonl]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from blind_study import CACHE, PAGE, wilson
from kept import Kept, drawn_seed
from worlds.hidden import EVERY_EFFECT, Hidden, hide
from yardsticks.page import replace_block

from analysis.diagnosis import Diagnosis, diagnose_response

LEVEL_VPK = 2.5


def answer(hidden: Hidden, found: Diagnosis) -> dict:
    """What a diagnosis says: `first` whether what is hidden is named, `alone` without a rival."""
    true = sorted(effect.id for effect in hidden.effects)
    first = sorted(cause.effect for cause in found.causes) == true
    return {
        "verdict": found.verdict.word,
        "named": [cause.effect for cause in found.causes],
        "rivals": [list(one.effects) for one in found.verdict.rivals],
        "first": first,
        "alone": first and found.verdict.word == "explained",
        "ratio_off": found.ratio_extended[0] - hidden.ratio,
        "ratio_std": found.ratio_extended[1],
    }


def outcome(number: int, seed: int) -> dict:
    """What is kept of one set."""
    rng = np.random.default_rng([seed, number])
    unit, effect = str(rng.choice(["adss", "edss"])), str(rng.choice(EVERY_EFFECT))
    hidden = hide(unit, (effect,), rng, (LEVEL_VPK,))
    used_s = time.process_time()
    found = diagnose_response(hidden.response, hidden.unit, cache=CACHE, seed=number)
    proposal, together = found.next_measurement, None
    if proposal is not None:
        second = hidden.measured(proposal.plan, rng)
        both = diagnose_response(
            hidden.response, hidden.unit, further=[second], cache=CACHE, seed=number
        )
        together = answer(hidden, both)
    return {
        "seed": seed,
        "number": number,
        "unit": unit,
        "effect": effect,
        "once": answer(hidden, found),
        "asked": None if proposal is None else proposal.command,
        "expected_sigma": None if proposal is None else proposal.expected_sigma,
        "together": together,
        "processor_s": time.process_time() - used_s,
    }


def block(kept: Kept) -> list[str]:
    """The shares as Markdown."""
    asked = [one for one in kept.outcomes if one["together"] is not None]
    rows = [
        ("what is hidden is named, and nothing else", lambda said: said["alone"]),
        ("what is hidden is named first", lambda said: said["first"]),
        (
            "something else is named, without a rival",
            lambda said: said["verdict"] == "explained" and not said["first"],
        ),
        (
            "contribution ratio within two of its error bars",
            lambda said: abs(said["ratio_off"]) < 2.0 * said["ratio_std"],
        ),
    ]
    lines = [
        f"{len(kept.outcomes)} sets, seeds {kept.seeds}; "
        f"a further measurement was proposed for {len(asked)}. Of these:",
        "",
        "| | by the first sweep | by both together |",
        "| --- | --- | --- |",
    ]
    for words, holds in rows:
        counts = [sum(holds(one[when]) for one in asked) for when in ("once", "together")]
        lines.append("| " + " | ".join([words, *(wilson(n, len(asked)) for n in counts)]) + " |")
    return lines


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
