"""The smallest size of every cause that the diagnosis names four times in five.

A staircase for each cause: where it was named the next one hidden is smaller, where it was
not it is larger, each in a machine, a motion and a reading drawn anew. A logistic curve
through what came of it, of one width for all causes, says where four in five are named.
Sweeps are short (24 frequencies at two levels), so that the answer is on the large side.

    python tests/campaigns/smallest.py [runs of each] [seed] [lines.jsonl]

Every run is kept as a line of JSON, and a study that was interrupted goes on.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1]))

from blind_study import CACHE, PAGE
from kept import Kept, drawn_seed
from worlds.hidden import EVERY_EFFECT, off_datasheet, reading
from yardsticks.page import replace_block

from analysis.ensemble.model import Hypothesis
from analysis.inference.posterior import Posterior
from analysis.inference.refine import refine
from analysis.observation.observation import observe
from analysis.selection.verdict import judge_candidates
from daq.plan import SweepPlan, spaced_frequencies
from sim.effects import EffectSetting
from sim.response import simulate
from sim.unit import Unit, load_unit

UNIT = load_unit("adss")
BAND_HZ = (105.0, 172.0)
PLAN = SweepPlan(spaced_frequencies(*BAND_HZ, 24), (1.5, 4.0))

OFF = (0.01, 0.5)
"""How far a datasheet value is off, from strength 0 to 1."""
GROWTH = (0.03, 1.6)
"""The same for the logarithm of what a friction of the datasheet has grown by."""

FIRST, STEPS = 0.5, (0.25, 0.15, 0.1, 0.07)

CENTRES = np.linspace(-0.5, 1.5, 401)
WIDTHS = np.array([0.02, 0.04, 0.07, 0.1, 0.15])
PRIOR = (0.4, 0.4)
"""Where a threshold lies before anything was tried, and how far from there."""
FOUR_IN_FIVE = float(np.log(4.0))

Trial = tuple[float, bool]


def sized(unit: Unit, effect: str, strength: float, rng: np.random.Generator) -> EffectSetting:
    """An effect of a strength from 0 to 1; what else it has is drawn."""
    hypothesis = Hypothesis(unit, (effect,))
    (_, first), *others = hypothesis.parameters
    sign = float(rng.choice([-1.0, 1.0]))
    values = {first.name: _first_value(hypothesis, strength, sign)}
    for (_, parameter), ends in zip(others, np.exp(hypothesis.logs[1:]), strict=True):
        # A payload that resonates in the band that is measured.
        low, high = BAND_HZ if parameter.name == "f_p" else ends
        values[parameter.name] = _between((low, high), rng.uniform(0.3, 0.7))
    return EffectSetting(effect, values)


def _first_value(hypothesis: Hypothesis, strength: float, sign: float = 1.0) -> float:
    """Of the first parameter, which says how large an effect is."""
    parameter = hypothesis.parameters[0][1]
    known = parameter.nominal(hypothesis.unit)
    if hypothesis.amid == [True]:
        return known * float(np.exp(sign * _between(OFF, strength)))
    if known is not None:
        return known * float(np.exp(_between(GROWTH, strength)))
    low, high = np.exp(hypothesis.logs[0])
    # An amplifier saturates the more the lower its limit is.
    return _between((high, low) if parameter.name == "V_sat" else (low, high), strength)


def worded(effect: str, strength: float) -> str:
    """A size in the words of a bench."""
    hypothesis = Hypothesis(UNIT, (effect,))
    parameter, value = hypothesis.parameters[0][1], _first_value(hypothesis, strength)
    known = parameter.nominal(UNIT)
    if known is not None:
        return f"{parameter.name} off by {100 * (value / known - 1.0):.0f} %"
    symbol = "" if parameter.unit_symbol == "1" else f" {parameter.unit_symbol}"
    return f"{parameter.name} = {value:.2g}{symbol}"


def _within(effect: str, strength: float) -> str:
    """The same, or that it is more than the largest that is looked for."""
    return worded(effect, strength) if strength <= 1.0 else f"over {worded(effect, 1.0)}"


def is_named(effect: str, setting: EffectSetting, rng: np.random.Generator) -> bool:
    """Hide it, and say whether it and nothing else is named."""
    machine, ratio = off_datasheet(UNIT, rng), float(rng.uniform(0.05, 0.95))
    seed = int(rng.integers(2**31))
    swept = simulate(machine, ratio, PLAN, effects=(setting,), seed=seed)
    seen = observe(reading(swept, rng))
    found = refine(Posterior.find(UNIT, CACHE), seen, seed=seed)
    observation = found.candidates[0].surface.observation
    verdict = judge_candidates(found.candidates, observation, rng, found.log_odds)
    return verdict.word in ("explained", "ambiguous") and verdict.best.effects == (effect,)


def next_strength(trials: Sequence[Trial]) -> float:
    """Where the staircase goes on."""
    at = FIRST
    for turn, (_, named) in enumerate(trials):
        step = STEPS[min(turn, len(STEPS) - 1)]
        at += -step if named else step
    return float(np.clip(at, 0.0, 1.0))


def thresholds(trials: Sequence[Sequence[Trial]]) -> list[tuple[float, float]]:
    """Strength at which four in five are named, and its standard deviation, of each staircase."""
    prior = np.exp(-0.5 * ((CENTRES - PRIOR[0]) / PRIOR[1]) ** 2)
    prior /= prior.sum()
    posteriors = {w: [prior * _likelihood(one, w) for one in trials] for w in WIDTHS.tolist()}
    width = max(posteriors, key=lambda w: sum(np.log(p.sum()) for p in posteriors[w]))
    found = []
    for posterior in posteriors[width]:
        weight = posterior / posterior.sum()
        at = CENTRES + FOUR_IN_FIVE * width
        mean = float(weight @ at)
        found.append((mean, float(np.sqrt(weight @ (at - mean) ** 2))))
    return found


def _likelihood(trials: Sequence[Trial], width: float) -> NDArray[np.float64]:
    """Of every centre, given what was named."""
    total = np.ones_like(CENTRES)
    for strength, named in trials:
        missed = 1.0 / (1.0 + np.exp(np.clip((strength - CENTRES) / width, -50.0, 50.0)))
        total *= 1.0 - missed if named else missed
    return total


def _between(ends: tuple[float, float], share: float) -> float:
    return float(ends[0] * (ends[1] / ends[0]) ** share)


def block(trials: Mapping[str, Sequence[Trial]], seeds: str) -> list[str]:
    """The thresholds as Markdown."""
    asked = {effect: tried for effect, tried in trials.items() if tried}
    lines = [
        f"{sum(map(len, asked.values()))} runs, seeds {seeds}.",
        "",
        "| cause | named four times in five from | between (68 %) | named, of those tried |",
        "| --- | --- | --- | --- |",
    ]
    found = thresholds(list(asked.values()))
    for (effect, tried), (at, std) in zip(asked.items(), found, strict=True):
        where, low, high = (_within(effect, end) for end in (at, at - std, at + std))
        named = sum(found for _, found in tried)
        lines.append(f"| {effect} | {where} | {low}; {high} | {named} of {len(tried)} |")
    return lines


def main(runs: int = 4, seed: int | None = None, lines: str = "build/smallest.jsonl") -> None:
    """Climb every staircase and write the block."""
    seed, kept = drawn_seed(seed), Kept(lines)
    trials: dict[str, list[Trial]] = {effect: [] for effect in EVERY_EFFECT}
    for one in kept.outcomes:
        trials[one["effect"]].append((one["strength"], one["named"]))
    print(f"seed {seed}, {runs} runs of each", flush=True)
    for turn in range(runs):
        for number, effect in enumerate(EVERY_EFFECT):
            if len(trials[effect]) > turn:
                continue
            rng = np.random.default_rng([seed, turn, number])
            strength = next_strength(trials[effect])
            named = is_named(effect, sized(UNIT, effect, strength, rng), rng)
            trials[effect].append((strength, named))
            kept.add({"seed": seed, "effect": effect, "strength": strength, "named": named})
            print(turn, effect, worded(effect, strength), "named" if named else "-", flush=True)
    text = block(trials, kept.seeds)
    replace_block("smallest", text, PAGE)
    print("\n".join(text))


if __name__ == "__main__":
    main(*(int(a) for a in sys.argv[1:3]), *sys.argv[3:4])
