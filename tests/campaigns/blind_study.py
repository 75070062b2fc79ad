"""The blind study: effects drawn at random are hidden, and the diagnosis must name them.

Draws sets of four kinds (one cause, nothing, two causes, one cause that is
taken out of the catalogue), diagnoses each without looking, and writes what
came of it into its block of docs/blind-study.md. Every set is kept as one line
of JSON, so that a study that was interrupted goes on, and several can be put together.

    python tests/campaigns/blind_study.py [sets] [seed] [lines.jsonl]
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from kept import Kept, drawn_seed
from worlds.hidden import EVERY_EFFECT, Hidden, hide
from yardsticks.page import replace_block

from analysis.diagnosis import Diagnosis, diagnose_response

KINDS = {"one cause": 0.45, "nothing": 0.15, "two causes": 0.25, "unknown cause": 0.15}
CACHE = Path(__file__).parents[2] / ".venv" / "runs"
PAGE = Path(__file__).parents[2] / "docs" / "blind-study.md"


def drawn_kinds(sets: int, rng: np.random.Generator) -> list[tuple[str, str, tuple[str, ...]]]:
    """Kind, unit and effects of every set; single causes take turns before any comes again."""
    turns: list[tuple[str, str]] = []
    found = []
    for _ in range(sets):
        kind = str(rng.choice(list(KINDS), p=list(KINDS.values())))
        unit = str(rng.choice(["adss", "edss"]))
        if kind == "nothing":
            effects: tuple[str, ...] = ()
        elif kind == "two causes":
            effects = tuple(sorted(map(str, rng.choice(EVERY_EFFECT, 2, replace=False))))
        elif kind == "one cause":
            if not turns:
                every = [(u, e) for u in ("adss", "edss") for e in EVERY_EFFECT]
                turns = [every[i] for i in rng.permutation(len(every))]
            unit, effect = turns.pop()
            effects = (effect,)
        else:
            effects = (str(rng.choice(EVERY_EFFECT)),)
        found.append((kind, unit, effects))
    return found


def outcome(kind: str, hidden: Hidden, found: Diagnosis) -> dict:
    """What is kept of one set."""
    true = {e.id: dict(e.values) for e in hidden.effects}
    named = {c.effect: {s.name: (s.value, s.std) for s in c.sizes} for c in found.causes}
    ranked = [list(one.effects) for one in found.verdict.judged]
    ratio = found.ratio_extended
    return {
        "kind": kind,
        "unit": hidden.unit.name,
        "true": true,
        "ratio": hidden.ratio,
        "verdict": found.verdict.word,
        "named": named,
        "probability": found.verdict.probability,
        "ranked": ranked,
        "found_ratio": ratio,
        "held_out_sigma": found.held_out_sigma,
        "misfit": found.verdict.best.misfit,
        "proposed": found.next_measurement is not None,
    }


def run(sets: int, seed: int, kept: Kept) -> None:
    """Diagnose the sets that are not kept yet."""
    for number, (kind, unit, effects) in enumerate(drawn_kinds(sets, np.random.default_rng(seed))):
        if kept.has(seed, number):
            continue
        hidden = hide(unit, effects, np.random.default_rng([seed, number]))
        used_s = time.process_time()
        without = effects if kind == "unknown cause" else ()
        found = diagnose_response(
            hidden.response, hidden.unit, without=without, cache=CACHE, seed=number
        )
        one = {"seed": seed, "number": number} | outcome(kind, hidden, found)
        # The clock would tell of whatever else the machine was doing.
        kept.add(one | {"processor_s": time.process_time() - used_s})
        print(number, kind, unit, effects, "->", one["verdict"], list(one["named"]), flush=True)


def wilson(hits: int, count: int) -> str:
    """A share with its 95 % Wilson interval."""
    if count == 0:
        return "none tried"
    z, p = 1.96, hits / count
    centre = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z * np.sqrt(p * (1 - p) / count + z * z / (4 * count**2)) / (1 + z * z / count)
    low, high = max(centre - half, 0.0), min(centre + half, 1.0)
    return f"{hits} of {count} ({100 * p:.0f} %, 95 %: {100 * low:.0f} to {100 * high:.0f} %)"


def first_set(one: dict) -> list[str]:
    """The effects of the set judged likeliest, named or not."""
    return sorted(one["named"]) if one["named"] else sorted(one["ranked"][0])


def right(one: dict) -> bool:
    """Whether exactly what is hidden is named."""
    return sorted(one["named"]) == sorted(one["true"])


def block(kept: Kept) -> list[str]:
    """The study as Markdown."""
    known = kept.outcomes
    by = {kind: [one for one in known if one["kind"] == kind] for kind in KINDS}
    single, nothing, pairs, unknown = (by[kind] for kind in KINDS)
    rivals = [one for one in single if list(one["true"]) in one["ranked"][:3]]
    confident = [one for one in unknown if one["verdict"] == "explained"]
    ratio = [
        abs(one["found_ratio"][0] - one["ratio"]) for one in single + nothing + pairs if right(one)
    ]
    inside = sum(
        abs(one["found_ratio"][0] - one["ratio"]) <= 1.96 * one["found_ratio"][1]
        for one in single + nothing + pairs
        if right(one)
    )
    errors = [
        abs(np.log(value / one["true"][effect][name]))
        for one in single + pairs
        if right(one)
        for effect, sizes in one["named"].items()
        for name, (value, _) in sizes.items()
    ]
    lines = [
        f"{len(known)} sets, seeds {kept.seeds}.",
        "",
        "| question | answer |",
        "| --- | --- |",
        f"| one cause: named, and nothing else | {wilson(sum(map(right, single)), len(single))} |",
        "| one cause: first among the sets judged | "
        f"{wilson(sum(first_set(o) == sorted(o['true']) for o in single), len(single))} |",
        f"| one cause: among the first three | {wilson(len(rivals), len(single))} |",
        "| nothing hidden: something blamed | "
        f"{wilson(sum(bool(o['named']) for o in nothing), len(nothing))} |",
        f"| two causes: named as a pair | {wilson(sum(map(right, pairs)), len(pairs))} |",
        "| two causes: at least one of them in the first set | "
        f"{wilson(sum(bool(set(first_set(o)) & set(o['true'])) for o in pairs), len(pairs))} |",
        "| cause taken out of the catalogue: another blamed with confidence | "
        f"{wilson(len(confident), len(unknown))} |",
    ]
    if ratio:
        lines += [
            f"| contribution ratio, median error | {np.median(ratio):.3f} |",
            f"| contribution ratio, 95 % interval holds the truth | {wilson(inside, len(ratio))} |",
        ]
    if errors:
        lines.append(f"| size of the effect, median error | {100 * np.median(errors):.0f} % |")
    lines += [
        "| processor time for one set, median and longest | "
        f"{np.median([o['processor_s'] for o in known]):.0f} s, "
        f"{max(o['processor_s'] for o in known):.0f} s |",
        "",
        "### Reliability",
        "",
        "Of the sets given a probability, the share that was right:",
        "",
        "| probability of the likeliest set | right |",
        "| --- | --- |",
    ]
    for low, high in ((0.0, 0.5), (0.5, 0.8), (0.8, 0.95), (0.95, 1.01)):
        part = [o for o in single + pairs if low <= o["probability"] < high]
        hits = sum(first_set(o) == sorted(o["true"]) for o in part)
        lines.append(f"| {low:g} to {min(high, 1):g} | {wilson(hits, len(part))} |")
    lines += [
        "",
        "### What was taken for what",
        "",
        "| hidden | answer | times |",
        "| --- | --- | --- |",
    ]
    answers = Counter(
        (" + ".join(sorted(o["true"])) or "nothing", o["kind"] == "unknown cause", _answer(o))
        for o in known
        if o["kind"] == "unknown cause" or not right(o)
    )
    for (true, withheld, answer), times in sorted(answers.items()):
        lines.append(f"| {true}{' (withheld)' if withheld else ''} | {answer} | {times} |")
    return [*lines, "", "Sets that were named rightly are left out of this table."]


def _answer(one: dict) -> str:
    return one["verdict"] + (f": {' + '.join(one['named'])}" if one["named"] else "")


def main(sets: int = 60, seed: int | None = None, lines: str = "build/blind-study.jsonl") -> None:
    """Run the study and write its block."""
    seed, kept = drawn_seed(seed), Kept(lines)
    print(f"seed {seed}, {sets} sets", flush=True)
    run(sets, seed, kept)
    text = block(kept)
    replace_block("study", text, PAGE)
    print("\n".join(text))


if __name__ == "__main__":
    main(*(int(a) for a in sys.argv[1:3]), *sys.argv[3:4])
