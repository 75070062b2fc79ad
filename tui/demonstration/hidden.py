"""What the demonstration hides, and how a diagnosis compares with it.

Owns the standing choice, the drawn one, and the words for right and wrong. It
measures and diagnoses nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from sim.effects import EffectSetting
    from sim.unit import Unit

__all__ = [
    "BAND_HZ", "Hidden", "Outcome", "behind_address", "compare", "drawn", "standing", "worded",
]  # fmt: skip

BAND_HZ = (110.0, 170.0)
"""What the demonstration sweeps: around both resonances of the paper's ADSS."""

_SEEDS = 10_000

Outcome = Literal["named", "not alone", "among the rivals", "missed"]


@dataclass(frozen=True, slots=True)
class Hidden:
    """A unit's secret: its contribution ratio, the effect it has, and the seed of its motion."""

    ratio: float
    effect: EffectSetting
    seed: int


def standing() -> Hidden:
    """What is hidden unless a surprise is asked for."""
    from sim.effects import parse_effect

    return Hidden(0.3, parse_effect("load-viscous-damping:B_L=0.15"), seed=1)


def drawn(unit: Unit, seed: int | None) -> Hidden:
    """Something at random; the same for the same seed."""
    import numpy as np

    from sim.drawn_effects import draw_effect

    if seed is None:
        seed = int(np.random.default_rng().integers(_SEEDS))
    rng = np.random.default_rng(seed)
    return Hidden(float(rng.uniform(0.15, 0.85)), draw_effect(unit, BAND_HZ, rng), seed)


def behind_address(url: str, unit: Unit) -> Hidden | None:
    """What a simulated bench of an address hides; None where it hides nothing."""
    from daq.drivers import is_simulated
    from sim.drawn_effects import draw_hidden
    from sim.loopback import read_loopback_settings

    _, mark, rest = url.partition("?")
    if not (mark and is_simulated(url)):
        return None
    seed = read_loopback_settings(f"?{rest}").hidden
    if seed is None:
        return None
    ratio, effect = draw_hidden(unit, seed)
    return Hidden(ratio, effect, seed)


def compare(hidden: Hidden, document: Mapping[str, Any]) -> Outcome:
    """Whether a diagnosis found what was hidden.

    Parameters
    ----------
    document
        Of ``diagnose --json``.
    """
    named = [cause["effect"] for cause in document["causes"]]
    if named == [hidden.effect.id]:
        return "named" if document["verdict"] == "explained" else "not alone"
    if hidden.effect.id in named or any(
        hidden.effect.id in rival["causes"] for rival in document["rivals"]
    ):
        return "among the rivals"
    return "missed"


_WORDS: Mapping[Outcome, str] = {
    "named": "The diagnosis named it.",
    "not alone": "The diagnosis named it first, but could not rule out others.",
    "among the rivals": "The diagnosis had it on its list, but did not name it alone.",
    "missed": "The diagnosis missed it.",
}


def worded(
    hidden: Hidden, outcome: Outcome, document: Mapping[str, Any], guess: str | None
) -> Sequence[str]:
    """Lines that tell what was hidden, beside what was found and what was guessed."""
    from analysis.answer import accept_model
    from sim.catalogue import CATALOGUE

    effect = CATALOGUE[hidden.effect.id]
    lines = [f"Hidden was {effect.id}. {effect.meaning} On the bench: {effect.bench_cause}."]
    lines.append(_WORDS[outcome])
    found = {cause["effect"]: cause["parameters"] for cause in document["causes"]}
    for parameter in effect.parameters:
        symbol = "" if parameter.unit_symbol == "1" else f" {parameter.unit_symbol}"
        line = f"  {parameter.name}: true {hidden.effect.values[parameter.name]:.4g}{symbol}"
        size = found.get(effect.id, {}).get(parameter.name)
        if size is not None:
            line += f", found {size['value']:.4g} +- {size['std']:.2g}{symbol}"
        lines.append(line)
    answer = accept_model(None, document)
    ratio = answer.contribution_ratio
    found_ratio = "" if ratio is None else f"found {ratio['value']:.3f} +- {ratio['std']:.3f}, "
    lines.append(f"  contribution ratio: true {hidden.ratio:.3f}, {found_ratio}{answer.source}")
    if guess is not None:
        lines.append(f"  your guess, {guess}: {'right' if guess == effect.id else 'not it'}")
    return lines
